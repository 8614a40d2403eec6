//! `groma.io.wheels`: the readings of a recording's wheels, through the one reader of them.

use crate::border::{self, In2, Out};
use crate::findings::{self, to_rows};
use groma_geometry::Se2;
use groma_models::{Finding, Odometry, WheelKind};
use groma_pipeline::message::WheelReading;
use groma_pipeline::wheels::VirtualWheels;
use groma_pipeline::{Message, Order, WheelRecord, disorder};
use numpy::ndarray::Array2;
use pyo3::prelude::*;

/// Stamps, readings (n, 2), breaks (b, 2), findings.
type Rows = (border::Array1<f64>, border::Array2<f64>, border::Array2<f64>, Vec<findings::Row>);

/// How late the messages of a recorded stream come, at most [s].
#[pyfunction]
pub(crate) fn stamp_disorder(stamps: Vec<f64>) -> f64 {
    disorder(stamps)
}

/// `table` has stamp, joint (0 or 1) and position a row, in the order of arrival.
#[pyfunction]
pub(crate) fn read_wheels<'py>(py: Python<'py>, steered: bool, table: In2<'py, f64>) -> Rows {
    let kind = if steered { WheelKind::Steered } else { WheelKind::Differential };
    let reading =
        |r: numpy::ndarray::ArrayView1<'_, f64>| WheelReading { stamp: r[0], positions: vec![(r[1] as usize, r[2])] };
    let messages = table.as_array().rows().into_iter().map(reading).collect();
    let (record, findings) = py.detach(|| WheelRecord::read(kind, messages));
    to_arrays(py, &record, &findings)
}

/// `table` has stamp, x, y and heading of an odometry a row, in the order of arrival.
#[pyfunction]
pub(crate) fn read_odometry_as_wheels<'py>(py: Python<'py>, table: In2<'py, f64>, axle: f64) -> Rows {
    let rows = table.as_array();
    let odometry = |r: numpy::ndarray::ArrayView1<'_, f64>| Odometry { stamp: r[0], pose: Se2::new(r[1], r[2], r[3]) };
    let mut order = Order::new(disorder(rows.column(0).iter().copied()));
    let mut ordered: Vec<Message> =
        rows.rows().into_iter().flat_map(|r| order.push(Message::Odometry(odometry(r)))).collect();
    ordered.extend(order.drain());
    let mut wheels = VirtualWheels::new(axle);
    let made = ordered.iter().filter_map(|message| match message {
        Message::Odometry(odometry) => wheels.push(odometry),
        _ => None,
    });
    let made = made.collect();
    let (record, mut findings) = WheelRecord::read(WheelKind::Differential, made);
    findings.extend(order.findings());
    findings.extend(wheels.findings());
    to_arrays(py, &record, &findings)
}

fn to_arrays(py: Python<'_>, record: &WheelRecord, findings: &[Finding]) -> Rows {
    let (readings, breaks) = (record.readings(), record.breaks());
    (
        record.times().to_vec().out(py),
        Array2::from_shape_fn((readings.len(), 2), |(k, c)| readings[k][c]).out(py),
        Array2::from_shape_fn((breaks.len(), 2), |(k, c)| [breaks[k].0, breaks[k].1][c]).out(py),
        to_rows(findings),
    )
}

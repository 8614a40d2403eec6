//! `groma.vehicle_calibration`: messages in the order of their arrival into the pipeline, its outcome as arrays.

use crate::border::{self, In1, Out};
use crate::calibration::{VehicleEstimate, estimate};
use crate::findings::{Row, to_rows};
use crate::pose_graph::estimation_error;
use crate::token::{Token, interruptible};
use groma_calibration::vehicle;
use groma_geometry::Se2;
use groma_models::{BeamGeometry, LaserScan, Odometry};
use groma_pipeline::Message;
use groma_pipeline::calibrate::{self, Error, Outcome, Settings, missed, more_driving};
use groma_pipeline::message::WheelReading;
use groma_pipeline::wheels::VirtualWheels;
use nalgebra::Matrix3;
use numpy::ndarray::{Array2, Array3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use std::collections::BTreeMap;

/// How many times the driving so far it takes to bring a half-width to a tolerance.
#[pyfunction]
pub(crate) fn driving_factor(half_width: f64, tolerance: f64) -> f64 {
    more_driving(half_width, tolerance)
}

/// Calibrates a vehicle from its messages; `axle` is that of wheels made from odometry [m].
#[pyclass(module = "groma._core")]
pub(crate) struct CalibrateVehicle {
    core: calibrate::CalibrateVehicle,
    made: VirtualWheels,
}

#[pymethods]
impl CalibrateVehicle {
    #[new]
    fn new(py: Python<'_>, settings: &str, axle: f64) -> PyResult<Self> {
        let settings: Settings = crate::calibration::parse(settings)?;
        let core = calibrate::CalibrateVehicle::new(settings).map_err(|e| raise(py, &e))?;
        Ok(Self { core, made: VirtualWheels::new(axle) })
    }

    /// Readings of joints: which of the two, and its position.
    fn push_wheels(&mut self, stamp: f64, positions: Vec<(usize, f64)>) {
        self.core.push(Message::Wheels(WheelReading { stamp, positions }));
    }

    /// Odometry of the vehicle that represents its wheels.
    fn push_odometry(&mut self, stamp: f64, x: f64, y: f64, theta: f64) {
        let odometry = Odometry { stamp, pose: Se2::new(x, y, theta) };
        if let Some(reading) = self.made.push(&odometry) {
            self.core.push(Message::Wheels(reading));
        }
    }

    /// A pose of the sensor.
    fn push_pose(&mut self, stamp: f64, x: f64, y: f64, theta: f64) {
        self.core.push(Message::Odometry(Odometry { stamp, pose: Se2::new(x, y, theta) }));
    }

    /// A scan; `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`.
    fn push_scan(&mut self, py: Python<'_>, stamp: f64, ranges: In1<'_, f64>, beams: (f64, f64, f64, f64, f64)) {
        let (angle_min, angle_increment, time_increment, range_min, range_max) = beams;
        let geometry = BeamGeometry { angle_min, angle_increment, time_increment, range_min, range_max };
        let scan = LaserScan { stamp, geometry, ranges: ranges.as_array().to_vec(), intensities: Vec::new() };
        py.detach(|| self.core.push(Message::Scan { scanner: 0, scan }));
    }

    /// Readings of the wheels, observations of the sensor, scans kept, whether the wheels stand.
    fn state(&self) -> (usize, usize, usize, bool) {
        let state = self.core.state();
        (state.readings, state.sights, state.kept, state.stands)
    }

    /// What was noticed about the messages so far.
    fn findings(&self) -> Vec<Row> {
        let mut all = self.core.findings();
        all.extend(self.made.findings());
        to_rows(&all)
    }

    /// What the messages so far give.
    #[pyo3(signature = (token=None, show=None))]
    fn snapshot(
        &self,
        py: Python<'_>,
        token: Option<&Token>,
        show: Option<border::Progress>,
    ) -> PyResult<CalibrationOutcome> {
        let found = interruptible(py, token, show.as_ref(), |token| self.core.snapshot(token))?;
        self.outcome(py, found)
    }

    /// What all messages give.
    #[pyo3(signature = (token=None, show=None))]
    fn finish(
        &mut self,
        py: Python<'_>,
        token: Option<&Token>,
        show: Option<border::Progress>,
    ) -> PyResult<CalibrationOutcome> {
        let core = &mut self.core;
        let found = interruptible(py, token, show.as_ref(), |token| core.finish(token))?;
        self.outcome(py, found)
    }
}

impl CalibrateVehicle {
    fn outcome(&self, py: Python<'_>, found: Result<Outcome, Error>) -> PyResult<CalibrationOutcome> {
        let mut outcome = found.map_err(|e| raise(py, &e))?;
        outcome.findings.extend(self.made.findings());
        Ok(CalibrationOutcome(outcome))
    }
}

/// A row a point.
type Rows = border::Array2<f64>;

/// What a calibration was made of: wheel readings, how the drive was cut, motions of the laser.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct CalibrationData {
    time: border::Array1<f64>,
    readings: border::Array2<f64>,
    breaks: border::Array2<f64>,
    kind: &'static str,
    stations: border::Array2<f64>,
    start: border::Array1<f64>,
    end: border::Array1<f64>,
    motion: border::Array2<f64>,
    covariance: Option<border::Array3<f64>>,
    coupling: Option<border::Array3<f64>>,
    /// Why, first and last stamp [s].
    left_out: Vec<(&'static str, f64, f64)>,
}

/// A calibration with what it was made of.
#[pyclass(frozen, module = "groma._core")]
pub(crate) struct CalibrationOutcome(Outcome);

#[pymethods]
impl CalibrationOutcome {
    /// The estimate, as `vehicle_calibrate` gives it.
    fn estimate(&self, py: Python<'_>) -> VehicleEstimate {
        estimate(py, &self.0.calibration)
    }

    /// What it was made of, as arrays by name.
    fn data(&self, py: Python<'_>) -> CalibrationData {
        let Outcome { log, breaks, segments, motions, left_out, .. } = &self.0;
        let m = &motions.motions;
        let pairs =
            |rows: Vec<(f64, f64)>| Array2::from_shape_fn((rows.len(), 2), |(k, c)| [rows[k].0, rows[k].1][c]).out(py);
        let motion = |(k, c): (usize, usize)| [m[k].motion.x(), m[k].motion.y(), m[k].turn][c];
        CalibrationData {
            time: log.time().to_vec().out(py),
            readings: Array2::from_shape_fn((log.time().len(), 2), |(k, c)| log.reading(k)[c]).out(py),
            breaks: pairs(breaks.clone()),
            kind: segments.kind.name(),
            stations: pairs(segments.stations.iter().map(|s| (s.from, s.to)).collect()),
            start: border::column(py, m.iter().map(|m| m.start)),
            end: border::column(py, m.iter().map(|m| m.end)),
            motion: Array2::from_shape_fn((m.len(), 3), motion).out(py),
            covariance: motions.covariances.as_ref().map(|c| blocks(c).out(py)),
            coupling: motions.couplings.as_ref().map(|c| blocks(c).out(py)),
            left_out: left_out.iter().map(|l| (l.reason.text(), l.span.0, l.span.1)).collect(),
        }
    }

    /// Distance [m] and turn [rad] (m, 2) of every motion, by the wheels.
    fn driven(&self, py: Python<'_>) -> border::Array2<f64> {
        let driven = self.0.driven();
        Array2::from_shape_fn((driven.len(), 2), |(k, c)| driven[k][c]).out(py)
    }

    /// The path of the laser in pieces (k, 2): as measured, and as the wheels tell it.
    fn laser_paths(&self, py: Python<'_>) -> Vec<(Rows, Rows)> {
        let array =
            |points: &[nalgebra::Vector2<f64>]| Array2::from_shape_fn((points.len(), 2), |(k, c)| points[k][c]).out(py);
        self.0.laser_paths().iter().map(|path| (array(&path.measured), array(&path.told))).collect()
    }

    /// All that was noticed.
    fn findings(&self) -> Vec<Row> {
        to_rows(&self.0.findings)
    }

    /// Parameters that are not yet known as well as wanted, by name and tolerance [SI].
    fn missed(&self, tolerances: BTreeMap<String, f64>) -> Vec<Row> {
        to_rows(&missed(&self.0.calibration, &tolerances))
    }
}

fn blocks(all: &[Matrix3<f64>]) -> Array3<f64> {
    Array3::from_shape_fn((all.len(), 3, 3), |(k, r, c)| all[k][(r, c)])
}

/// Data that hold no estimate are an estimation that failed; anything else is a mistake of the caller.
fn raise(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::NoMotion(_) | Error::Estimate(vehicle::Error::TooFew { .. } | vehicle::Error::Degenerate(_)) => {
            estimation_error(py, error.to_string())
        }
        Error::Cancelled(_) | Error::Estimate(vehicle::Error::Cancelled(_)) => {
            PyKeyboardInterrupt::new_err(error.to_string())
        }
        _ => PyValueError::new_err(error.to_string()),
    }
}

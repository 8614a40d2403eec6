//! `groma.vehicle_calibration`: messages in the order of their arrival into the pipeline, its outcome as arrays.

use crate::calibration::to_dict;
use crate::findings::to_list;
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
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::collections::BTreeMap;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<CalibrateVehicle>()?;
    m.add_class::<CalibrationOutcome>()?;
    m.add_function(wrap_pyfunction!(driving_factor, m)?)
}

/// How many times the driving so far it takes to bring a half-width to a tolerance.
#[pyfunction]
fn driving_factor(half_width: f64, tolerance: f64) -> f64 {
    more_driving(half_width, tolerance)
}

/// Calibrates a vehicle from its messages; `axle` is that of wheels made from odometry [m].
#[pyclass]
struct CalibrateVehicle {
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
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: PyReadonlyArray1<'_, f64>,
        beams: (f64, f64, f64, f64, f64),
    ) {
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
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let mut all = self.core.findings();
        all.extend(self.made.findings());
        to_list(py, &all)
    }

    /// What the messages so far give.
    #[pyo3(signature = (token=None, show=None))]
    fn snapshot(&self, py: Python<'_>, token: Option<&Token>, show: Option<Py<PyAny>>) -> PyResult<CalibrationOutcome> {
        let found = interruptible(py, token, show.as_ref(), |token| self.core.snapshot(token))?;
        self.outcome(py, found)
    }

    /// What all messages give.
    #[pyo3(signature = (token=None, show=None))]
    fn finish(
        &mut self,
        py: Python<'_>,
        token: Option<&Token>,
        show: Option<Py<PyAny>>,
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
type Rows<'py> = Bound<'py, PyArray2<f64>>;

/// A calibration with what it was made of.
#[pyclass(frozen)]
struct CalibrationOutcome(Outcome);

#[pymethods]
impl CalibrationOutcome {
    /// The estimate, as `vehicle_calibrate` gives it.
    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        to_dict(py, &self.0.calibration)
    }

    /// What it was made of, as arrays by name.
    fn data<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let Outcome { log, breaks, segments, motions, left_out, .. } = &self.0;
        let (dict, m) = (PyDict::new(py), &motions.motions);
        let column = |of: fn(&vehicle::Motion) -> f64| m.iter().map(of).collect::<Vec<_>>().into_pyarray(py);
        dict.set_item("time", log.time().to_vec().into_pyarray(py))?;
        let readings = Array2::from_shape_fn((log.time().len(), 2), |(k, c)| log.reading(k)[c]);
        dict.set_item("readings", readings.into_pyarray(py))?;
        let pairs = |rows: Vec<(f64, f64)>| {
            Array2::from_shape_fn((rows.len(), 2), |(k, c)| [rows[k].0, rows[k].1][c]).into_pyarray(py)
        };
        dict.set_item("breaks", pairs(breaks.clone()))?;
        dict.set_item("kind", segments.kind.name())?;
        dict.set_item("stations", pairs(segments.stations.iter().map(|s| (s.from, s.to)).collect()))?;
        dict.set_item("start", column(|m| m.start))?;
        dict.set_item("end", column(|m| m.end))?;
        let motion = |(k, c): (usize, usize)| [m[k].motion.x(), m[k].motion.y(), m[k].turn][c];
        dict.set_item("motion", Array2::from_shape_fn((m.len(), 3), motion).into_pyarray(py))?;
        dict.set_item("covariance", motions.covariances.as_ref().map(|c| blocks(c).into_pyarray(py)))?;
        dict.set_item("coupling", motions.couplings.as_ref().map(|c| blocks(c).into_pyarray(py)))?;
        let reasons: Vec<_> = left_out.iter().map(|l| (l.reason.text(), l.span.0, l.span.1)).collect();
        dict.set_item("left_out", reasons)?;
        Ok(dict)
    }

    /// Distance [m] and turn [rad] (m, 2) of every motion, by the wheels.
    fn driven<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let driven = self.0.driven();
        Array2::from_shape_fn((driven.len(), 2), |(k, c)| driven[k][c]).into_pyarray(py)
    }

    /// The path of the laser in pieces (k, 2): as measured, and as the wheels tell it.
    fn laser_paths<'py>(&self, py: Python<'py>) -> Vec<(Rows<'py>, Rows<'py>)> {
        let array = |points: &[nalgebra::Vector2<f64>]| {
            Array2::from_shape_fn((points.len(), 2), |(k, c)| points[k][c]).into_pyarray(py)
        };
        self.0.laser_paths().iter().map(|path| (array(&path.measured), array(&path.told))).collect()
    }

    /// All that was noticed.
    fn findings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        to_list(py, &self.0.findings)
    }

    /// Parameters that are not yet known as well as wanted, by name and tolerance [SI].
    fn missed<'py>(&self, py: Python<'py>, tolerances: BTreeMap<String, f64>) -> PyResult<Bound<'py, PyList>> {
        to_list(py, &missed(&self.0.calibration, &tolerances))
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

//! `groma.localize`: messages pushed one by one, the drive in the frame of the map as arrays.

use crate::findings;
use crate::gate::{self, Beams};
use crate::localization::{Matrix, Pose, Table, matrix, quality, status, to_grid, to_map};
use crate::mapping::{landmarks, laser_scan, matrices, poses};
use crate::token::{Token, interruptible};
use crate::vehicle::to_vehicle;
use groma_geometry::Se2;
use groma_localization::Observation;
use groma_models::{LandmarkKind, Odometry};
use groma_pipeline::Message;
use groma_pipeline::localize::{
    Begin, Error, Event, Fix, Localize as Core, Localized, Observer as CoreObserver, Options, Setup,
};
use groma_pipeline::message::{StartPose, WheelReading};
use numpy::ndarray::{Array1, Array2};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(localize_defaults, m)?)?;
    m.add_class::<Observer>()?;
    m.add_class::<Localize>()
}

/// The settings of localizing a drive and their defaults, as JSON.
#[pyfunction]
fn localize_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(invalid)
}

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Observations as `Localizer.update` takes them: stamp, range, bearing, covariance (4), orientation a row; which are
/// reflectors; descriptors.
type Observed<'py> = (Matrix<'py>, Bound<'py, PyArray1<bool>>, Bound<'py, PyArray2<u8>>);

/// Corners and reflectors of the scans of a scanner.
#[pyclass]
#[derive(Default)]
struct Observer(CoreObserver);

#[pymethods]
impl Observer {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Corners in beam order, then reflectors.
    fn observe<'py>(
        &mut self,
        py: Python<'py>,
        stamp: f64,
        ranges: PyReadonlyArray1<'py, f64>,
        intensities: PyReadonlyArray1<'py, f64>,
        beams: Beams,
    ) -> PyResult<Observed<'py>> {
        let all = self.0.observe(&laser_scan(stamp, &ranges, &intensities, beams)?);
        let row = |o: &Observation| {
            let c = &o.covariance;
            let orientation = o.orientation.unwrap_or(f64::NAN);
            [o.stamp, o.polar.x, o.polar.y, c.m11, c.m12, c.m21, c.m22, orientation]
        };
        let flat: Vec<f64> = all.iter().flat_map(row).collect();
        let cells: Vec<u8> = all.iter().flat_map(|o| o.descriptor.unwrap_or(0).to_le_bytes()).collect();
        let reflectors = all.iter().map(|o| o.kind == LandmarkKind::Reflector);
        Ok((
            Array2::from_shape_vec((all.len(), 8), flat).unwrap_or_default().into_pyarray(py),
            PyArray1::from_iter(py, reflectors),
            Array2::from_shape_vec((all.len(), 16), cells).unwrap_or_default().into_pyarray(py),
        ))
    }
}

/// Resolution, origin, cells.
type Walls<'py> = (f64, (f64, f64), PyReadonlyArray2<'py, i8>);
/// Stamp, pose, covariance, quality.
type Now<'py> = (f64, Pose, Matrix<'py>, Bound<'py, PyDict>);
/// A column of the result.
type Column<T> = (&'static str, fn(&Fix) -> T);
/// A fix and whether it was there before.
type Row = (usize, bool);

/// A drive on its way through the localizer.
#[pyclass]
struct Localize(Core);

#[pymethods]
impl Localize {
    /// The map as for `Localizer`; `begin` with its covariance or without, `mount` is `T_base_laser`, a vehicle is JSON.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the arrays of one constructor")]
    fn new(
        py: Python<'_>,
        landmarks: Table<'_>,
        reflector: PyReadonlyArray1<'_, bool>,
        descriptors: PyReadonlyArray2<'_, u8>,
        grid: Option<Walls<'_>>,
        begin: Option<(Pose, Option<Table<'_>>)>,
        mount: Pose,
        vehicle: Option<&str>,
        options: &str,
        token: Option<&Token>,
    ) -> PyResult<Self> {
        let begin = match begin {
            None => Begin::Unknown,
            Some((pose, None)) => Begin::About(gate::pose(pose)?),
            Some((pose, Some(covariance))) => Begin::At(gate::pose(pose)?, matrix::<3, 3>(&covariance)),
        };
        let setup = Setup {
            map: to_map(&landmarks, &reflector, &descriptors),
            grid: grid.map(|(resolution, origin, cells)| to_grid(resolution, origin, &cells)).transpose()?,
            begin,
            mount: gate::pose(mount)?,
            vehicle: vehicle.map(to_vehicle).transpose()?,
            options: serde_json::from_str(options).map_err(invalid)?,
        };
        let made = interruptible(py, token, None, move |_| Core::new(setup))?;
        Ok(Self(made.map_err(invalid)?))
    }

    /// The fixes that are new or were corrected.
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: PyReadonlyArray1<'_, f64>,
        intensities: PyReadonlyArray1<'_, f64>,
        beams: Beams,
    ) -> PyResult<Vec<Row>> {
        let scan = laser_scan(stamp, &ranges, &intensities, beams)?;
        let core = &mut self.0;
        Ok(rows(py.detach(|| core.push(Message::Scan { scanner: 0, scan }))))
    }

    /// A reading that is not finite or out of its bound is left out and counted.
    fn push_odometry(&mut self, stamp: f64, pose: Pose) -> Vec<Row> {
        let (x, y, theta) = pose;
        rows(self.0.push(Message::Odometry(Odometry { stamp, pose: Se2::new(x, y, theta) })))
    }

    /// Joint (0 or 1) and position of each.
    fn push_wheels(&mut self, stamp: f64, positions: Vec<(usize, f64)>) -> PyResult<Vec<Row>> {
        let reading = WheelReading::new(stamp, positions).map_err(invalid)?;
        Ok(rows(self.0.push(Message::Wheels(reading))))
    }

    fn push_start(&mut self, stamp: f64, pose: Pose, covariance: Table<'_>) -> PyResult<Vec<Row>> {
        let start = StartPose { stamp, pose: gate::pose(pose)?, covariance: matrix::<3, 3>(&covariance) };
        Ok(rows(self.0.push(Message::StartPose(start))))
    }

    /// Stamp, pose, covariance, quality; none before the first message.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Option<Now<'py>>> {
        let Some(s) = self.0.state() else { return Ok(None) };
        let covariance = Array2::from_shape_fn((3, 3), |(i, j)| s.covariance[(i, j)]).into_pyarray(py);
        Ok(Some((s.stamp, (s.pose.x(), s.pose.y(), s.pose.theta()), covariance, quality(py, &s.quality)?)))
    }

    /// The result so far.
    fn snapshot<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core = &self.0;
        to_dict(py, &py.detach(|| core.snapshot()).map_err(unfinished)?)
    }

    /// Takes what still waits; the result.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core = &mut self.0;
        to_dict(py, &py.detach(|| core.finish()).map_err(unfinished)?)
    }
}

fn unfinished(error: Error) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

fn rows(events: Vec<Event>) -> Vec<Row> {
    events.into_iter().map(|event| (event.scan, event.corrected)).collect()
}

fn to_dict<'py>(py: Python<'py>, r: &Localized) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    let track = &r.track;
    let covariances: Vec<_> = track.iter().map(|fix| fix.covariance).collect();
    let path: Vec<_> = track.iter().map(|fix| fix.pose).collect();
    let driven = track.iter().scan(0.0, |sum, fix| {
        *sum += fix.distance;
        Some(*sum)
    });
    out.set_item("poses", poses(path.iter()).into_pyarray(py))?;
    out.set_item("covariances", matrices(&covariances).into_pyarray(py))?;
    out.set_item("status", track.iter().map(|fix| status(fix.quality.status)).collect::<Vec<_>>())?;
    out.set_item("distance", driven.collect::<Array1<f64>>().into_pyarray(py))?;
    out.set_item("corrected", track.iter().map(|fix| fix.corrected).collect::<Array1<bool>>().into_pyarray(py))?;
    columns(py, &out, track)?;
    out.set_item("used", r.used.iter().map(|n| *n as i64).collect::<Array1<i64>>().into_pyarray(py))?;
    let halt = |h: &groma_pipeline::localize::Halt| {
        (h.from, h.to, (h.pose.x(), h.pose.y(), h.pose.theta()), h.sigma, h.scatter, h.matched)
    };
    out.set_item("halts", r.halts.iter().map(halt).collect::<Vec<_>>())?;
    let weak = |w: &groma_pipeline::localize::Weak| (w.from, w.to, (w.place[0], w.place[1]), w.sigma, w.why.text());
    out.set_item("weak", r.weak.iter().map(weak).collect::<Vec<_>>())?;
    out.set_item("counts", counts(r))?;
    out.set_item("findings", findings::to_list(py, &r.findings)?)?;
    let seen = PyDict::new(py);
    if let Some(map) = &r.seen {
        landmarks(py, &seen, map)?;
    }
    out.set_item("seen", r.seen.as_ref().map(|_| seen))?;
    Ok(out)
}

fn columns(py: Python<'_>, out: &Bound<'_, PyDict>, track: &[Fix]) -> PyResult<()> {
    let floats: [Column<f64>; 6] = [
        ("stamps", |fix| fix.stamp),
        ("sigma_position", |fix| fix.quality.sigma_position),
        ("sigma_heading", |fix| fix.quality.sigma_heading),
        ("geometry", |fix| fix.quality.geometry),
        ("nis", |fix| fix.quality.nis),
        ("extrapolated", |fix| fix.extrapolated),
    ];
    for (name, of) in floats {
        out.set_item(name, track.iter().map(of).collect::<Array1<f64>>().into_pyarray(py))?;
    }
    let numbers: [Column<usize>; 3] = [
        ("observed", |fix| fix.quality.observed),
        ("matched", |fix| fix.quality.matched),
        ("dof", |fix| fix.quality.dof),
    ];
    for (name, of) in numbers {
        out.set_item(name, track.iter().map(|fix| of(fix) as i64).collect::<Array1<i64>>().into_pyarray(py))?;
    }
    Ok(())
}

fn counts(r: &Localized) -> Vec<(&'static str, usize)> {
    let c = &r.counts;
    let all = [
        ("scans_read", c.scans_read),
        ("odometry_read", c.odometry_read),
        ("wheels_read", c.wheels_read),
        ("messages_passed_over", c.passed_over),
        ("times_lost", r.times_lost()),
        ("scans_corrected", r.corrected()),
    ];
    all.into_iter().filter(|(name, count)| *count > 0 || *name == "times_lost").collect()
}

//! `groma.localize`: messages pushed one by one, the drive in the frame of the map as arrays.

use crate::border::{self, In1, In2, Out};
use crate::findings;
use crate::gate::{self, Beams};
use crate::localization::{Matrix, Pose, PoseQuality, Table, matrix, quality, status, to_grid, to_map};
use crate::mapping::{LandmarkArrays, landmarks, laser_scan, matrices, poses};
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
use numpy::ndarray::Array2;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// The settings of localizing a drive and their defaults, as JSON.
#[pyfunction]
pub(crate) fn localize_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(invalid)
}

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Observations as `Localizer.update` takes them: stamp, range, bearing, covariance (4), orientation a row; which are
/// reflectors; descriptors.
type Observed = (Matrix, border::Array1<bool>, border::Array2<u8>);

/// Corners and reflectors of the scans of a scanner.
#[pyclass(module = "groma._core")]
#[derive(Default)]
pub(crate) struct Observer(CoreObserver);

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
        ranges: In1<'py, f64>,
        intensities: In1<'py, f64>,
        beams: Beams,
    ) -> PyResult<Observed> {
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
            Array2::from_shape_vec((all.len(), 8), flat).unwrap_or_default().out(py),
            reflectors.collect::<numpy::ndarray::Array1<_>>().out(py),
            Array2::from_shape_vec((all.len(), 16), cells).unwrap_or_default().out(py),
        ))
    }
}

/// Resolution, origin, cells.
type Walls<'py> = (f64, (f64, f64), In2<'py, i8>);
/// Stamp, pose, covariance, quality.
type Now = (f64, Pose, border::Array2<f64>, PoseQuality);
/// A fix and whether it was there before.
type Row = (usize, bool);

/// A drive on its way through the localizer.
#[pyclass(module = "groma._core")]
pub(crate) struct Localize(Core);

#[pymethods]
impl Localize {
    /// The map as for `Localizer`; `begin` with its covariance or without, `mount` is `T_base_laser`, a vehicle is JSON.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the arrays of one constructor")]
    fn new(
        py: Python<'_>,
        landmarks: Table<'_>,
        reflector: In1<'_, bool>,
        descriptors: In2<'_, u8>,
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
        ranges: In1<'_, f64>,
        intensities: In1<'_, f64>,
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
    fn state(&self, py: Python<'_>) -> Option<Now> {
        let s = self.0.state()?;
        let covariance = Array2::from_shape_fn((3, 3), |(i, j)| s.covariance[(i, j)]).out(py);
        Some((s.stamp, (s.pose.x(), s.pose.y(), s.pose.theta()), covariance, quality(&s.quality)))
    }

    /// The result so far.
    fn snapshot(&self, py: Python<'_>) -> PyResult<LocalizedDrive> {
        let core = &self.0;
        to_arrays(py, &py.detach(|| core.snapshot()).map_err(unfinished)?)
    }

    /// Takes what still waits; the result.
    fn finish(&mut self, py: Python<'_>) -> PyResult<LocalizedDrive> {
        let core = &mut self.0;
        to_arrays(py, &py.detach(|| core.finish()).map_err(unfinished)?)
    }
}

fn unfinished(error: Error) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

fn rows(events: Vec<Event>) -> Vec<Row> {
    events.into_iter().map(|event| (event.scan, event.corrected)).collect()
}

/// First and last stamp, place, sigma [m], why.
type WeakStretch = (f64, f64, (f64, f64), f64, &'static str);

/// A localized drive.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct LocalizedDrive {
    stamps: border::Array1<f64>,
    poses: border::Array2<f64>,
    covariances: border::Array3<f64>,
    status: Vec<&'static str>,
    observed: border::Array1<i64>,
    matched: border::Array1<i64>,
    nis: border::Array1<f64>,
    dof: border::Array1<i64>,
    sigma_position: border::Array1<f64>,
    sigma_heading: border::Array1<f64>,
    geometry: border::Array1<f64>,
    distance: border::Array1<f64>,
    extrapolated: border::Array1<f64>,
    corrected: border::Array1<bool>,
    used: border::Array1<i64>,
    /// First and last stamp, pose, sigma [m], scatter [m], landmarks matched in the mean.
    halts: Vec<(f64, f64, Pose, f64, f64, f64)>,
    /// First and last stamp, place, sigma [m], why.
    weak: Vec<WeakStretch>,
    seen: Option<Py<LandmarkArrays>>,
    counts: Vec<(&'static str, usize)>,
    findings: Vec<findings::Row>,
}

fn to_arrays(py: Python<'_>, r: &Localized) -> PyResult<LocalizedDrive> {
    let track = &r.track;
    let covariances: Vec<_> = track.iter().map(|fix| fix.covariance).collect();
    let path: Vec<_> = track.iter().map(|fix| fix.pose).collect();
    let driven = track.iter().scan(0.0, |sum, fix| {
        *sum += fix.distance;
        Some(*sum)
    });
    let floats = |of: fn(&Fix) -> f64| border::column(py, track.iter().map(of));
    let numbers = |of: fn(&Fix) -> usize| border::column(py, track.iter().map(|fix| of(fix) as i64));
    let halt = |h: &groma_pipeline::localize::Halt| {
        (h.from, h.to, (h.pose.x(), h.pose.y(), h.pose.theta()), h.sigma, h.scatter, h.matched)
    };
    let weak = |w: &groma_pipeline::localize::Weak| (w.from, w.to, (w.place[0], w.place[1]), w.sigma, w.why.text());
    Ok(LocalizedDrive {
        stamps: floats(|fix| fix.stamp),
        poses: poses(path.iter()).out(py),
        covariances: matrices(&covariances).out(py),
        status: track.iter().map(|fix| status(fix.quality.status)).collect(),
        observed: numbers(|fix| fix.quality.observed),
        matched: numbers(|fix| fix.quality.matched),
        nis: floats(|fix| fix.quality.nis),
        dof: numbers(|fix| fix.quality.dof),
        sigma_position: floats(|fix| fix.quality.sigma_position),
        sigma_heading: floats(|fix| fix.quality.sigma_heading),
        geometry: floats(|fix| fix.quality.geometry),
        distance: border::column(py, driven),
        extrapolated: floats(|fix| fix.extrapolated),
        corrected: border::column(py, track.iter().map(|fix| fix.corrected)),
        used: border::column(py, r.used.iter().map(|n| *n as i64)),
        halts: r.halts.iter().map(halt).collect(),
        weak: r.weak.iter().map(weak).collect(),
        seen: r.seen.as_ref().map(|map| Py::new(py, landmarks(py, map))).transpose()?,
        counts: counts(r),
        findings: findings::to_rows(&r.findings),
    })
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

//! `groma.localization`: a vehicle on a landmark map, as arrays.

use crate::border::{self, In1, In2, Out};
use crate::gate;
use crate::mapping::matrices;
use groma_localization::{
    CALIBRATION, DRIVE, Error, LocalView, Localizer as Core, Located, Motion, Observation, Options, Quality,
    RelocalizeOptions, Relocalizer as CoreRelocalizer, Start, Status, Update, sees,
};
use groma_models::{Cell, Differential, Drive, Grid, Landmark, LandmarkKind, LandmarkMap, LaserScan, Tricycle};
use nalgebra::{Matrix2, SMatrix, Vector2, Vector3};
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::Arc;

/// The settings of localization and of relocalization, and their defaults, as JSON.
#[pyfunction]
pub(crate) fn localization_defaults() -> PyResult<(String, String)> {
    let failed = |e: serde_json::Error| PyValueError::new_err(e.to_string());
    let options = serde_json::to_string(&Options::default()).map_err(failed)?;
    let relocalize = serde_json::to_string(&RelocalizeOptions::default()).map_err(failed)?;
    Ok((options, relocalize))
}

fn parse<T: serde::de::DeserializeOwned>(options: &str) -> PyResult<T> {
    serde_json::from_str(options).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Motion, covariance of its perturbation and derivative by the drive of a step of the wheels.
#[pyfunction]
pub(crate) fn wheel_motion<'py>(
    py: Python<'py>,
    tricycle: bool,
    parameters: [f64; DRIVE],
    step: (f64, f64),
    duration: f64,
    noise: &str,
) -> PyResult<(Pose, Matrix, Matrix)> {
    let drive = match tricycle {
        true => Drive::Tricycle(Tricycle::from_parameters(parameters)),
        false => Drive::Differential(Differential::from_parameters(parameters)),
    };
    let m = Motion::of_wheels(&drive, Vector2::new(step.0, step.1), duration, &parse(noise)?);
    let covariance = Array2::from_shape_fn((3, 3), |(i, j)| m.covariance[(i, j)]);
    let by_drive = Array2::from_shape_fn((3, DRIVE), |(i, j)| m.by_drive[(i, j)]);
    Ok(((m.motion.x(), m.motion.y(), m.motion.theta()), covariance.out(py), by_drive.out(py)))
}

/// A map that places are looked for on.
#[pyclass(frozen, module = "groma._core")]
pub(crate) struct Relocalizer(Arc<CoreRelocalizer>);

#[pymethods]
impl Relocalizer {
    /// `landmarks` as for the localizer; `grid` is resolution, origin and cells (-1 unknown, 0 free, 100 occupied).
    #[new]
    fn new(
        py: Python<'_>,
        landmarks: Table<'_>,
        reflector: In1<'_, bool>,
        descriptors: In2<'_, u8>,
        grid: Option<(f64, (f64, f64), In2<'_, i8>)>,
        options: &str,
    ) -> PyResult<Self> {
        let options: RelocalizeOptions = parse(options)?;
        let map = to_map(&landmarks, &reflector, &descriptors);
        let grid = grid.map(|(resolution, origin, cells)| to_grid(resolution, origin, &cells)).transpose()?;
        let core = py.detach(|| CoreRelocalizer::new(map, grid, options)).map_err(invalid)?;
        Ok(Self(Arc::new(core)))
    }

    /// Places for what one scan shows: pose, covariance (9), evidence, probability, number of pairs.
    fn locate<'py>(
        &self,
        py: Python<'py>,
        observations: Table<'py>,
        reflector: In1<'py, bool>,
        descriptors: In2<'py, u8>,
        scan: Option<Scan<'py>>,
        mount: Pose,
    ) -> PyResult<Vec<Place>> {
        let unknown = vec![-1_i64; observations.as_array().nrows()];
        let observations = to_observations(&observations, &reflector, &descriptors, &unknown);
        let mount = gate::pose(mount)?;
        let mut view = LocalView::default();
        view.see(&observations.into_iter().map(|o| (o, mount)).collect::<Vec<_>>());
        if let Some((beams, ranges)) = scan {
            view.look(&to_scan(0.0, 0.0, beams, &ranges)?, &mount, Vector3::zeros());
        }
        let found = py.detach(|| self.0.locate(&view));
        let row = |l: Located| {
            let covariance = Array2::from_shape_fn((3, 3), |(i, j)| l.covariance[(i, j)]).out(py);
            ((l.pose.x(), l.pose.y(), l.pose.theta()), covariance, l.evidence, l.probability, l.pairs.len())
        };
        Ok(found.into_iter().map(row).collect())
    }
}

pub(crate) type Pose = (f64, f64, f64);
pub(crate) type Matrix = border::Array2<f64>;
/// Pose, covariance, evidence, probability, number of pairs.
type Place = (Pose, Matrix, f64, f64, usize);
/// Stamp, time between beams, the beams, their ranges.
type TimedScan<'py> = (f64, f64, (f64, f64, f64, f64), In1<'py, f64>);
pub(crate) type Table<'py> = In2<'py, f64>;
/// Scan to tell what is in view: angle_min, angle_increment, range_min, range_max; readings.
type Scan<'py> = ((f64, f64, f64, f64), In1<'py, f64>);

/// A vehicle on a map.
#[pyclass(module = "groma._core")]
pub(crate) struct Localizer(Core);

#[pymethods]
impl Localizer {
    /// `landmarks` are rows of x, y, the covariance (4), orientation, seen, visible.
    #[new]
    #[allow(clippy::too_many_arguments)] // the arrays of one constructor
    fn new(
        landmarks: Table<'_>,
        reflector: In1<'_, bool>,
        descriptors: In2<'_, u8>,
        stamp: f64,
        pose: Option<Pose>,
        covariance: Table<'_>,
        mount: Pose,
        calibration: Option<Table<'_>>,
        relocalizer: Option<&Relocalizer>,
        options: &str,
    ) -> PyResult<Self> {
        let options: Options = parse(options)?;
        let start = Start {
            stamp,
            pose: pose.map(|p| Ok::<_, PyErr>((gate::pose(p)?, matrix::<3, 3>(&covariance)))).transpose()?,
            mount: gate::pose(mount)?,
            calibration: calibration.map(|c| matrix::<CALIBRATION, CALIBRATION>(&c)),
        };
        let map = to_map(&landmarks, &reflector, &descriptors);
        let core = Core::new(map, &start, options).map_err(invalid)?;
        Ok(Self(match relocalizer {
            Some(r) => core.with_relocalizer(r.0.clone()),
            None => core,
        }))
    }

    /// A motion until `stamp` with the covariance of its right perturbation and, optional, its derivative by the drive.
    fn predict(
        &mut self,
        stamp: f64,
        motion: Pose,
        covariance: Table<'_>,
        by_drive: Option<Table<'_>>,
    ) -> PyResult<()> {
        let by_drive = by_drive.map_or_else(SMatrix::zeros, |j| matrix::<3, DRIVE>(&j));
        let motion = Motion { motion: gate::pose(motion)?, covariance: matrix::<3, 3>(&covariance), by_drive };
        self.0.predict(stamp, &motion).map_err(invalid)
    }

    /// The corners and reflectors of a scan: stamp, range, bearing, covariance (4), orientation a row.
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        observations: Table<'py>,
        reflector: In1<'py, bool>,
        descriptors: In2<'py, u8>,
        identities: In1<'py, i64>,
        scan: Option<TimedScan<'py>>,
    ) -> PyResult<LocalizerUpdate> {
        let observations = to_observations(&observations, &reflector, &descriptors, identities.as_slice()?);
        let scan = scan.map(|(stamp, time_increment, beams, ranges)| to_scan(stamp, time_increment, beams, &ranges));
        let scan = scan.transpose()?;
        let core = &mut self.0;
        let update = py.detach(|| match scan {
            Some(scan) => {
                core.look(&scan);
                core.update(&observations, Some(&|polar| sees(&scan.geometry, &scan.ranges, polar)))
            }
            None => core.update(&observations, None),
        });
        to_update(py, &update)
    }

    /// The pose has been found another way.
    fn relocate(&mut self, pose: Pose, covariance: Table<'_>) -> PyResult<()> {
        self.0.relocate(gate::pose(pose)?, &matrix::<3, 3>(&covariance)).map_err(invalid)
    }

    /// Stamp, pose, covariance.
    fn state<'py>(&self, py: Python<'py>) -> (f64, Pose, border::Array2<f64>) {
        let pose = self.0.pose();
        let covariance = self.0.covariance();
        let covariance = Array2::from_shape_fn((3, 3), |(i, j)| covariance[(i, j)]);
        (self.0.stamp(), (pose.x(), pose.y(), pose.theta()), covariance.out(py))
    }

    fn quality(&self) -> PoseQuality {
        quality(&self.0.quality())
    }

    /// Landmarks found during the drive that constrain the pose, and those on trial.
    fn found(&self) -> (usize, usize) {
        let found = self.0.found();
        (found.proven, found.on_trial)
    }
}

fn invalid(error: Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

pub(crate) fn matrix<const R: usize, const C: usize>(table: &Table<'_>) -> SMatrix<f64, R, C> {
    let view = table.as_array();
    SMatrix::from_fn(|i, j| view.get((i, j)).copied().unwrap_or(f64::NAN))
}

fn to_scan(
    stamp: f64,
    time_increment: f64,
    (angle_min, angle_increment, range_min, range_max): (f64, f64, f64, f64),
    ranges: &In1<'_, f64>,
) -> PyResult<LaserScan> {
    gate::scan(stamp, ranges, (angle_min, angle_increment, time_increment, range_min, range_max))
}

pub(crate) fn to_grid(resolution: f64, (x, y): (f64, f64), cells: &In2<'_, i8>) -> PyResult<Grid> {
    let view = cells.as_array();
    let cell = |v: &i8| match v {
        0 => Cell::Free,
        v if *v > 0 => Cell::Occupied,
        _ => Cell::Unknown,
    };
    let (height, width) = view.dim();
    let grid = Grid { resolution, origin: Vector2::new(x, y), width, height, cells: view.iter().map(cell).collect() };
    grid.validate().map_err(gate::refused)?;
    Ok(grid)
}

fn kind(reflector: bool) -> LandmarkKind {
    if reflector { LandmarkKind::Reflector } else { LandmarkKind::Corner }
}

fn some(angle: f64) -> Option<f64> {
    (!angle.is_nan()).then_some(angle)
}

fn cells(descriptors: &In2<'_, u8>, row: usize) -> Option<u128> {
    let view = descriptors.as_array();
    let bytes: [u8; 16] = std::array::from_fn(|k| view[(row, k)]);
    Some(u128::from_le_bytes(bytes)).filter(|c| *c != 0)
}

pub(crate) fn to_map(landmarks: &Table<'_>, reflector: &In1<'_, bool>, descriptors: &In2<'_, u8>) -> LandmarkMap {
    let (rows, reflector) = (landmarks.as_array(), reflector.as_array());
    let landmark = |k: usize| Landmark {
        kind: kind(reflector[k]),
        position: Vector2::new(rows[(k, 0)], rows[(k, 1)]),
        covariance: Matrix2::from_fn(|i, j| rows[(k, 2 + 2 * i + j)]),
        orientation: some(rows[(k, 6)]),
        descriptor: cells(descriptors, k),
        seen: rows[(k, 7)] as u32,
        visible: rows[(k, 8)] as u32,
    };
    LandmarkMap { landmarks: (0..rows.nrows()).map(landmark).collect() }
}

fn to_observations(
    observations: &Table<'_>,
    reflector: &In1<'_, bool>,
    descriptors: &In2<'_, u8>,
    identities: &[i64],
) -> Vec<Observation> {
    let (rows, reflector) = (observations.as_array(), reflector.as_array());
    let observation = |k: usize| Observation {
        stamp: rows[(k, 0)],
        polar: Vector2::new(rows[(k, 1)], rows[(k, 2)]),
        covariance: Matrix2::from_fn(|i, j| rows[(k, 3 + 2 * i + j)]),
        kind: kind(reflector[k]),
        orientation: some(rows[(k, 7)]),
        descriptor: cells(descriptors, k),
        identity: usize::try_from(identities[k]).ok(),
    };
    (0..rows.nrows()).map(observation).collect()
}

/// What a scan changed: M pairings of observations with landmarks.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct LocalizerUpdate {
    /// (M,) index of the observation.
    observation: border::Array1<i64>,
    /// (M,) index of the landmark in the map, or a number beyond for one found during the drive.
    landmark: border::Array1<i64>,
    /// (M,) whether the landmark constrains the pose; one on trial does not.
    holds: border::Array1<bool>,
    /// (M, 2) range [m] and bearing [rad], measured less predicted.
    innovation: border::Array2<f64>,
    /// (M, 2, 2) covariance of the innovation.
    covariance: border::Array3<f64>,
    /// Landmarks begun.
    begun: usize,
    /// Landmarks that constrain the pose from now on.
    proven: usize,
    /// Landmarks forgotten.
    forgotten: usize,
    /// Observations not finite, without range or covariance, or out of range.
    unusable: usize,
    /// Whether the joint search met its cap and nearest neighbours were taken.
    cut_short: bool,
    /// The probability with which the place was found anew, where it was.
    relocated: Option<f64>,
    quality: Py<PoseQuality>,
}

fn to_update(py: Python<'_>, update: &Update) -> PyResult<LocalizerUpdate> {
    let m = &update.matches;
    let covariances: Vec<Matrix2<f64>> = m.iter().map(|m| m.covariance).collect();
    Ok(LocalizerUpdate {
        observation: border::column(py, m.iter().map(|m| m.observation as i64)),
        landmark: border::column(py, m.iter().map(|m| m.landmark as i64)),
        holds: border::column(py, m.iter().map(|m| m.holds)),
        innovation: Array2::from_shape_fn((m.len(), 2), |(k, j)| m[k].innovation[j]).out(py),
        covariance: matrices(&covariances).out(py),
        begun: update.begun,
        proven: update.proven,
        forgotten: update.forgotten,
        unusable: update.unusable,
        cut_short: update.cut_short,
        relocated: update.relocated,
        quality: Py::new(py, quality(&update.quality))?,
    })
}

pub(crate) fn status(status: Status) -> &'static str {
    match status {
        Status::Lost => "lost",
        Status::Coasting => "coasting",
        Status::Tracking => "tracking",
    }
}

/// How good a pose is: to slow down or stop the vehicle by.
#[pyclass(frozen, get_all, eq, module = "groma._core")]
#[derive(PartialEq)]
pub(crate) struct PoseQuality {
    /// `tracking`: landmarks or walls constrain the pose; `coasting`: none does at present; `lost`: the pose was never known,
    /// or evidence says that it is wrong.
    status: &'static str,
    /// Observations of the last scan that could be used.
    observed: usize,
    /// Those that were paired with a landmark that constrains the pose.
    matched: usize,
    /// Degrees of freedom of `nis`.
    dof: usize,
    /// Share matched in the last some hundred observations.
    matched_share: f64,
    /// Sum of squared innovations of the last scan: chi-square with `dof` degrees of freedom if all is well.
    nis: f64,
    /// Standard deviation of the position along its weakest direction [m].
    sigma_position: f64,
    /// Standard deviation of the heading [rad].
    sigma_heading: f64,
    /// Standard deviation along the weakest direction from the last scan alone [m]; infinite below two landmarks.
    geometry: f64,
    /// Logarithm of the likelihood ratio of being lost against being right.
    lost_evidence: f64,
}

pub(crate) fn quality(q: &Quality) -> PoseQuality {
    PoseQuality {
        status: status(q.status),
        observed: q.observed,
        matched: q.matched,
        dof: q.dof,
        matched_share: q.matched_share,
        nis: q.nis,
        sigma_position: q.sigma_position,
        sigma_heading: q.sigma_heading,
        geometry: q.geometry,
        lost_evidence: q.lost_evidence,
    }
}

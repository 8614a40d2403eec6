//! `groma.network` and simulated networks: JSON and arrays in, arrays out. Poses are rows `x y z qx qy qz qw`.

use crate::border::{self, In1, In2, Out};
use crate::camera::{invalid, parse};
use crate::findings::{Row, to_rows};
use crate::poses::{in_space, numbers};
use crate::token::{Token, interruptible};
use groma_geometry::{Se2, Se3};
use groma_models::{Camera, Odometry, Target};
use groma_network::hand_eye;
use groma_network::standstill::Standstill as Core;
use groma_network::survey::result::{sigma_position, sigma_rotation};
use groma_network::survey::{CameraResult, KnownCamera, NetworkMap, Verdict, lens};
use groma_network::view::{Corner, average};
use groma_network::{Error, Options};
use groma_pipeline::message::Detections;
use groma_pipeline::{Message, SurveyCameras};
use groma_simulation::network::{NETWORK_SCENES, NetworkScene, simulate};
use nalgebra::{DMatrix, Matrix6, Vector2};
use numpy::ndarray::{Array2, Array3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// Standard deviations of position [m] and rotation [rad] along their worst directions, by a covariance (6, 6).
#[pyfunction]
pub(crate) fn pose_sigmas(covariance: In2<'_, f64>) -> PyResult<(f64, f64)> {
    let view = covariance.as_array();
    if view.dim() != (6, 6) {
        return Err(PyValueError::new_err(format!("covariance: must be 6 x 6, not {:?}", view.dim())));
    }
    let covariance = Matrix6::from_fn(|i, j| view[(i, j)]);
    Ok((sigma_position(&covariance), sigma_rotation(&covariance)))
}

/// Tells stops from odometry as it comes.
#[pyclass(module = "groma._core")]
#[derive(Default)]
pub(crate) struct Standstill(Core);

#[pymethods]
impl Standstill {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Whether the robot stands at the time of a reading.
    fn push(&mut self, stamp: f64, x: f64, y: f64, theta: f64) -> bool {
        self.0.push(Odometry { stamp, pose: Se2::new(x, y, theta) })
    }

    /// Forgets all: the sender started anew, or its clock was set.
    fn restart(&mut self) {
        self.0.restart();
    }
}

/// The settings of a survey and their defaults, as JSON.
#[pyfunction]
pub(crate) fn network_defaults() -> PyResult<String> {
    border::json(&Options::default())
}

/// Names of the simulated networks.
#[pyfunction]
pub(crate) fn network_scenes() -> Vec<&'static str> {
    NETWORK_SCENES.to_vec()
}

/// A simulated network, as JSON.
#[pyfunction]
pub(crate) fn network_scene(name: &str, seed: u64) -> PyResult<String> {
    serde_json::to_string(&NetworkScene::named(name, seed).map_err(invalid)?).map_err(invalid)
}

/// What a recorder would have of a scene, and the truth.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct SimulatedNetworkArrays {
    odometry: border::Array2<f64>,
    stop_times: border::Array2<f64>,
    stops: border::Array2<f64>,
    cameras: border::Array2<f64>,
    mount: border::Array2<f64>,
    lenses: Vec<String>,
    /// Stop, camera, panel and number of corners of every detection.
    heads: border::Array2<i64>,
    stamps: border::Array1<f64>,
    /// Corners, one detection after the other.
    ids: border::Array1<i64>,
    pixels: border::Array2<f64>,
}

/// Simulates a network.
#[pyfunction]
pub(crate) fn simulate_network(py: Python<'_>, scene: &str) -> PyResult<SimulatedNetworkArrays> {
    let scene: NetworkScene = parse(scene)?;
    let recording = py.detach(|| simulate(&scene)).map_err(invalid)?;
    let lenses: Result<Vec<String>, _> = recording.lenses.iter().map(serde_json::to_string).collect();
    let seen = &recording.seen;
    Ok(SimulatedNetworkArrays {
        odometry: rows(py, recording.odometry.iter().map(|(t, p)| [*t, p.x(), p.y(), p.theta()])),
        stop_times: rows(py, recording.stops.iter().map(|s| [s.from, s.to])),
        stops: poses(py, recording.stops.iter().map(|s| &s.pose)),
        cameras: poses(py, recording.cameras.iter()),
        mount: poses(py, std::iter::once(&recording.mount)),
        lenses: lenses.map_err(invalid)?,
        heads: rows(py, seen.iter().map(|s| [s.stop, s.camera, s.panel, s.ids.len()].map(|v| v as i64))),
        stamps: border::column(py, seen.iter().map(|s| s.stamp)),
        ids: border::column(py, seen.iter().flat_map(|s| s.ids.iter().map(|id| i64::from(*id)))),
        pixels: rows(py, seen.iter().flat_map(|s| s.pixels.iter().map(|p| [p.x, p.y]))),
    })
}

/// A survey that messages are pushed into; `finish` may be called at any time.
#[pyclass(module = "groma._core")]
pub(crate) struct NetworkSurvey(SurveyCameras);

#[pymethods]
impl NetworkSurvey {
    /// `cameras` as JSON with the covariance of each (or None).
    #[new]
    fn new(target: &str, cameras: Vec<(String, String, Option<In2<'_, f64>>)>) -> PyResult<Self> {
        let known = |(name, camera, covariance): (String, String, Option<In2<'_, f64>>)| {
            let covariance = covariance.map(|c| matrix(&c));
            Ok(KnownCamera { name, camera: parse(&camera)?, covariance })
        };
        let cameras = cameras.into_iter().map(known).collect::<PyResult<Vec<_>>>()?;
        SurveyCameras::new(parse(target)?, cameras).map(Self).map_err(invalid)
    }

    /// False when it is not finite.
    fn push_odometry(&mut self, stamp: f64, x: f64, y: f64, theta: f64) -> bool {
        let pose = Se2::new(x, y, theta);
        self.0.push(Message::Odometry(Odometry { stamp, pose }))
    }

    /// False when it makes no sense.
    #[expect(clippy::too_many_arguments, reason = "the fields of one message")]
    fn push_detection(
        &mut self,
        stamp: f64,
        camera: usize,
        panel: usize,
        stop: Option<u64>,
        ids: In1<'_, i64>,
        pixels: In2<'_, f64>,
        sigmas: In1<'_, f64>,
    ) -> bool {
        let (ids, pixels, sigmas) = (ids.as_array(), pixels.as_array(), sigmas.as_array());
        let fits = pixels.dim() == (ids.len(), 2) && sigmas.len() == ids.len();
        let corner =
            |k: usize| (usize::try_from(ids[k]).unwrap_or(usize::MAX), pixels[(k, 0)], pixels[(k, 1)], sigmas[k]);
        let corners = if fits { (0..ids.len()).map(corner).collect() } else { vec![(usize::MAX, 0.0, 0.0, 0.0)] };
        self.0.push(Message::Detections(Detections { stamp, camera, panel, stop, corners }))
    }

    /// Number of the stop that lasts (None while it moves), stops so far, images and stops of each camera.
    fn state(&self) -> (Option<usize>, usize, Vec<(usize, usize)>) {
        let state = self.0.state();
        (state.stop, state.stops, state.views.iter().map(|v| (v.images, v.stops)).collect())
    }

    /// The map.
    #[pyo3(signature = (options, token=None, show=None))]
    fn finish(
        &self,
        py: Python<'_>,
        options: &str,
        token: Option<&Token>,
        show: Option<border::Progress>,
    ) -> PyResult<NetworkArrays> {
        let options: Options = parse(options)?;
        options.check().map_err(invalid)?;
        let found = interruptible(py, token, show.as_ref(), |token| self.0.finish(&options, token))?;
        let found = found.map_err(|e| match e {
            Error::Cancelled(_) => PyKeyboardInterrupt::new_err(e.to_string()),
            _ => PyRuntimeError::new_err(e.to_string()),
        })?;
        to_arrays(py, &found.map, to_rows(&found.findings))
    }
}

/// The map of a camera network.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct NetworkArrays {
    /// Number of the camera, first stop, whether it is still there, views a row.
    camera_heads: border::Array2<i64>,
    cameras: border::Array2<f64>,
    covariances: border::Array3<f64>,
    camera_chi: border::Array1<f64>,
    /// Cameras as JSON, and the covariances of their parameters.
    intrinsics: Vec<String>,
    intrinsics_covariances: Vec<border::Array2<f64>>,
    joint: Option<border::Array2<f64>>,
    halt_stamps: border::Array1<f64>,
    odometry: border::Array2<f64>,
    stop_halts: border::Array1<i64>,
    stops: border::Array2<f64>,
    stop_covariances: border::Array3<f64>,
    mount: border::Array2<f64>,
    mount_covariance: border::Array3<f64>,
    /// Stop, camera, place (-1 for none) of every view.
    views: border::Array2<i64>,
    nis: border::Array1<f64>,
    verdicts: Vec<&'static str>,
    /// Views that were used, and their chi-squares with the number of coordinates.
    used: border::Array1<i64>,
    view_chi: border::Array2<f64>,
    /// Camera, old and new place a row.
    moved: border::Array2<i64>,
    slip: usize,
    residuals: Vec<(&'static str, (f64, usize))>,
    corner_chi_square: Option<f64>,
    height_sigma: f64,
    odometry_error: Option<f64>,
    path_length: f64,
    /// Steps, and whether the batch converged.
    steps: (usize, bool),
    findings: Vec<Row>,
}

fn to_arrays(py: Python<'_>, map: &NetworkMap, findings: Vec<Row>) -> PyResult<NetworkArrays> {
    let (r, all) = (&map.residuals, &map.cameras);
    let lenses: Result<Vec<String>, _> = all.iter().map(|c| serde_json::to_string(&c.intrinsics)).collect();
    let place = |p: Option<usize>| p.map_or(-1, |p| p as i64);
    Ok(NetworkArrays {
        camera_heads: rows(
            py,
            all.iter().map(|c| [c.camera, c.since, usize::from(c.current), c.views].map(|v| v as i64)),
        ),
        cameras: poses(py, all.iter().map(|c| &c.pose)),
        covariances: sixes(all.iter().map(|c| c.covariance)).out(py),
        camera_chi: border::column(py, all.iter().map(CameraResult::chi_square_per_dof)),
        intrinsics: lenses.map_err(invalid)?,
        intrinsics_covariances: all.iter().map(|c| dense(&c.intrinsics_covariance).out(py)).collect(),
        joint: map.joint.as_ref().map(|joint| dense(joint).out(py)),
        halt_stamps: border::column(py, map.stamps.iter().copied()),
        odometry: rows(py, map.odometry.iter().map(|p| [p.x(), p.y(), p.theta()])),
        stop_halts: border::column(py, map.stops.iter().map(|s| s.0 as i64)),
        stops: poses(py, map.stops.iter().map(|s| &s.1)),
        stop_covariances: sixes(map.stops.iter().map(|s| s.2)).out(py),
        mount: poses(py, std::iter::once(&map.mount.0)),
        mount_covariance: sixes(std::iter::once(map.mount.1)).out(py),
        views: rows(py, map.judged.iter().map(|j| [j.stop as i64, j.camera as i64, place(j.place)])),
        nis: border::column(py, map.judged.iter().map(|j| j.nis)),
        verdicts: map.judged.iter().map(|j| verdict(j.verdict)).collect(),
        used: border::column(py, map.used.iter().map(|&k| k as i64)),
        view_chi: rows(py, r.views.iter().map(|v| [v.0, v.1 as f64])),
        moved: rows(py, map.moved.iter().map(|m| [m.camera, m.from, m.to].map(|v| v as i64))),
        slip: map.slip.map_or(0, |slip| slip.cameras),
        residuals: vec![("corners", r.corners()), ("odometry", r.odometry), ("floor", r.floor), ("priors", r.priors)],
        corner_chi_square: map.corner_chi_square(),
        height_sigma: map.height_sigma(),
        odometry_error: map.odometry_error(),
        path_length: map.path_length(),
        steps: map.steps,
        findings,
    })
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Born => "first sight",
        Verdict::Taken => "taken",
        Verdict::Rejected => "rejected",
        Verdict::Undecided => "undecided",
        Verdict::NoPose => "no pose",
    }
}

/// A fixed camera and the target on the robot, from known poses of the robot.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct PlacedCamera {
    camera: border::Array2<f64>,
    mount: border::Array2<f64>,
    intrinsics: String,
    rms: f64,
    covariance: border::Array2<f64>,
    planar: bool,
    weak: Vec<String>,
}

/// Camera, mount and intrinsics from known poses of the robot.
///
/// `heads` are rows of pose, panel and number of corners.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arrays of one data set")]
pub(crate) fn place_by_poses<'py>(
    py: Python<'py>,
    camera: &str,
    covariance: In2<'py, f64>,
    target: &str,
    robots: In2<'py, f64>,
    heads: In2<'py, i64>,
    ids: In1<'py, i64>,
    pixels: In2<'py, f64>,
    sigma: f64,
    height: f64,
) -> PyResult<PlacedCamera> {
    let (camera, target): (Camera, Target) = (parse(camera)?, parse(target)?);
    let known = KnownCamera { name: String::new(), camera, covariance: Some(matrix(&covariance)) };
    let lens = lens(&known, &Options { calibration_states: 6, ..Options::default() });
    let robots: Vec<Se3> = robots.as_array().outer_iter().map(|r| in_space(std::array::from_fn(|k| r[k]))).collect();
    let corners = corners(&target, robots.len(), &heads, &ids, &pixels, sigma)?;
    let failed = |e: groma_network::Error| PyRuntimeError::new_err(e.to_string());
    let (fit, planar) = py.detach(|| hand_eye::place(&lens, &robots, &corners, height)).map_err(failed)?;
    Ok(PlacedCamera {
        camera: poses(py, std::iter::once(&fit.estimate.0)),
        mount: poses(py, std::iter::once(&fit.estimate.1)),
        intrinsics: serde_json::to_string(&lens.calibrated(&fit.estimate.2)).map_err(invalid)?,
        rms: hand_eye::rms(&fit),
        covariance: dense(&fit.covariance).out(py),
        planar,
        weak: fit.weak.iter().map(hand_eye::in_words).collect(),
    })
}

fn corners(
    target: &Target,
    count: usize,
    heads: &In2<'_, i64>,
    ids: &In1<'_, i64>,
    pixels: &In2<'_, f64>,
    sigma: f64,
) -> PyResult<Vec<Vec<Corner>>> {
    let ids: Vec<u32> = ids.as_array().iter().map(|&id| id.clamp(0, i64::from(u32::MAX)) as u32).collect();
    let pixels: Vec<Vector2<f64>> = pixels.as_array().outer_iter().map(|p| Vector2::new(p[0], p[1])).collect();
    let sigmas = vec![sigma; ids.len()];
    let mut all = vec![vec![]; count];
    let mut first = 0;
    for head in heads.as_array().outer_iter() {
        let (at, panel, end) = (head[0] as usize, head[1] as usize, first + head[2] as usize);
        let (Some(own), true) = (all.get_mut(at), end <= ids.len().min(pixels.len())) else {
            return Err(PyValueError::new_err("heads do not fit the poses or the corners"));
        };
        own.extend(average(target, [(panel, &ids[first..end], &pixels[first..end], &sigmas[first..end])]).0);
        first = end;
    }
    Ok(all)
}

fn poses<'a>(py: Python<'_>, all: impl Iterator<Item = &'a Se3>) -> border::Array2<f64> {
    rows(py, all.map(numbers))
}

fn rows<'py, T: numpy::Element + Copy + Default, const N: usize>(
    py: Python<'py>,
    all: impl Iterator<Item = [T; N]>,
) -> border::Array2<T> {
    let flat: Vec<[T; N]> = all.collect();
    Array2::from_shape_fn((flat.len(), N), |(i, j)| flat[i][j]).out(py)
}

fn sixes(all: impl Iterator<Item = Matrix6<f64>>) -> Array3<f64> {
    let all: Vec<Matrix6<f64>> = all.collect();
    Array3::from_shape_fn((all.len(), 6, 6), |(k, i, j)| all[k][(i, j)])
}

fn dense(m: &DMatrix<f64>) -> Array2<f64> {
    Array2::from_shape_fn(m.shape(), |at| m[at])
}

fn matrix(array: &In2<'_, f64>) -> DMatrix<f64> {
    let array = array.as_array();
    DMatrix::from_fn(array.nrows(), array.ncols(), |i, j| array[(i, j)])
}

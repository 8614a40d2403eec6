//! `groma.network` and simulated networks: JSON and arrays in, arrays out. Poses are rows `x y z qx qy qz qw`.

use crate::camera::{invalid, parse};
use crate::findings::to_list;
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
use groma_simulation::network::{NETWORK_SCENES, NetworkRecording, NetworkScene, simulate};
use nalgebra::{DMatrix, Matrix6, Vector2};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Adds the functions of this file to the module.
pub fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(network_defaults, m)?)?;
    m.add_function(wrap_pyfunction!(network_scenes, m)?)?;
    m.add_function(wrap_pyfunction!(network_scene, m)?)?;
    m.add_function(wrap_pyfunction!(simulate_network, m)?)?;
    m.add_function(wrap_pyfunction!(place_by_poses, m)?)?;
    m.add_function(wrap_pyfunction!(pose_sigmas, m)?)?;
    m.add_class::<NetworkSurvey>()?;
    m.add_class::<Standstill>()
}

/// Standard deviations of position [m] and rotation [rad] along their worst directions, by a covariance (6, 6).
#[pyfunction]
fn pose_sigmas(covariance: PyReadonlyArray2<'_, f64>) -> PyResult<(f64, f64)> {
    let view = covariance.as_array();
    if view.dim() != (6, 6) {
        return Err(PyValueError::new_err(format!("covariance: must be 6 x 6, not {:?}", view.dim())));
    }
    let covariance = Matrix6::from_fn(|i, j| view[(i, j)]);
    Ok((sigma_position(&covariance), sigma_rotation(&covariance)))
}

/// Tells stops from odometry as it comes.
#[pyclass]
#[derive(Default)]
struct Standstill(Core);

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

/// The settings of a survey and their defaults.
#[pyfunction]
fn network_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    let text = serde_json::to_string(&Options::default()).map_err(invalid)?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Names of the simulated networks.
#[pyfunction]
fn network_scenes() -> Vec<&'static str> {
    NETWORK_SCENES.to_vec()
}

/// A simulated network, as JSON.
#[pyfunction]
fn network_scene(name: &str, seed: u64) -> PyResult<String> {
    serde_json::to_string(&NetworkScene::named(name, seed).map_err(invalid)?).map_err(invalid)
}

/// What a recorder would have of a scene, and the truth.
#[pyfunction]
fn simulate_network<'py>(py: Python<'py>, scene: &str) -> PyResult<Bound<'py, PyDict>> {
    let scene: NetworkScene = parse(scene)?;
    let recording = py.detach(|| simulate(&scene)).map_err(invalid)?;
    let out = PyDict::new(py);
    out.set_item("odometry", rows(py, recording.odometry.iter().map(|(t, p)| [*t, p.x(), p.y(), p.theta()])))?;
    out.set_item("stop_times", rows(py, recording.stops.iter().map(|s| [s.from, s.to])))?;
    out.set_item("stops", poses(py, recording.stops.iter().map(|s| &s.pose)))?;
    out.set_item("cameras", poses(py, recording.cameras.iter()))?;
    out.set_item("mount", poses(py, std::iter::once(&recording.mount)))?;
    let lenses: Result<Vec<String>, _> = recording.lenses.iter().map(serde_json::to_string).collect();
    out.set_item("lenses", lenses.map_err(invalid)?)?;
    seen(py, &out, &recording)?;
    Ok(out)
}

/// Rows of stop, camera, panel and number of corners, stamps, and the corners one after the other.
fn seen(py: Python<'_>, out: &Bound<'_, PyDict>, recording: &NetworkRecording) -> PyResult<()> {
    let all = &recording.seen;
    let heads = all.iter().map(|s| [s.stop, s.camera, s.panel, s.ids.len()].map(|v| v as i64));
    out.set_item("heads", rows(py, heads))?;
    out.set_item("stamps", column(py, all.iter().map(|s| s.stamp)))?;
    out.set_item("ids", column(py, all.iter().flat_map(|s| s.ids.iter().map(|id| i64::from(*id)))))?;
    out.set_item("pixels", rows(py, all.iter().flat_map(|s| s.pixels.iter().map(|p| [p.x, p.y]))))
}

/// A survey that messages are pushed into; `finish` may be called at any time.
#[pyclass]
struct NetworkSurvey(SurveyCameras);

#[pymethods]
impl NetworkSurvey {
    /// `cameras` as JSON with the covariance of each (or None).
    #[new]
    fn new(target: &str, cameras: Vec<(String, String, Option<PyReadonlyArray2<'_, f64>>)>) -> PyResult<Self> {
        let known = |(name, camera, covariance): (String, String, Option<PyReadonlyArray2<'_, f64>>)| {
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
        ids: PyReadonlyArray1<'_, i64>,
        pixels: PyReadonlyArray2<'_, f64>,
        sigmas: PyReadonlyArray1<'_, f64>,
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

    /// The map as a dict of arrays, with `findings`.
    #[pyo3(signature = (options, token=None, show=None))]
    fn finish<'py>(
        &self,
        py: Python<'py>,
        options: &str,
        token: Option<&Token>,
        show: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let options: Options = parse(options)?;
        options.check().map_err(invalid)?;
        let found = interruptible(py, token, show.as_ref(), |token| self.0.finish(&options, token))?;
        let found = found.map_err(|e| match e {
            Error::Cancelled(_) => PyKeyboardInterrupt::new_err(e.to_string()),
            _ => PyRuntimeError::new_err(e.to_string()),
        })?;
        let out = to_dict(py, &found.map)?;
        out.set_item("findings", to_list(py, &found.findings)?)?;
        Ok(out)
    }
}

fn to_dict<'py>(py: Python<'py>, map: &NetworkMap) -> PyResult<Bound<'py, PyDict>> {
    let out = PyDict::new(py);
    cameras(py, &out, map)?;
    out.set_item("joint", map.joint.as_ref().map(|joint| dense(joint).into_pyarray(py)))?;
    out.set_item("halt_stamps", column(py, map.stamps.iter().copied()))?;
    out.set_item("odometry", rows(py, map.odometry.iter().map(|p| [p.x(), p.y(), p.theta()])))?;
    out.set_item("stop_halts", column(py, map.stops.iter().map(|s| s.0 as i64)))?;
    out.set_item("stops", poses(py, map.stops.iter().map(|s| &s.1)))?;
    out.set_item("stop_covariances", sixes(map.stops.iter().map(|s| s.2)).into_pyarray(py))?;
    out.set_item("mount", poses(py, std::iter::once(&map.mount.0)))?;
    out.set_item("mount_covariance", sixes(std::iter::once(map.mount.1)).into_pyarray(py))?;
    views(py, &out, map)?;
    out.set_item("moved", rows(py, map.moved.iter().map(|m| [m.camera, m.from, m.to].map(|v| v as i64))))?;
    out.set_item("slip", map.slip.map_or(0, |slip| slip.cameras))?;
    let r = &map.residuals;
    let kinds = [("corners", r.corners()), ("odometry", r.odometry), ("floor", r.floor), ("priors", r.priors)];
    out.set_item("residuals", kinds.to_vec())?;
    out.set_item("corner_chi_square", map.corner_chi_square())?;
    out.set_item("height_sigma", map.height_sigma())?;
    out.set_item("odometry_error", map.odometry_error())?;
    out.set_item("path_length", map.path_length())?;
    out.set_item("steps", map.steps)?;
    Ok(out)
}

fn cameras(py: Python<'_>, out: &Bound<'_, PyDict>, map: &NetworkMap) -> PyResult<()> {
    let all = &map.cameras;
    let heads = all.iter().map(|c| [c.camera, c.since, usize::from(c.current), c.views].map(|v| v as i64));
    out.set_item("camera_heads", rows(py, heads))?;
    out.set_item("cameras", poses(py, all.iter().map(|c| &c.pose)))?;
    out.set_item("covariances", sixes(all.iter().map(|c| c.covariance)).into_pyarray(py))?;
    out.set_item("camera_chi", column(py, all.iter().map(CameraResult::chi_square_per_dof)))?;
    let lenses: Result<Vec<String>, _> = all.iter().map(|c| serde_json::to_string(&c.intrinsics)).collect();
    out.set_item("intrinsics", lenses.map_err(invalid)?)?;
    let spreads: Vec<_> = all.iter().map(|c| dense(&c.intrinsics_covariance).into_pyarray(py)).collect();
    out.set_item("intrinsics_covariances", spreads)
}

/// Of every view: stop, camera, place (-1 for none), verdict, nis; of those used: which, and their chi-squares.
fn views(py: Python<'_>, out: &Bound<'_, PyDict>, map: &NetworkMap) -> PyResult<()> {
    let verdict = |v: Verdict| match v {
        Verdict::Born => "first sight",
        Verdict::Taken => "taken",
        Verdict::Rejected => "rejected",
        Verdict::Undecided => "undecided",
        Verdict::NoPose => "no pose",
    };
    let place = |p: Option<usize>| p.map_or(-1, |p| p as i64);
    out.set_item("views", rows(py, map.judged.iter().map(|j| [j.stop as i64, j.camera as i64, place(j.place)])))?;
    out.set_item("nis", column(py, map.judged.iter().map(|j| j.nis)))?;
    out.set_item("verdicts", map.judged.iter().map(|j| verdict(j.verdict)).collect::<Vec<_>>())?;
    out.set_item("used", column(py, map.used.iter().map(|&k| k as i64)))?;
    out.set_item("view_chi", rows(py, map.residuals.views.iter().map(|v| [v.0, v.1 as f64])))
}

/// Camera, mount and intrinsics from known poses of the robot.
///
/// `heads` are rows of pose, panel and number of corners.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arrays of one data set")]
fn place_by_poses<'py>(
    py: Python<'py>,
    camera: &str,
    covariance: PyReadonlyArray2<'py, f64>,
    target: &str,
    robots: PyReadonlyArray2<'py, f64>,
    heads: PyReadonlyArray2<'py, i64>,
    ids: PyReadonlyArray1<'py, i64>,
    pixels: PyReadonlyArray2<'py, f64>,
    sigma: f64,
    height: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let (camera, target): (Camera, Target) = (parse(camera)?, parse(target)?);
    let known = KnownCamera { name: String::new(), camera, covariance: Some(matrix(&covariance)) };
    let lens = lens(&known, &Options { calibration_states: 6, ..Options::default() });
    let robots: Vec<Se3> = robots.as_array().outer_iter().map(|r| in_space(std::array::from_fn(|k| r[k]))).collect();
    let corners = corners(&target, robots.len(), &heads, &ids, &pixels, sigma)?;
    let failed = |e: groma_network::Error| PyRuntimeError::new_err(e.to_string());
    let (fit, planar) = py.detach(|| hand_eye::place(&lens, &robots, &corners, height)).map_err(failed)?;
    let out = PyDict::new(py);
    out.set_item("camera", poses(py, std::iter::once(&fit.estimate.0)))?;
    out.set_item("mount", poses(py, std::iter::once(&fit.estimate.1)))?;
    out.set_item("intrinsics", serde_json::to_string(&lens.calibrated(&fit.estimate.2)).map_err(invalid)?)?;
    out.set_item("rms", hand_eye::rms(&fit))?;
    out.set_item("covariance", dense(&fit.covariance).into_pyarray(py))?;
    out.set_item("planar", planar)?;
    out.set_item("weak", fit.weak.iter().map(hand_eye::in_words).collect::<Vec<_>>())?;
    Ok(out)
}

fn corners(
    target: &Target,
    count: usize,
    heads: &PyReadonlyArray2<'_, i64>,
    ids: &PyReadonlyArray1<'_, i64>,
    pixels: &PyReadonlyArray2<'_, f64>,
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

fn poses<'py, 'a>(py: Python<'py>, all: impl Iterator<Item = &'a Se3>) -> Bound<'py, numpy::PyArray2<f64>> {
    rows(py, all.map(numbers))
}

fn rows<'py, T: numpy::Element + Copy + Default, const N: usize>(
    py: Python<'py>,
    all: impl Iterator<Item = [T; N]>,
) -> Bound<'py, numpy::PyArray2<T>> {
    let flat: Vec<[T; N]> = all.collect();
    Array2::from_shape_fn((flat.len(), N), |(i, j)| flat[i][j]).into_pyarray(py)
}

fn column<'py, T: numpy::Element>(py: Python<'py>, all: impl Iterator<Item = T>) -> Bound<'py, numpy::PyArray1<T>> {
    Array1::from_iter(all).into_pyarray(py)
}

fn sixes(all: impl Iterator<Item = Matrix6<f64>>) -> Array3<f64> {
    let all: Vec<Matrix6<f64>> = all.collect();
    Array3::from_shape_fn((all.len(), 6, 6), |(k, i, j)| all[k][(i, j)])
}

fn dense(m: &DMatrix<f64>) -> Array2<f64> {
    Array2::from_shape_fn(m.shape(), |at| m[at])
}

fn matrix(array: &PyReadonlyArray2<'_, f64>) -> DMatrix<f64> {
    let array = array.as_array();
    DMatrix::from_fn(array.nrows(), array.ncols(), |i, j| array[(i, j)])
}

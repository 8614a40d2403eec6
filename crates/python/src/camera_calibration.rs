//! `groma.camera_calibration`: intrinsics from corners, poses of panels, projection uncertainty.

use crate::border::{self, In1, In2, Out};
use crate::camera::{invalid, parse};
use crate::rendering::entries;
use crate::token::{Token, cancelled, interruptible};
use groma_calibration::camera::{
    CameraCalibration, Options, ProjectionMap, Refusal, Sighting, View, ViewResult, calibrate, panel_pose,
};
use groma_models::Camera;
use nalgebra::{DMatrix, Matrix6, Vector2, Vector3};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

type Floats = border::Array1<f64>;

/// The default settings as JSON.
#[pyfunction]
pub(crate) fn camera_calibration_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(invalid)
}

/// A calibration, flat: of views, one row each (V); of corners, one each in the order given (N).
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct CameraArrays {
    parameters: Vec<f64>,
    covariance: border::Array1<f64>,
    inflated: border::Array1<f64>,
    residual_factor: f64,
    rms: f64,
    rms_all: f64,
    held_out_rms: Option<f64>,
    tilt_spread: f64,
    weak: (Vec<usize>, f64),
    dof: usize,
    honesty: Option<f64>,
    z_rms: Vec<f64>,
    projection_rms: f64,
    splits: usize,
    known: Vec<bool>,
    taken: Vec<bool>,
    decided: Vec<bool>,
    poses: border::Array1<f64>,
    white: border::Array1<f64>,
    covariances: border::Array1<f64>,
    residuals: border::Array1<f64>,
    used: Vec<bool>,
    view_rms: Vec<Option<f64>>,
    view_places: Vec<Option<[f64; 3]>>,
    sigmas_claimed: Vec<f64>,
    sigmas: Vec<f64>,
}

/// Intrinsics from views: `views` is image and number of corners of each; points (N, 3), pixels (N, 2), sigmas (N).
/// A refusal is a RuntimeError.
#[pyfunction]
#[pyo3(signature = (size, views, points, pixels, sigmas, options, token=None))]
#[expect(clippy::too_many_arguments, reason = "one argument a part of the request: Python names them")]
pub(crate) fn calibrate_camera(
    py: Python<'_>,
    size: (u32, u32),
    views: Vec<(usize, usize)>,
    points: In2<'_, f64>,
    pixels: In2<'_, f64>,
    sigmas: In1<'_, f64>,
    options: &str,
    token: Option<&Token>,
) -> PyResult<CameraArrays> {
    let options: Options = parse(options)?;
    let mut rest = sightings(&points, &pixels, &sigmas).into_iter();
    let views: Vec<View> =
        views.into_iter().map(|(image, count)| View { image, corners: rest.by_ref().take(count).collect() }).collect();
    let found = interruptible(py, token, None, |token| calibrate(size.0, size.1, &views, &options, token))?;
    let found = found.map_err(raised)?;
    Ok(arrays(py, &views, &found))
}

fn raised(refusal: Refusal) -> PyErr {
    match refusal {
        Refusal::Setting { .. } => PyValueError::new_err(refusal.to_string()),
        Refusal::Cancelled(_) => cancelled(),
        _ => PyRuntimeError::new_err(refusal.to_string()),
    }
}

pub(crate) fn sightings(points: &In2<'_, f64>, pixels: &In2<'_, f64>, sigmas: &In1<'_, f64>) -> Vec<Sighting> {
    let (points, pixels) = (points.as_array(), pixels.as_array());
    let one = |((p, q), s): ((numpy::ndarray::ArrayView1<'_, f64>, numpy::ndarray::ArrayView1<'_, f64>), &f64)| {
        Sighting { point: Vector3::new(p[0], p[1], p[2]), pixel: Vector2::new(q[0], q[1]), sigma: *s }
    };
    points.outer_iter().zip(pixels.outer_iter()).zip(sigmas.as_array()).map(one).collect()
}

fn arrays(py: Python<'_>, views: &[View], found: &CameraCalibration) -> CameraArrays {
    let flag = |of: fn(&ViewResult) -> bool| found.views.iter().map(|v| v.as_ref().is_some_and(of)).collect();
    let matrices = |of: fn(&ViewResult) -> Matrix6<f64>| {
        let one = |v: &Option<ViewResult>| {
            v.as_ref().map_or(Matrix6::repeat(f64::NAN), of).iter().copied().collect::<Vec<_>>()
        };
        found.views.iter().flat_map(one).collect::<numpy::ndarray::Array1<_>>().out(py)
    };
    let poses = found.views.iter().flat_map(|v| v.as_ref().map_or([f64::NAN; 16], |v| entries(&v.pose)));
    let corners =
        || views.iter().zip(&found.views).flat_map(|(view, known)| (0..view.corners.len()).map(move |k| (known, k)));
    let residual = |(known, k): (&Option<ViewResult>, usize)| known.as_ref().map_or([f64::NAN; 2], |v| v.residuals[k]);
    CameraArrays {
        parameters: found.camera.parameters().to_vec(),
        covariance: flat(py, &found.covariance),
        inflated: flat(py, &found.inflated()),
        residual_factor: found.residual_factor,
        rms: found.rms,
        rms_all: found.rms_all,
        held_out_rms: found.held_out_rms(),
        tilt_spread: found.tilt_spread(),
        weak: found.weak_direction(),
        dof: found.dof,
        honesty: found.honesty.factor,
        z_rms: found.honesty.z_rms.clone(),
        projection_rms: found.honesty.projection_rms,
        splits: found.honesty.splits,
        known: found.views.iter().map(Option::is_some).collect(),
        taken: flag(|v| v.taken),
        decided: flag(|v| v.decided),
        poses: poses.collect::<numpy::ndarray::Array1<_>>().out(py),
        white: matrices(|v| v.white),
        covariances: matrices(|v| v.covariance),
        residuals: corners().flat_map(residual).collect::<numpy::ndarray::Array1<_>>().out(py),
        used: corners().map(|(known, k)| known.as_ref().is_some_and(|v| v.used[k])).collect(),
        view_places: found.views.iter().map(|v| v.as_ref().map(ViewResult::place)).collect(),
        sigmas_claimed: sigmas(&found.covariance),
        sigmas: sigmas(&found.inflated()),
        view_rms: found.views.iter().map(|v| v.as_ref().and_then(ViewResult::rms)).collect(),
    }
}

fn sigmas(covariance: &DMatrix<f64>) -> Vec<f64> {
    covariance.diagonal().iter().map(|v| v.sqrt()).collect()
}

fn flat(py: Python<'_>, symmetric: &DMatrix<f64>) -> border::Array1<f64> {
    symmetric.iter().copied().collect::<numpy::ndarray::Array1<_>>().out(py)
}

/// Pose (16), covariance (36), sensitivity (6 n, by columns), chi-square, dof, decided, the other pose (16) and its chi-square.
type Pose = (Floats, Floats, Floats, f64, usize, bool, Option<(Floats, f64)>);

/// The pose of a panel seen by a camera; None when its corners tell none.
#[pyfunction]
pub(crate) fn camera_panel_pose<'py>(
    py: Python<'py>,
    camera: &str,
    points: In2<'py, f64>,
    pixels: In2<'py, f64>,
    sigmas: In1<'py, f64>,
) -> PyResult<Option<Pose>> {
    let camera: Camera = parse(camera)?;
    let corners = sightings(&points, &pixels, &sigmas);
    let array = |values: &[f64]| border::column(py, values.iter().copied());
    Ok(py.detach(|| panel_pose(&camera, &corners)).map(|found| {
        let sensitivity = found.sensitivity.columns(0, camera.count()).into_owned();
        (
            array(&entries(&found.pose)),
            array(found.covariance.as_slice()),
            array(sensitivity.as_slice()),
            found.chi_square,
            found.dof,
            found.decided,
            found.other.map(|(pose, chi_square)| (array(&entries(&pose)), chi_square)),
        )
    }))
}

/// Shape, pixels (2 each) and standard deviations of a grid over the image, for a covariance (n, n) of the parameters.
#[pyfunction]
pub(crate) fn projection_sigmas<'py>(
    py: Python<'py>,
    camera: &str,
    covariance: In2<'py, f64>,
) -> PyResult<((usize, usize), Floats, Floats)> {
    let camera: Camera = parse(camera)?;
    let covariance = covariance.as_array();
    if covariance.shape() != [camera.count(); 2] {
        return Err(invalid("the covariance must have a row and a column a parameter"));
    }
    let covariance = DMatrix::from_fn(camera.count(), camera.count(), |i, j| covariance[(i, j)]);
    let map = ProjectionMap::new(&camera);
    let pixels = border::column(py, map.pixels.iter().flat_map(|p| [p.x, p.y]));
    Ok((map.shape, pixels, border::column(py, map.sigmas(&covariance))))
}

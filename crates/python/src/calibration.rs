//! `groma.calibration`: vehicles from wheel readings and laser motions.

use crate::pose_graph::estimation_error;
use crate::token::interruptible;
use groma_calibration::vehicle::hand_eye::Form;
use groma_calibration::vehicle::parameters::{DELAY, GAIN, WHEELBASE};
use groma_calibration::vehicle::start::{Known, Weights, closed_form};
use groma_calibration::vehicle::trim::{Trim, trimmed};
use groma_calibration::vehicle::{
    Calibration, Error, Layout, Model, Motion, Motions, Options, Request, Segments, calibrate, stopping,
};
use groma_geometry::Se2;
use groma_models::{WheelKind, WheelLog};
use nalgebra::{Matrix3, Vector2};
use numpy::ndarray::{Array2, ArrayView3};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Model, wheelbase, gain, delay, names of what is free.
type Asked = (Option<String>, Option<f64>, f64, f64, Vec<String>);

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(vehicle_calibration_defaults, m)?)?;
    m.add_function(wrap_pyfunction!(vehicle_calibrate, m)?)?;
    m.add_function(wrap_pyfunction!(vehicle_closed_form, m)?)?;
    m.add_function(wrap_pyfunction!(interval_factor, m)?)
}

/// Settings as JSON.
#[pyfunction]
fn vehicle_calibration_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Half-width of an interval over the standard deviation.
#[pyfunction]
#[pyo3(signature = (confidence, dof, claims))]
fn interval_factor(confidence: f64, dof: Option<usize>, claims: usize) -> f64 {
    stopping::factor(confidence, dof, claims)
}

/// `motions` is start, end, x, y, turn a row.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument an array: Python names them")]
fn vehicle_calibrate<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    readings: PyReadonlyArray2<'py, f64>,
    steered: bool,
    motions: PyReadonlyArray2<'py, f64>,
    covariances: Option<PyReadonlyArray3<'py, f64>>,
    couplings: Option<PyReadonlyArray3<'py, f64>>,
    asked: Asked,
    options: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let log = wheel_log(&time, &readings, steered).map_err(|e| raise(py, &e))?;
    let motions = Motions {
        motions: to_motions(&motions),
        covariances: covariances.map(|c| blocks(c.as_array())),
        couplings: couplings.map(|c| blocks(c.as_array())),
    };
    let options: Options = parse(options)?;
    let (model, wheelbase, gain, delay, free) = asked;
    let free: Vec<&str> = free.iter().map(String::as_str).collect();
    let request = Request { model: to_model(model.as_deref())?, wheelbase, gain, delay, free: &free };
    let found = interruptible(py, None, None, |token| calibrate(&log, &motions, &request, &options, token))?;
    let found = found.map_err(|e| raise(py, &e))?;
    to_dict(py, &found)
}

/// The numbers by name, and the motions that were kept.
type ClosedForm = (Vec<(String, f64)>, Vec<usize>);

/// The closed form alone, with trimming: the nine numbers and the motions that were kept.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument an array or a setting: Python names them")]
fn vehicle_closed_form<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    readings: PyReadonlyArray2<'py, f64>,
    steered: bool,
    motions: PyReadonlyArray2<'py, f64>,
    asked: Asked,
    centres: bool,
    trim: (usize, f64),
) -> PyResult<Option<ClosedForm>> {
    let log = wheel_log(&time, &readings, steered).map_err(|e| raise(py, &e))?;
    let motions = to_motions(&motions);
    let (model, wheelbase, gain, delay, free) = asked;
    let free: Vec<&str> = free.iter().map(String::as_str).collect();
    let model = to_model(model.as_deref())?.ok_or_else(|| PyValueError::new_err("name a model"))?;
    let layout = Layout::new(model, &free).map_err(|e| raise(py, &e))?;
    let known = Known { model, wheelbase: wheelbase.filter(|_| !free.contains(&"wheelbase")), gain, delay };
    let (form, trim) = (if centres { Form::Centres } else { Form::Wheels }, Trim { rounds: trim.0, share: trim.1 });
    let found = py.detach(|| {
        let (segments, weights) = (Segments::new(&log, &motions, delay), vec![Weights::UNIT; motions.len()]);
        trimmed(&trim, &segments, &motions, |chosen| closed_form(&known, &segments, &motions, &weights, chosen, form))
    });
    Ok(found.map(|f| (named(&layout, &layout.values(&f.vehicle.to_full())), f.kept)))
}

fn named(layout: &Layout, values: &nalgebra::DVector<f64>) -> Vec<(String, f64)> {
    layout.names().iter().map(ToString::to_string).zip(values.iter().copied()).collect()
}

fn wheel_log(
    time: &PyReadonlyArray1<'_, f64>,
    readings: &PyReadonlyArray2<'_, f64>,
    steered: bool,
) -> Result<WheelLog, Error> {
    let readings = readings.as_array().rows().into_iter().map(|r| Vector2::new(r[0], r[1])).collect();
    let kind = if steered { WheelKind::Steered } else { WheelKind::Differential };
    Ok(WheelLog::new(kind, time.as_array().to_vec(), readings)?)
}

fn to_motions(rows: &PyReadonlyArray2<'_, f64>) -> Vec<Motion> {
    let motion = |r: numpy::ndarray::ArrayView1<'_, f64>| Motion {
        start: r[0],
        end: r[1],
        motion: Se2::new(r[2], r[3], r[4]),
        turn: r[4],
    };
    rows.as_array().rows().into_iter().map(motion).collect()
}

fn blocks(array: ArrayView3<'_, f64>) -> Vec<Matrix3<f64>> {
    (0..array.shape()[0]).map(|k| Matrix3::from_fn(|r, c| array[(k, r, c)])).collect()
}

pub(crate) fn to_model(name: Option<&str>) -> PyResult<Option<Model>> {
    let Some(name) = name else { return Ok(None) };
    let known = Model::ALL.iter().find(|m| m.name() == name).copied();
    known.map(Some).ok_or_else(|| {
        let names: Vec<&str> = Model::ALL.iter().map(|m| m.name()).collect();
        PyValueError::new_err(format!("model {name:?}: it is one of auto, {}", names.join(", ")))
    })
}

pub(crate) fn parse<T: serde::de::DeserializeOwned>(json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(|e| PyValueError::new_err(e.to_string()))
}

pub(crate) fn to_dict<'py>(py: Python<'py>, found: &Calibration) -> PyResult<Bound<'py, PyDict>> {
    let (x, layout, dict) = (found.vehicle.to_full(), &found.layout, PyDict::new(py));
    let fixed = PyDict::new(py);
    let candidates = [("wheelbase", WHEELBASE), ("steering_gain", GAIN), ("delay", DELAY)];
    let steered = layout.model != Model::Differential;
    for (name, index) in candidates.into_iter().filter(|c| !layout.is_free(c.1) && (steered || c.1 == DELAY)) {
        fixed.set_item(name, x[index])?;
    }
    let n = layout.len();
    dict.set_item("model", layout.model.name())?;
    dict.set_item("names", layout.names())?;
    dict.set_item("values", layout.values(&x).as_slice().to_vec().into_pyarray(py))?;
    let sigma = |k: usize| found.covariance[(k, k)].sqrt();
    let correlation = |(i, j): (usize, usize)| {
        let scale = sigma(i) * sigma(j);
        if scale > 0.0 { found.covariance[(i, j)] / scale } else { found.covariance[(i, j)] }
    };
    dict.set_item("sigmas", (0..n).map(sigma).collect::<Vec<_>>().into_pyarray(py))?;
    dict.set_item("correlation", Array2::from_shape_fn((n, n), correlation).into_pyarray(py))?;
    dict.set_item("covariance", Array2::from_shape_fn((n, n), |i| found.covariance[i]).into_pyarray(py))?;
    dict.set_item("fixed", fixed)?;
    dict.set_item("chi_square", found.chi_square)?;
    dict.set_item("dof", found.dof)?;
    dict.set_item("interval_dof", found.interval_dof)?;
    dict.set_item("noise_scale", found.noise_scale)?;
    dict.set_item("correlated", found.correlated)?;
    dict.set_item("converged", found.converged)?;
    dict.set_item("observed", found.observed())?;
    let rows = found.residuals.len();
    dict.set_item("residuals", Array2::from_shape_fn((rows, 3), |(k, c)| found.residuals[k][c]).into_pyarray(py))?;
    dict.set_item("weights", found.weights.clone().into_pyarray(py))?;
    let tests: Vec<_> = found.tests.iter().map(|t| (t.name, t.statistic, t.dof, t.p_value)).collect();
    dict.set_item("tests", tests)?;
    let weak: Vec<_> = found.weak.iter().map(|w| (w.direction.as_slice().to_vec(), w.words.clone())).collect();
    dict.set_item("weak", weak)?;
    let held_out = found.held_out.map(|h| (h.folds, h.position_median, h.heading_median, h.position_rms));
    dict.set_item("held_out", held_out)?;
    dict.set_item("notes", found.notes.clone())?;
    Ok(dict)
}

/// Data that hold no estimate are an estimation that failed; anything else is a mistake of the caller.
fn raise(py: Python<'_>, error: &Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::TooFew { .. } | Error::Degenerate(_) => estimation_error(py, message),
        Error::Cancelled(_) => PyKeyboardInterrupt::new_err(message),
        _ => PyValueError::new_err(message),
    }
}

//! `groma.calibration`: vehicles from wheel readings and laser motions.

use crate::border::{self, In1, In2, In3, Out};
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
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use std::collections::BTreeMap;

/// Model, wheelbase, gain, delay, names of what is free.
type Asked = (Option<String>, Option<f64>, f64, f64, Vec<String>);

/// Settings as JSON.
#[pyfunction]
pub(crate) fn vehicle_calibration_defaults() -> PyResult<String> {
    serde_json::to_string(&Options::default()).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Half-width of an interval over the standard deviation.
#[pyfunction]
#[pyo3(signature = (confidence, dof, claims))]
pub(crate) fn interval_factor(confidence: f64, dof: Option<usize>, claims: usize) -> f64 {
    stopping::factor(confidence, dof, claims)
}

/// `motions` is start, end, x, y, turn a row.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument an array: Python names them")]
pub(crate) fn vehicle_calibrate<'py>(
    py: Python<'py>,
    time: In1<'py, f64>,
    readings: In2<'py, f64>,
    steered: bool,
    motions: In2<'py, f64>,
    covariances: Option<In3<'py, f64>>,
    couplings: Option<In3<'py, f64>>,
    asked: Asked,
    options: &str,
) -> PyResult<VehicleEstimate> {
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
    Ok(estimate(py, &found))
}

/// The numbers by name, and the motions that were kept.
type ClosedForm = (Vec<(String, f64)>, Vec<usize>);

/// The closed form alone, with trimming: the nine numbers and the motions that were kept.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument an array or a setting: Python names them")]
pub(crate) fn vehicle_closed_form<'py>(
    py: Python<'py>,
    time: In1<'py, f64>,
    readings: In2<'py, f64>,
    steered: bool,
    motions: In2<'py, f64>,
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

fn wheel_log(time: &In1<'_, f64>, readings: &In2<'_, f64>, steered: bool) -> Result<WheelLog, Error> {
    let readings = readings.as_array().rows().into_iter().map(|r| Vector2::new(r[0], r[1])).collect();
    let kind = if steered { WheelKind::Steered } else { WheelKind::Differential };
    Ok(WheelLog::new(kind, time.as_array().to_vec(), readings)?)
}

fn to_motions(rows: &In2<'_, f64>) -> Vec<Motion> {
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

/// A calibrated vehicle.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct VehicleEstimate {
    model: &'static str,
    names: Vec<String>,
    values: border::Array1<f64>,
    sigmas: border::Array1<f64>,
    correlation: border::Array2<f64>,
    covariance: border::Array2<f64>,
    /// Parameters that were taken as given.
    fixed: BTreeMap<&'static str, f64>,
    chi_square: f64,
    dof: usize,
    interval_dof: Option<usize>,
    noise_scale: f64,
    correlated: bool,
    converged: bool,
    observed: Vec<bool>,
    residuals: border::Array2<f64>,
    weights: border::Array1<f64>,
    /// Name, statistic, degrees of freedom, p-value.
    tests: Vec<(&'static str, f64, usize, f64)>,
    /// Direction over the parameters, and in words.
    weak: Vec<(Vec<f64>, String)>,
    /// Folds, medians of the position [m] and the heading [rad], root mean square of the position [m].
    held_out: Option<(usize, f64, f64, f64)>,
    notes: Vec<String>,
}

pub(crate) fn estimate(py: Python<'_>, found: &Calibration) -> VehicleEstimate {
    let (x, layout) = (found.vehicle.to_full(), &found.layout);
    let candidates = [("wheelbase", WHEELBASE), ("steering_gain", GAIN), ("delay", DELAY)];
    let steered = layout.model != Model::Differential;
    let given = candidates.into_iter().filter(|c| !layout.is_free(c.1) && (steered || c.1 == DELAY));
    let (n, rows) = (layout.len(), found.residuals.len());
    let sigma = |k: usize| found.covariance[(k, k)].sqrt();
    let correlation = |(i, j): (usize, usize)| {
        let scale = sigma(i) * sigma(j);
        if scale > 0.0 { found.covariance[(i, j)] / scale } else { found.covariance[(i, j)] }
    };
    VehicleEstimate {
        model: layout.model.name(),
        names: layout.names().iter().map(ToString::to_string).collect(),
        values: layout.values(&x).as_slice().to_vec().out(py),
        sigmas: border::column(py, (0..n).map(sigma)),
        correlation: Array2::from_shape_fn((n, n), correlation).out(py),
        covariance: Array2::from_shape_fn((n, n), |i| found.covariance[i]).out(py),
        fixed: given.map(|(name, index)| (name, x[index])).collect(),
        chi_square: found.chi_square,
        dof: found.dof,
        interval_dof: found.interval_dof,
        noise_scale: found.noise_scale,
        correlated: found.correlated,
        converged: found.converged,
        observed: found.observed(),
        residuals: Array2::from_shape_fn((rows, 3), |(k, c)| found.residuals[k][c]).out(py),
        weights: found.weights.clone().out(py),
        tests: found.tests.iter().map(|t| (t.name, t.statistic, t.dof, t.p_value)).collect(),
        weak: found.weak.iter().map(|w| (w.direction.as_slice().to_vec(), w.words.clone())).collect(),
        held_out: found.held_out.map(|h| (h.folds, h.position_median, h.heading_median, h.position_rms)),
        notes: found.notes.clone(),
    }
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

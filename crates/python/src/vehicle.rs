//! `groma.vehicle`: what a vehicle may be is decided by the core.

use crate::findings::to_list;
use groma_models::vehicle::VehicleSpec;
use groma_models::{Vehicle, WheelNoise};
use nalgebra::Vector2;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray2, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyList;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(wheel_noise_defaults, m)?)?;
    m.add_function(wrap_pyfunction!(check_vehicle, m)?)?;
    m.add_function(wrap_pyfunction!(vehicle_handedness, m)?)?;
    m.add_function(wrap_pyfunction!(dead_reckoning, m)?)
}

/// The noise of wheels of which nothing else is known, as JSON.
#[pyfunction]
fn wheel_noise_defaults() -> PyResult<String> {
    serde_json::to_string(&WheelNoise::default()).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Whether a vehicle as JSON can be built; the error names the field and its value.
#[pyfunction]
fn check_vehicle(json: &str) -> PyResult<()> {
    to_vehicle(json).map(|_| ())
}

/// Findings about how the wheels of a vehicle as JSON are wired.
#[pyfunction]
fn vehicle_handedness<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyList>> {
    to_list(py, &to_vehicle(json)?.handedness())
}

/// The poses (n, 3) that readings (n, 2) of the wheels tell: x, y [m], heading with turns counted [rad]. `broken` are the
/// readings that do not hang together with the one before.
#[pyfunction]
fn dead_reckoning<'py>(
    py: Python<'py>,
    vehicle: &str,
    readings: PyReadonlyArray2<'py, f64>,
    broken: Vec<usize>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let readings: Vec<_> = readings.as_array().rows().into_iter().map(|r| Vector2::new(r[0], r[1])).collect();
    let poses = to_vehicle(vehicle)?.dead_reckoning(&readings, |k| broken.binary_search(&k).is_ok());
    Ok(Array2::from_shape_fn((poses.len(), 3), |(k, c)| poses[k][c]).into_pyarray(py))
}

/// A vehicle from JSON.
pub(crate) fn to_vehicle(json: &str) -> PyResult<Vehicle> {
    let spec: VehicleSpec = serde_json::from_str(json).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Vehicle::try_from(spec).map_err(|e| PyValueError::new_err(e.to_string()))
}

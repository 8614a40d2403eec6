//! `groma.vehicle`: what a vehicle may be is decided by the core.

use crate::border::{self, In2, Out};
use crate::findings::{Row, to_rows};
use groma_models::vehicle::VehicleSpec;
use groma_models::{Vehicle, WheelNoise};
use nalgebra::Vector2;
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The noise of wheels of which nothing else is known, as JSON.
#[pyfunction]
pub(crate) fn wheel_noise_defaults() -> PyResult<String> {
    serde_json::to_string(&WheelNoise::default()).map_err(|e| PyValueError::new_err(e.to_string()))
}

/// Whether a vehicle as JSON can be built; the error names the field and its value.
#[pyfunction]
pub(crate) fn check_vehicle(json: &str) -> PyResult<()> {
    to_vehicle(json).map(|_| ())
}

/// Findings about how the wheels of a vehicle as JSON are wired.
#[pyfunction]
pub(crate) fn vehicle_handedness(json: &str) -> PyResult<Vec<Row>> {
    Ok(to_rows(&to_vehicle(json)?.handedness()))
}

/// The poses (n, 3) that readings (n, 2) of the wheels tell: x, y [m], heading with turns counted [rad]. `broken` are the
/// readings that do not hang together with the one before.
#[pyfunction]
pub(crate) fn dead_reckoning<'py>(
    py: Python<'py>,
    vehicle: &str,
    readings: In2<'py, f64>,
    broken: Vec<usize>,
) -> PyResult<border::Array2<f64>> {
    let readings: Vec<_> = readings.as_array().rows().into_iter().map(|r| Vector2::new(r[0], r[1])).collect();
    let poses = to_vehicle(vehicle)?.dead_reckoning(&readings, |k| broken.binary_search(&k).is_ok());
    Ok(Array2::from_shape_fn((poses.len(), 3), |(k, c)| poses[k][c]).out(py))
}

/// A vehicle from JSON.
pub(crate) fn to_vehicle(json: &str) -> PyResult<Vehicle> {
    let spec: VehicleSpec = serde_json::from_str(json).map_err(|e| PyValueError::new_err(e.to_string()))?;
    Vehicle::try_from(spec).map_err(|e| PyValueError::new_err(e.to_string()))
}

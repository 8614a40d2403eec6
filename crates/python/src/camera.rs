//! `groma.camera` and `groma.target`: cameras and targets as JSON in, arrays out.

use crate::border::{self, In2, Out};
use groma_models::{Camera, Lens, Pattern, Target};
use nalgebra::{Vector2, Vector3};
use numpy::ndarray::Array2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Table = border::Array2<f64>;

/// Name and parameters of every lens model.
#[pyfunction]
pub(crate) fn camera_lenses() -> Vec<(&'static str, Vec<&'static str>)> {
    Lens::ALL.iter().map(|lens| (lens.name(), lens.names().to_vec())).collect()
}

/// Pixels (m, 2) of points (m, 3) in the frame of the camera; NaN where it does not see one.
#[pyfunction]
pub(crate) fn camera_project<'py>(py: Python<'py>, camera: &str, points: In2<'py, f64>) -> PyResult<Table> {
    let camera: Camera = parse(camera)?;
    let points = points.as_array();
    let pixels = points.outer_iter().map(|p| camera.project(&Vector3::new(p[0], p[1], p[2])));
    Ok(table(py, pixels.map(|p| p.map(Into::into))))
}

/// Directions (m, 3) of length 1 that pixels (m, 2) see; NaN where the lens model does not reach.
#[pyfunction]
pub(crate) fn camera_unproject<'py>(py: Python<'py>, camera: &str, pixels: In2<'py, f64>) -> PyResult<Table> {
    let camera: Camera = parse(camera)?;
    let pixels = pixels.as_array();
    let directions = pixels.outer_iter().map(|p| camera.unproject(&Vector2::new(p[0], p[1])));
    Ok(table(py, directions.map(|p| p.map(Into::into))))
}

/// Corners (k, 3) of a pattern in the frame of its panel, in the order of their numbers.
#[pyfunction]
pub(crate) fn pattern_corners<'py>(py: Python<'py>, pattern: &str) -> PyResult<Table> {
    let pattern: Pattern = parse(pattern)?;
    Ok(table(py, pattern.corners().into_iter().map(|p| Some(p.into()))))
}

/// Refuses a target that makes no sense.
#[pyfunction]
pub(crate) fn target_check(target: &str) -> PyResult<()> {
    parse::<Target>(target)?.check().map_err(invalid)
}

/// A value from JSON.
pub fn parse<T: serde::de::DeserializeOwned>(json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(invalid)
}

/// A mistake in what was asked.
pub fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Rows of N numbers; NaN for those that are missing.
pub fn table<'py, const N: usize>(py: Python<'py>, rows: impl Iterator<Item = Option<[f64; N]>>) -> Table {
    let rows: Vec<[f64; N]> = rows.map(|row| row.unwrap_or([f64::NAN; N])).collect();
    let mut array = Array2::zeros((rows.len(), N));
    array.iter_mut().zip(rows.as_flattened()).for_each(|(cell, value)| *cell = *value);
    array.out(py)
}

//! The pose graph for Python: nodes (N, 3), pairs (M, 2), measurements (M, 3), information (M, 3, 3).

use crate::border::{self, In1, In2, In3, Out};
use crate::token::interruptible;
use groma_geometry::Se2;
use groma_mapping::pose_graph::{Edge, Error, Options, PoseGraph, Solution};
use nalgebra::Matrix3;
use numpy::ndarray::{Array1, Array2, Array3, ArrayView2, ArrayView3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

type Optimized = (border::Array2<f64>, border::Array1<f64>, border::Array1<f64>, usize, bool);

/// The settings of the pose graph and their defaults, as JSON.
#[pyfunction]
pub(crate) fn pose_graph_defaults() -> PyResult<String> {
    border::json(&Options::default())
}

#[pyfunction]
#[pyo3(signature = (nodes, pairs, measurements, information, robust, *, max_iterations=None, tolerance=None,
                    inlier_chi_square=None, convexity_step=None))]
#[expect(clippy::too_many_arguments, reason = "one argument an array or an option: Python names them")]
pub(crate) fn pose_graph_optimize<'py>(
    py: Python<'py>,
    nodes: In2<'py, f64>,
    pairs: In2<'py, i64>,
    measurements: In2<'py, f64>,
    information: In3<'py, f64>,
    robust: In1<'py, bool>,
    max_iterations: Option<usize>,
    tolerance: Option<f64>,
    inlier_chi_square: Option<f64>,
    convexity_step: Option<f64>,
) -> PyResult<Optimized> {
    let defaults = Options::default();
    let options = Options {
        max_iterations: max_iterations.unwrap_or(defaults.max_iterations),
        tolerance: tolerance.unwrap_or(defaults.tolerance),
        inlier_chi_square: inlier_chi_square.unwrap_or(defaults.inlier_chi_square),
        convexity_step: convexity_step.unwrap_or(defaults.convexity_step),
    };
    let robust: Vec<bool> = robust.as_array().to_vec();
    let graph = graph(nodes.as_array(), pairs.as_array(), measurements.as_array(), information.as_array(), &robust)?;
    let solution =
        interruptible(py, None, None, |token| graph.optimize(&options, token))?.map_err(|e| raise(py, &e))?;
    let Solution { nodes, chi_squares, weights, iterations, converged } = solution;
    let poses = Array2::from_shape_fn((nodes.len(), 3), |(k, axis)| nodes[k].to_vector()[axis]);
    let (chi_squares, weights) = (Array1::from(chi_squares), Array1::from(weights));
    Ok((poses.out(py), chi_squares.out(py), weights.out(py), iterations, converged))
}

#[pyfunction]
pub(crate) fn pose_graph_marginals<'py>(
    py: Python<'py>,
    nodes: In2<'py, f64>,
    pairs: In2<'py, i64>,
    measurements: In2<'py, f64>,
    information: In3<'py, f64>,
    weights: In1<'py, f64>,
) -> PyResult<border::Array3<f64>> {
    let weights = weights.as_array().to_vec();
    let robust = vec![false; pairs.as_array().nrows()];
    let graph = graph(nodes.as_array(), pairs.as_array(), measurements.as_array(), information.as_array(), &robust)?;
    let blocks = py.detach(|| graph.marginals(&weights)).map_err(|e| raise(py, &e))?;
    Ok(Array3::from_shape_fn((blocks.len(), 3, 3), |(k, r, c)| blocks[k][(r, c)]).out(py))
}

fn graph(
    nodes: ArrayView2<'_, f64>,
    pairs: ArrayView2<'_, i64>,
    measurements: ArrayView2<'_, f64>,
    information: ArrayView3<'_, f64>,
    robust: &[bool],
) -> PyResult<PoseGraph> {
    let count = pairs.nrows();
    let shapes = [
        (nodes.ncols() == 3, "nodes must be (N, 3)"),
        (pairs.ncols() == 2, "pairs must be (M, 2)"),
        (measurements.shape() == [count, 3], "measurements must be (M, 3), M as many as pairs"),
        (information.shape() == [count, 3, 3], "information must be (M, 3, 3), M as many as pairs"),
        (robust.len() == count, "robust must be (M,), M as many as pairs"),
    ];
    if let Some((_, why)) = shapes.iter().find(|(fits, _)| !fits) {
        return Err(PyValueError::new_err(*why));
    }
    let pose = |row: &[f64; 3]| Se2::new(row[0], row[1], row[2]);
    let row = |a: &ArrayView2<'_, f64>, k: usize| [a[(k, 0)], a[(k, 1)], a[(k, 2)]];
    let end = |k: usize, side: usize| {
        usize::try_from(pairs[(k, side)]).map_err(|_| PyValueError::new_err(format!("edge {k} has a negative node")))
    };
    let edge = |k: usize| {
        let (from, to, measurement) = (end(k, 0)?, end(k, 1)?, pose(&row(&measurements, k)));
        let information = Matrix3::from_fn(|r, c| information[(k, r, c)]);
        Ok(Edge { from, to, measurement, information, robust: robust[k] })
    };
    let edges = (0..count).map(edge).collect::<PyResult<Vec<_>>>()?;
    Ok(PoseGraph { nodes: (0..nodes.nrows()).map(|k| pose(&row(&nodes, k))).collect(), edges })
}

/// A graph that its edges do not hold is an estimation that failed; anything else is a mistake of the caller.
fn raise(py: Python<'_>, error: &Error) -> PyErr {
    let message = error.to_string();
    match error {
        Error::Disconnected { .. } | Error::Free { .. } => estimation_error(py, message),
        _ => PyValueError::new_err(message),
    }
}

pub(crate) fn estimation_error(py: Python<'_>, message: String) -> PyErr {
    let class = py.import("groma.errors").and_then(|m| m.getattr("EstimationError"));
    match class.and_then(|c| c.call1((message,))) {
        Ok(instance) => PyErr::from_value(instance),
        Err(error) => error,
    }
}

//! Whether a graph can be solved at all, told before any arithmetic is spent on it.

use super::{Edge, Error, Options, PoseGraph};
use groma_geometry::Se2;
use nalgebra::Matrix3;

/// Every node and edge is sound.
pub(super) fn graph(graph: &PoseGraph) -> Result<(), Error> {
    if graph.nodes.is_empty() {
        return Err(Error::Empty);
    }
    if let Some(node) = graph.nodes.iter().position(|n| !is_finite(n)) {
        return Err(Error::Node { node });
    }
    let fault = |(edge, e)| fault(e, graph.nodes.len()).map(|why| Error::Edge { edge, why });
    graph.edges.iter().enumerate().find_map(fault).map_or(Ok(()), Err)
}

/// Every option lies in its range.
pub(super) fn options(options: &Options) -> Result<(), Error> {
    let positive = |v: f64| v > 0.0 && v.is_finite();
    for (ok, name, why) in [
        (options.max_iterations > 0, "max_iterations", "must be at least 1"),
        (positive(options.tolerance), "tolerance", "must be positive"),
        (positive(options.inlier_chi_square), "inlier_chi_square", "must be positive"),
        (positive(options.convexity_step - 1.0), "convexity_step", "must be above 1"),
    ] {
        if !ok {
            return Err(Error::Option { name, why });
        }
    }
    Ok(())
}

/// There is one sound weight an edge.
pub(super) fn weights(graph: &PoseGraph, weights: &[f64]) -> Result<(), Error> {
    let edges = graph.edges.len();
    let sound = weights.len() == edges && weights.iter().all(|w| w.is_finite() && *w >= 0.0);
    if sound { Ok(()) } else { Err(Error::Weights { edges }) }
}

/// The edges that count lead from node 0 to every node.
pub(super) fn connected(graph: &PoseGraph, counts: impl Fn(usize) -> bool) -> Result<(), Error> {
    let mut root: Vec<usize> = (0..graph.nodes.len()).collect();
    for (k, edge) in graph.edges.iter().enumerate() {
        if counts(k) {
            let (a, b) = (find(&mut root, edge.from), find(&mut root, edge.to));
            root[a.max(b)] = a.min(b);
        }
    }
    let loose = (0..root.len()).find(|&node| find(&mut root, node) != 0);
    loose.map_or(Ok(()), |node| Err(Error::Disconnected { node }))
}

/// The smallest node of the component, halving the path to it.
fn find(root: &mut [usize], mut node: usize) -> usize {
    while root[node] != node {
        root[node] = root[root[node]];
        node = root[node];
    }
    node
}

fn fault(edge: &Edge, nodes: usize) -> Option<String> {
    if let Some(end) = [edge.from, edge.to].into_iter().find(|&end| end >= nodes) {
        return Some(format!("there is no node {end}"));
    }
    let faults = [
        (edge.from == edge.to, "it joins a node to itself"),
        (!is_finite(&edge.measurement), "its measurement is not finite"),
        (!edge.information.iter().all(|v| v.is_finite()), "its information matrix is not finite"),
        (!is_information(&edge.information), "its information matrix is not symmetric with eigenvalues >= 0"),
    ];
    faults.iter().find(|(wrong, _)| *wrong).map(|(_, why)| (*why).to_string())
}

fn is_finite(pose: &Se2) -> bool {
    pose.to_vector().iter().all(|v| v.is_finite())
}

/// Symmetric, and every principal minor is zero or more, both up to rounding.
fn is_information(m: &Matrix3<f64>) -> bool {
    let minor = |i: usize, j: usize| m[(i, i)] * m[(j, j)] - m[(i, j)] * m[(j, i)];
    let size = m.amax();
    let symmetric = (m - m.transpose()).amax() <= 1e-9 * size;
    let first = (0..3).all(|i| m[(i, i)] >= 0.0);
    let second = [(0, 1), (0, 2), (1, 2)].iter().all(|&(i, j)| minor(i, j) >= -1e-9 * m[(i, i)] * m[(j, j)]);
    symmetric && first && second && m.determinant() >= -1e-9 * m[(0, 0)] * m[(1, 1)] * m[(2, 2)]
}

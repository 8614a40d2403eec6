//! Which of the edges that were left out belong to the rest after all.
//!
//! An edge that does not count has a large error also because nothing but the uncertain path around the loop ties its
//! ends. To first order, taking it in would raise the cost by
//!
//! ```text
//! delta = e^T Omega (I + S Omega)^-1 e,    S = J Sigma J^T,    J = [J_i, J_j]
//! ```
//!
//! with Sigma the joint covariance of its ends without it: the Mahalanobis distance of the error from its prediction,
//! written so that a rank-deficient `Omega` does no harm. Taking in an edge with `delta <= c^2` lowers the truncated cost.
//!
//! `Sigma` of a pair needs that pair in the pattern of the factor, which false edges would fill. So an edge is first
//! compared with a bound that needs only the covariance of each end: `S <= 2 J_i Sigma_i J_i^T + 2 J_j Sigma_j J_j^T`.

use super::solve::{Solver, State};
use super::{Edge, Error};
use groma_estimation::BlockMatrix;
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector3};

/// The weights of `state` with all edges taken in that would lower the truncated cost; nothing when there is none or
/// when the edges of `state` do not hold every node.
pub(super) fn weights(solver: &mut Solver<'_>, state: &State) -> Result<Option<Vec<f64>>, Error> {
    let limit = solver.options.inlier_chi_square;
    let Some(covariances) = held(solver.covariances(state, &state.weights))? else { return Ok(None) };
    let within = |edge: &Edge| distance_bound(edge, &state.nodes, &covariances) <= limit;
    let likely = extend(solver, &state.weights, within);
    if likely == state.weights {
        return Ok(None);
    }
    let covariances = solver.covariances(state, &likely)?;
    let within = |edge: &Edge| distance(edge, &state.nodes, &covariances) <= limit;
    let taken = extend(solver, &state.weights, within);
    Ok((taken != state.weights).then_some(taken))
}

fn held(covariances: Result<BlockMatrix<3>, Error>) -> Result<Option<BlockMatrix<3>>, Error> {
    match covariances {
        Err(Error::Free { .. }) => Ok(None),
        other => other.map(Some),
    }
}

fn extend(solver: &Solver<'_>, weights: &[f64], within: impl Fn(&Edge) -> bool) -> Vec<f64> {
    let edges = solver.graph.edges.iter().zip(weights);
    edges.map(|(edge, &weight)| if weight > 0.0 || within(edge) { 1.0 } else { 0.0 }).collect()
}

fn distance(edge: &Edge, nodes: &[Se2], covariances: &BlockMatrix<3>) -> f64 {
    let at = edge.linearize(&nodes[edge.from], &nodes[edge.to]);
    let cross = at.j_from * covariance(covariances, edge.from, edge.to) * at.j_to.transpose();
    let spread = |j: Matrix3<f64>, node: usize| j * covariance(covariances, node, node) * j.transpose();
    let s = spread(at.j_from, edge.from) + spread(at.j_to, edge.to) + cross + cross.transpose();
    mahalanobis(at.error, &edge.information, &s)
}

fn distance_bound(edge: &Edge, nodes: &[Se2], covariances: &BlockMatrix<3>) -> f64 {
    let at = edge.linearize(&nodes[edge.from], &nodes[edge.to]);
    let spread = |j: Matrix3<f64>, node: usize| j * covariance(covariances, node, node) * j.transpose() * 2.0;
    mahalanobis(at.error, &edge.information, &(spread(at.j_from, edge.from) + spread(at.j_to, edge.to)))
}

/// `e^T Omega (I + S Omega)^-1 e`; infinite when that is not a number.
fn mahalanobis(error: Vector3<f64>, omega: &Matrix3<f64>, s: &Matrix3<f64>) -> f64 {
    let solved = (Matrix3::identity() + s * omega).lu().solve(&error);
    solved.map_or(f64::INFINITY, |y| error.dot(&(omega * y)))
}

/// The block of nodes i and j; zero when one of them is node 0, not a number when the pair is not in the pattern.
fn covariance(covariances: &BlockMatrix<3>, i: usize, j: usize) -> Matrix3<f64> {
    let (Some(a), Some(b)) = (i.checked_sub(1), j.checked_sub(1)) else { return Matrix3::zeros() };
    if a == b {
        return covariances.diagonal[a];
    }
    let upper = covariances.slot(a.min(b), a.max(b)).map(|slot| covariances.upper[slot]);
    let block = upper.unwrap_or(Matrix3::repeat(f64::NAN));
    if a < b { block } else { block.transpose() }
}

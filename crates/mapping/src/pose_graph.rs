//! A graph of poses in the plane, and its most likely arrangement.
//!
//! Nodes `x_k` in SE(2), node 0 held; an edge `(i, j)` measures `z = T_i_j` with information `Omega`:
//!
//! ```text
//! e(i, j) = vec(z^-1 (x_i^-1 x_j)) = (R_z^T (R_i^T (t_j - t_i) - t_z), wrap(theta_j - theta_i - theta_z))
//! chi2    = e^T Omega e
//! minimise  sum over trusted edges of chi2 + sum over robust edges of min(chi2, c^2)
//! ```
//!
//! Least squares by Gauss-Newton in a trust region (`pose_graph/solve.rs`); the robust sum by graduated non-convexity
//! (`pose_graph/robust.rs`). The residual is that of g2o (Kuemmerle et al., ICRA 2011), so its files mean the same here.
//! Steps and covariances are right perturbations `x * exp(xi)`, `xi = (x, y, theta)` in the frame of the node.
//! An information matrix may be rank deficient as long as the whole graph is held.
//!
//! What it does not do: it finds a local minimum near its start, and estimates no noise levels.

mod admit;
mod check;
#[cfg(test)]
mod common_loop;
mod dogleg;
mod error;
mod linear;
mod robust;
mod solve;

pub use error::Error;

use groma_estimation::{Cholesky, chi_square::quantile};
use groma_geometry::Se2;
use groma_models::Token;
use linear::System;
use nalgebra::Matrix3;

/// A measured pose of one node in the frame of another.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Node i.
    pub from: usize,
    /// Node j.
    pub to: usize,
    /// `T_from_to`.
    pub measurement: Se2,
    /// Inverse covariance of the error [1/m^2, 1/m, 1]; symmetric, no eigenvalue below zero.
    pub information: Matrix3<f64>,
    /// Whether the edge may be false and is to be left out when it does not fit the rest.
    pub robust: bool,
}

/// Poses and what was measured between them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseGraph {
    /// `T_map_node`; the first is held.
    pub nodes: Vec<Se2>,
    /// The measurements.
    pub edges: Vec<Edge>,
}

/// When to stop, and what counts as false.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Options {
    /// Most Gauss-Newton steps of one descent.
    pub max_iterations: usize,
    /// A descent ends when a step promises to lower the cost by less than this share of `1 + cost`.
    pub tolerance: f64,
    /// A robust edge is kept iff its chi-square is at most this. The default is the 99.9 % quantile for 3 degrees of
    /// freedom.
    pub inlier_chi_square: f64,
    /// By which factor the convexity of the robust cost is lowered from step to step, above 1.
    pub convexity_step: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_iterations: 100, tolerance: 1e-10, inlier_chi_square: quantile(0.999, 3), convexity_step: 1.6 }
    }
}

/// The arrangement that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// `T_map_node`.
    pub nodes: Vec<Se2>,
    /// `e^T Omega e` of each edge, whether kept or not.
    pub chi_squares: Vec<f64>,
    /// 1 for an edge that was used, 0 for a robust edge that was left out.
    pub weights: Vec<f64>,
    /// Gauss-Newton steps that were computed.
    pub iterations: usize,
    /// Whether the last descent ended by its tolerance.
    pub converged: bool,
}

impl PoseGraph {
    /// The most likely poses.
    ///
    /// # Errors
    /// [`Error`] when the graph is malformed, some node is not determined, or `token` is cancelled.
    pub fn optimize(&self, options: &Options, token: &Token) -> Result<Solution, Error> {
        check::graph(self)?;
        check::options(options)?;
        check::connected(self, |_| true)?;
        let all = vec![1.0; self.edges.len()];
        let mut solver = solve::Solver::new(self, options, &all, token)?;
        let effort = solver.full_effort();
        let state = if self.edges.iter().any(|e| e.robust) {
            robust::minimize(&mut solver)?
        } else {
            solver.descend(self.nodes.clone(), all, effort)?
        };
        check::connected(self, |edge| state.weights[edge] > 0.0)?;
        solver.verify(&state)?;
        Ok(solver.solution(state))
    }

    /// Squared Mahalanobis residuals of the edges at the nodes.
    #[must_use]
    pub fn chi_squares(&self) -> Vec<f64> {
        self.edges.iter().map(|e| e.chi_square(&self.nodes)).collect()
    }

    /// The covariance of each node relative to node 0, at the nodes of this graph: of the right perturbation
    /// `(x, y, theta)`; zero for node 0. `weights` are those of a [`Solution`], one an edge.
    ///
    /// # Errors
    /// [`Error`] when the graph is malformed or some node is not determined.
    pub fn marginals(&self, weights: &[f64]) -> Result<Vec<Matrix3<f64>>, Error> {
        check::graph(self)?;
        check::weights(self, weights)?;
        check::connected(self, |edge| weights[edge] > 0.0)?;
        let mut system = System::new(self, weights);
        system.linearize(&self.nodes, weights);
        let mut cholesky = Cholesky::analyze(&system.matrix)?;
        cholesky.factorize(&system.matrix)?;
        let mut covariances = vec![Matrix3::zeros()];
        covariances.extend(cholesky.selected_inverse().diagonal);
        Ok(covariances)
    }
}

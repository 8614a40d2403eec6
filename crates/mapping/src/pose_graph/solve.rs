//! Descent on a pose graph with given edge weights: Gauss-Newton inside a trust region.
//!
//! The step is Powell's dogleg, not that of `estimation::levenberg_marquardt`: a failed step shrinks the region and costs
//! no new factorisation, and it follows narrow curved valleys in which Levenberg's damping creeps. On a drive of ten laps
//! with odometry that knows standstills to a millimetre it takes 6 to 7 factorisations, the common loop 18 to 30; to a
//! micrometre 6 to 7, and the common loop does not end within 200 steps (`common_loop.rs` prints it). A matrix
//! that is not positive definite at some iterate is damped there by `lambda D` until it is.
//!
//! A descent ends when the whole step promises less than `tolerance (1 + cost)`: the promise `g^T d` is the squared
//! length of the step in standard deviations, so the rule knows no units.
//! The pattern is analysed once, and again only when a weight comes back or many edges have lost theirs.
//! Source: Rosen, Kaess, Leonard, T-RO 30 (2014) 1091.

use super::dogleg::Model;
use super::linear::System;
use super::{Error, Options, PoseGraph, Solution};
use groma_estimation::{BlockMatrix, Cholesky};
use groma_geometry::{Se2, So2};
use groma_models::Token;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Damping of the first retry of a matrix that is not positive definite, and where retrying ends.
const FIRST_DAMPING: f64 = 1e-9;
const LAST_DAMPING: f64 = 1e3;
/// A region this much smaller than the step is given up.
const LEAST_SHARE: f64 = 1e-9;
/// The pattern is analysed anew when fewer than this share of its blocks is in use.
const LEAST_USE: f64 = 0.95;

/// Nodes with the weights they belong to.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub nodes: Vec<Se2>,
    pub weights: Vec<f64>,
    pub converged: bool,
}

/// When a descent ends.
#[derive(Clone, Copy)]
pub(super) struct Effort {
    pub iterations: usize,
    pub tolerance: f64,
}

/// A graph with the memory that all its descents share.
pub(super) struct Solver<'a> {
    pub graph: &'a PoseGraph,
    pub options: &'a Options,
    token: &'a Token,
    system: System<'a>,
    cholesky: Cholesky<3>,
    iterations: usize,
}

/// What a step led to.
pub(super) struct Moved {
    pub nodes: Vec<Se2>,
    pub cost: f64,
    /// What the unrestricted step had promised.
    pub promise: f64,
}

impl<'a> Solver<'a> {
    pub(super) fn new(
        graph: &'a PoseGraph,
        options: &'a Options,
        weights: &[f64],
        token: &'a Token,
    ) -> Result<Self, Error> {
        let system = System::new(graph, weights);
        let cholesky = Cholesky::analyze(&system.matrix)?;
        Ok(Self { graph, options, token, system, cholesky, iterations: 0 })
    }

    /// The effort that the options ask for.
    pub(super) fn full_effort(&self) -> Effort {
        Effort { iterations: self.options.max_iterations, tolerance: self.options.tolerance }
    }

    /// The minimum of the weighted cost near `nodes`.
    pub(super) fn descend(&mut self, mut nodes: Vec<Se2>, weights: Vec<f64>, effort: Effort) -> Result<State, Error> {
        let (mut radius, mut cost) = (f64::INFINITY, self.cost(&nodes, &weights));
        let mut converged = nodes.len() == 1;
        for _ in 0..effort.iterations {
            if converged {
                break;
            }
            let Some(moved) = self.step(&nodes, &weights, cost, &mut radius)? else { break };
            converged = moved.promise <= effort.tolerance * (1.0 + moved.cost);
            (nodes, cost) = (moved.nodes, moved.cost);
        }
        Ok(State { nodes, weights, converged })
    }

    /// A step that does not raise `cost`, which is that of `nodes`; nothing when there is none.
    pub(super) fn step(
        &mut self,
        nodes: &[Se2],
        weights: &[f64],
        cost: f64,
        radius: &mut f64,
    ) -> Result<Option<Moved>, Error> {
        self.token.check()?;
        self.iterations += 1;
        let Some(model) = self.model(nodes, weights)? else { return Ok(None) };
        while *radius >= LEAST_SHARE * model.whole {
            let step = model.step(*radius);
            let moved = retract(nodes, &step.delta);
            let reached = self.cost(&moved, weights);
            let gain = (cost - reached) / step.decrease;
            if gain > 0.75 {
                *radius = radius.max(3.0 * step.length);
            }
            if reached <= cost * (1.0 + 1e-12) + 1e-18 {
                *radius = if gain < 0.25 { step.length / 2.0 } else { *radius };
                return Ok(Some(Moved { nodes: moved, cost: reached, promise: model.promise }));
            }
            *radius = step.length / 4.0;
        }
        Ok(None)
    }

    fn model(&mut self, nodes: &[Se2], weights: &[f64]) -> Result<Option<Model>, Error> {
        self.fit_pattern(weights)?;
        self.system.linearize(nodes, weights);
        if !self.factorize_damped()? {
            return Ok(None);
        }
        let gauss_newton = self.cholesky.solve(&self.system.gradient)?;
        Ok(Some(Model::new(&self.system.matrix, self.system.gradient.clone(), gauss_newton)))
    }

    /// Analyses the pattern anew when it lacks an edge that counts or holds many that do not.
    fn fit_pattern(&mut self, weights: &[f64]) -> Result<(), Error> {
        if self.system.usage(weights).is_none_or(|share| share < LEAST_USE) {
            self.system = System::new(self.graph, weights);
            self.cholesky = Cholesky::analyze(&self.system.matrix)?;
        }
        Ok(())
    }

    /// Factorises the system, damped as little as it needs; false when nothing helps.
    fn factorize_damped(&mut self) -> Result<bool, Error> {
        let traces: f64 = self.system.matrix.diagonal.iter().map(Matrix3::trace).sum();
        let floor = 1e-9 * traces / self.system.matrix.blocks().max(1) as f64;
        let mut damping = 0.0;
        while damping < LAST_DAMPING {
            match self.cholesky.factorize(&self.system.matrix) {
                Err(groma_estimation::Error::NotPositiveDefinite { .. }) => {}
                outcome => return Ok(outcome.map(|()| true)?),
            }
            damping = (damping * 100.0).max(FIRST_DAMPING);
            for block in &mut self.system.matrix.diagonal {
                (0..3).for_each(|k| block[(k, k)] += damping * (block[(k, k)] + floor));
            }
        }
        Ok(false)
    }

    /// The weighted sum of chi-squares.
    pub(super) fn cost(&self, nodes: &[Se2], weights: &[f64]) -> f64 {
        self.graph.edges.iter().zip(weights).map(|(e, w)| if *w > 0.0 { w * e.chi_square(nodes) } else { 0.0 }).sum()
    }

    /// The covariances of the nodes but node 0 and of the pairs that an edge with a weight in `pattern` joins, when the
    /// edges count as in `state`.
    pub(super) fn covariances(&mut self, state: &State, pattern: &[f64]) -> Result<BlockMatrix<3>, Error> {
        self.fit_pattern(pattern)?;
        self.system.linearize(&state.nodes, &state.weights);
        self.cholesky.factorize(&self.system.matrix)?;
        Ok(self.cholesky.selected_inverse())
    }

    /// Whether the edges that were kept hold every node without damping.
    pub(super) fn verify(&mut self, state: &State) -> Result<(), Error> {
        self.fit_pattern(&state.weights)?;
        self.system.linearize(&state.nodes, &state.weights);
        Ok(self.cholesky.factorize(&self.system.matrix)?)
    }

    pub(super) fn solution(&self, state: State) -> Solution {
        let State { nodes, weights, converged } = state;
        let chi_squares = self.graph.edges.iter().map(|e| e.chi_square(&nodes)).collect();
        Solution { nodes, chi_squares, weights, iterations: self.iterations, converged }
    }
}

/// The nodes moved by `-delta`; node 0 stays.
pub(super) fn retract(nodes: &[Se2], delta: &[Vector3<f64>]) -> Vec<Se2> {
    let moved = nodes.iter().skip(1).zip(delta).map(|(x, d)| Se2 {
        rotation: (x.rotation * So2::exp(-d.z)).normalized(),
        translation: x.translation - x.rotation.act(Vector2::new(d.x, d.y)),
    });
    nodes.iter().take(1).copied().chain(moved).collect()
}

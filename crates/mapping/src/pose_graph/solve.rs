//! Descent on a pose graph with given edge weights: Gauss-Newton, damped when a step does not descend.
//!
//! A step solves `(H + lambda diag H) d = -g`, and is taken when the weighted cost does not rise. `lambda` is zero until
//! a step fails, then grows by ten; each success divides it by ten until it vanishes again (Marquardt 1963).
//! The descent ends when the step promises less than `tolerance (1 + cost)`: the promise `-g^T d` is the squared length
//! of the step in standard deviations, so the rule knows no units.

use super::linear::System;
use super::{Error, Options, PoseGraph, Solution};
use groma_estimation::Cholesky;
use groma_geometry::{Se2, So2};
use nalgebra::{Vector2, Vector3};

/// Damping of the first retry, and the least that is not zero.
const FIRST_DAMPING: f64 = 1e-5;
/// Beyond this a step is too short to change a pose.
const LAST_DAMPING: f64 = 1e12;

/// Nodes with the weights they belong to.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub nodes: Vec<Se2>,
    pub weights: Vec<f64>,
    pub converged: bool,
}

/// A graph with the memory that all its descents share.
pub(super) struct Solver<'a> {
    pub graph: &'a PoseGraph,
    pub options: &'a Options,
    system: System<'a>,
    cholesky: Cholesky<3>,
    iterations: usize,
}

/// What a step led to.
pub(super) enum Step {
    /// The nodes moved; the cost there, and what the step had promised.
    Taken { nodes: Vec<Se2>, cost: f64, promise: f64 },
    /// No step of any length descends.
    Stuck,
}

impl<'a> Solver<'a> {
    pub(super) fn new(graph: &'a PoseGraph, options: &'a Options) -> Result<Self, Error> {
        let system = System::new(graph);
        let cholesky = Cholesky::analyze(&system.matrix)?;
        Ok(Self { graph, options, system, cholesky, iterations: 0 })
    }

    /// The minimum of the weighted cost near `nodes`.
    pub(super) fn descend(&mut self, mut nodes: Vec<Se2>, weights: Vec<f64>) -> Result<State, Error> {
        let (mut damping, mut cost) = (0.0, self.cost(&nodes, &weights));
        let mut converged = self.graph.nodes.len() == 1;
        for _ in 0..self.options.max_iterations {
            if converged {
                break;
            }
            match self.step(&nodes, &weights, cost, &mut damping)? {
                Step::Stuck => converged = true,
                Step::Taken { nodes: moved, cost: lowered, promise } => {
                    converged = promise <= self.options.tolerance * (1.0 + lowered);
                    (nodes, cost) = (moved, lowered);
                }
            }
        }
        Ok(State { nodes, weights, converged })
    }

    /// One step that does not raise `cost`, which is that of `nodes`.
    pub(super) fn step(&mut self, nodes: &[Se2], weights: &[f64], cost: f64, damping: &mut f64) -> Result<Step, Error> {
        self.system.linearize(nodes, weights);
        self.iterations += 1;
        let allowed = cost * (1.0 + 1e-12) + 1e-18;
        while *damping < LAST_DAMPING {
            if let Some((delta, promise)) = self.direction(*damping)? {
                let moved = retract(nodes, &delta);
                let reached = self.cost(&moved, weights);
                if reached <= allowed {
                    *damping = if *damping > FIRST_DAMPING { *damping / 10.0 } else { 0.0 };
                    return Ok(Step::Taken { nodes: moved, cost: reached, promise });
                }
            }
            *damping = (*damping * 10.0).max(FIRST_DAMPING);
        }
        Ok(Step::Stuck)
    }

    /// The damped step and what it promises; nothing when the damped matrix is not positive definite.
    fn direction(&mut self, damping: f64) -> Result<Option<(Vec<Vector3<f64>>, f64)>, Error> {
        let undamped = (damping > 0.0).then(|| self.system.matrix.diagonal.clone());
        if damping > 0.0 {
            self.system.matrix.diagonal.iter_mut().for_each(|block| {
                let floor = 1e-9 * block.trace();
                (0..3).for_each(|k| block[(k, k)] += damping * (block[(k, k)] + floor));
            });
        }
        let outcome = self.cholesky.factorize(&self.system.matrix);
        if let Some(diagonal) = undamped {
            self.system.matrix.diagonal = diagonal;
        }
        match outcome {
            Err(groma_estimation::Error::NotPositiveDefinite { .. }) => return Ok(None),
            other => other?,
        }
        let step = self.cholesky.solve(&self.system.gradient)?;
        let promise = step.iter().zip(&self.system.gradient).map(|(d, g)| d.dot(g)).sum();
        Ok(Some((step, promise)))
    }

    /// The weighted sum of chi-squares.
    pub(super) fn cost(&self, nodes: &[Se2], weights: &[f64]) -> f64 {
        self.graph.edges.iter().zip(weights).map(|(e, w)| if *w > 0.0 { w * e.chi_square(nodes) } else { 0.0 }).sum()
    }

    /// The chi-square of every edge.
    pub(super) fn chi_squares(&self, nodes: &[Se2]) -> Vec<f64> {
        self.graph.edges.iter().map(|e| e.chi_square(nodes)).collect()
    }

    /// Whether the edges that were kept hold every node without damping.
    pub(super) fn verify(&mut self, state: &State) -> Result<(), Error> {
        self.system.linearize(&state.nodes, &state.weights);
        Ok(self.cholesky.factorize(&self.system.matrix)?)
    }

    pub(super) fn solution(&self, state: State) -> Solution {
        let chi_squares = self.chi_squares(&state.nodes);
        let State { nodes, weights, converged } = state;
        Solution { nodes, chi_squares, weights, iterations: self.iterations, converged }
    }
}

/// The nodes moved by `-delta`; node 0 stays.
fn retract(nodes: &[Se2], delta: &[Vector3<f64>]) -> Vec<Se2> {
    let moved = nodes.iter().skip(1).zip(delta).map(|(x, d)| Se2 {
        rotation: (x.rotation * So2::exp(-d.z)).normalized(),
        translation: x.translation - x.rotation.act(Vector2::new(d.x, d.y)),
    });
    nodes.iter().take(1).copied().chain(moved).collect()
}

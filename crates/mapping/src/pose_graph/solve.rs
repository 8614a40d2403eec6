//! Descent on a pose graph with given edge weights: Gauss-Newton inside a trust region, by Powell's dogleg.
//!
//! With `H d = g` the step is `-d` when it is short enough; else it lies on the path from the steepest descent
//! `s = (g^T D^-1 g / (D^-1 g)^T H (D^-1 g)) D^-1 g` to `d`, at the edge of the region `|step|_D <= radius`,
//! `D = diag H`. A failed step shrinks the region and costs no new factorisation. This follows narrow curved valleys
//! (an odometry that knows a standstill to a micrometre) in which Levenberg's damping creeps.
//! A matrix that is not positive definite at some iterate is damped there by `lambda D` until it is.
//!
//! The descent ends when the whole step promises less than `tolerance (1 + cost)`: the promise `g^T d` is the squared
//! length of the step in standard deviations, so the rule knows no units.
//! Source: Powell 1970; Rosen, Kaess, Leonard, T-RO 30 (2014) 1091.

use super::linear::System;
use super::{Error, Options, PoseGraph, Solution};
use groma_estimation::Cholesky;
use groma_geometry::{Se2, So2};
use nalgebra::{Vector2, Vector3};

type Blocks = Vec<Vector3<f64>>;

/// Damping of the first retry of a matrix that is not positive definite, and where retrying ends.
const FIRST_DAMPING: f64 = 1e-9;
const LAST_DAMPING: f64 = 1e3;
/// A region this much smaller than the step is given up.
const LEAST_SHARE: f64 = 1e-9;

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
pub(super) struct Step {
    pub nodes: Vec<Se2>,
    pub cost: f64,
    /// What the unrestricted step had promised.
    pub promise: f64,
}

/// The quadratic model at an iterate.
struct Model {
    gauss_newton: Blocks,
    steepest: Blocks,
    gradient: Blocks,
    /// `H steepest`.
    curvature: Blocks,
    scale: Blocks,
}

impl<'a> Solver<'a> {
    pub(super) fn new(graph: &'a PoseGraph, options: &'a Options) -> Result<Self, Error> {
        let system = System::new(graph);
        let cholesky = Cholesky::analyze(&system.matrix)?;
        Ok(Self { graph, options, system, cholesky, iterations: 0 })
    }

    /// The minimum of the weighted cost near `nodes`.
    pub(super) fn descend(&mut self, mut nodes: Vec<Se2>, weights: Vec<f64>) -> Result<State, Error> {
        let (mut radius, mut cost) = (f64::INFINITY, self.cost(&nodes, &weights));
        let mut converged = self.graph.nodes.len() == 1;
        for _ in 0..self.options.max_iterations {
            if converged {
                break;
            }
            let Some(step) = self.step(&nodes, &weights, cost, &mut radius)? else { break };
            converged = step.promise <= self.options.tolerance * (1.0 + step.cost);
            (nodes, cost) = (step.nodes, step.cost);
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
    ) -> Result<Option<Step>, Error> {
        self.system.linearize(nodes, weights);
        self.iterations += 1;
        let Some(model) = self.model()? else { return Ok(None) };
        let whole = model.length(&model.gauss_newton);
        let promise = dot(&model.gauss_newton, &model.gradient);
        while *radius >= LEAST_SHARE * whole {
            let (back, along) = model.dogleg(whole, *radius);
            let step = model.combine(back, along);
            let moved = retract(nodes, &step);
            let reached = self.cost(&moved, weights);
            let gain = (cost - reached) / model.decrease(back, along, &step);
            let length = model.length(&step);
            if gain < 0.25 {
                *radius = length / 2.0;
            } else if gain > 0.75 {
                *radius = radius.max(3.0 * length);
            }
            if reached <= cost * (1.0 + 1e-12) + 1e-18 {
                return Ok(Some(Step { nodes: moved, cost: reached, promise }));
            }
            *radius = radius.min(length / 4.0);
        }
        Ok(None)
    }

    fn model(&mut self) -> Result<Option<Model>, Error> {
        if !self.factorize_damped()? {
            return Ok(None);
        }
        let gradient = self.system.gradient.clone();
        let gauss_newton = self.cholesky.solve(&gradient)?;
        let scale: Blocks = self.system.matrix.diagonal.iter().map(|block| block.diagonal()).collect();
        let uphill: Blocks = gradient.iter().zip(&scale).map(|(g, s)| g.component_div(s)).collect();
        let bent = self.system.matrix.multiply(&uphill);
        let share = dot(&gradient, &uphill) / dot(&uphill, &bent);
        let scaled = |v: Blocks| v.into_iter().map(|x| x * share).collect();
        let (steepest, curvature) = (scaled(uphill), scaled(bent));
        Ok(Some(Model { gauss_newton, steepest, gradient, curvature, scale }))
    }

    /// Factorises the system, damped as little as it needs; false when nothing helps.
    fn factorize_damped(&mut self) -> Result<bool, Error> {
        let mut damping = 0.0;
        while damping < LAST_DAMPING {
            match self.cholesky.factorize(&self.system.matrix) {
                Err(groma_estimation::Error::NotPositiveDefinite { .. }) => {}
                outcome => return Ok(outcome.map(|()| true)?),
            }
            damping = (damping * 100.0).max(FIRST_DAMPING);
            for block in &mut self.system.matrix.diagonal {
                let floor = 1e-9 * block.trace() + f64::MIN_POSITIVE;
                (0..3).for_each(|k| block[(k, k)] += damping * (block[(k, k)] + floor));
            }
        }
        Ok(false)
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

impl Model {
    /// Length in the metric D.
    fn length(&self, step: &Blocks) -> f64 {
        step.iter().zip(&self.scale).map(|(v, s)| v.component_mul(v).dot(s)).sum::<f64>().sqrt()
    }

    /// The shares of steepest descent and of Gauss-Newton in the step that the radius allows.
    fn dogleg(&self, whole: f64, radius: f64) -> (f64, f64) {
        let first = self.length(&self.steepest);
        if whole <= radius {
            return (0.0, 1.0);
        }
        if first >= radius {
            return (radius / first, 0.0);
        }
        let inner: f64 = self
            .steepest
            .iter()
            .zip(&self.gauss_newton)
            .zip(&self.scale)
            .map(|((a, b), s)| a.component_mul(b).dot(s))
            .sum();
        let (a, b, c) =
            (whole * whole - 2.0 * inner + first * first, inner - first * first, radius * radius - first * first);
        let along = c / (b + (b * b + a * c).sqrt());
        (1.0 - along, along)
    }

    fn combine(&self, back: f64, along: f64) -> Blocks {
        self.steepest.iter().zip(&self.gauss_newton).map(|(s, d)| s * back + d * along).collect()
    }

    /// How much the quadratic model falls along `-step`, by `H d = g`.
    fn decrease(&self, back: f64, along: f64, step: &Blocks) -> f64 {
        2.0 * dot(&self.gradient, step) - back * dot(&self.curvature, step) - along * dot(&self.gradient, step)
    }
}

fn dot(a: &Blocks, b: &Blocks) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// The nodes moved by `-delta`; node 0 stays.
fn retract(nodes: &[Se2], delta: &[Vector3<f64>]) -> Vec<Se2> {
    let moved = nodes.iter().skip(1).zip(delta).map(|(x, d)| Se2 {
        rotation: (x.rotation * So2::exp(-d.z)).normalized(),
        translation: x.translation - x.rotation.act(Vector2::new(d.x, d.y)),
    });
    nodes.iter().take(1).copied().chain(moved).collect()
}

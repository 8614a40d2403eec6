//! Pose graphs by the loop of `estimation::levenberg_marquardt`, compared with the dogleg: why they have a loop of their own.
//!
//! `cargo test --release -p groma-mapping common_loop -- --nocapture` prints the figures.

#![allow(clippy::print_stdout)]

use super::linear::System;
use super::solve::{Solver, retract};
use super::{Edge, Error, Options, PoseGraph};
use groma_estimation::levenberg_marquardt::{self, Problem, minimize};
use groma_estimation::random::SplitMix64;
use groma_estimation::{BlockMatrix, Cholesky};
use groma_geometry::Se2;
use groma_models::Token;
use nalgebra::{Matrix3, Vector3};

/// Steps of the common loop, at most.
const MOST: usize = 200;

/// The plain cost of a graph with its normal equations.
struct Descent<'a> {
    graph: &'a PoseGraph,
    system: System<'a>,
    cholesky: Cholesky<3>,
    factorisations: usize,
}

impl Descent<'_> {
    fn damped(&self, damping: f64) -> BlockMatrix<3> {
        let mut damped = self.system.matrix.clone();
        for block in &mut damped.diagonal {
            (0..3).for_each(|k| block[(k, k)] *= 1.0 + damping);
        }
        damped
    }
}

impl Problem for Descent<'_> {
    type State = Vec<Se2>;
    type Step = Vec<Vector3<f64>>;
    type Error = Error;

    fn cost(&mut self, nodes: &Vec<Se2>) -> Result<Option<f64>, Error> {
        Ok(Some(self.graph.edges.iter().map(|e| e.chi_square(nodes)).sum()))
    }

    fn linearize(&mut self, nodes: &Vec<Se2>) -> Result<(), Error> {
        self.system.linearize(nodes, &vec![1.0; self.graph.edges.len()]);
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Self::Step, f64)>, Error> {
        self.factorisations += 1;
        let damped = self.damped(damping);
        if self.cholesky.factorize(&damped).is_err() {
            return Ok(None);
        }
        let step = self.cholesky.solve(&self.system.gradient)?;
        let bent = self.system.matrix.multiply(&step);
        let dot = |a: &[Vector3<f64>]| a.iter().zip(&step).map(|(a, d)| a.dot(d)).sum::<f64>();
        let promise = 2.0 * dot(&self.system.gradient) - dot(&bent);
        Ok(Some((step, promise)))
    }

    fn moved(&self, nodes: &Vec<Se2>, step: &Self::Step) -> Option<Vec<Se2>> {
        Some(retract(nodes, step))
    }
}

/// A drive of `laps` around a square block of 5 m steps, with errors of 5 cm and 0.02 rad, every place seen again a lap later;
/// on every tenth step the robot stands still, which the odometry knows to `still` m.
fn drive(seed: u64, laps: usize, still: f64) -> PoseGraph {
    let mut random = SplitMix64::new(seed);
    let mut noise =
        |sigma: f64, turn: f64| Vector3::new(sigma * random.normal(), sigma * random.normal(), turn * random.normal());
    let lap = 80;
    let stands = |k: usize| k % 10 == 5;
    let step = |k: usize| match k % 20 {
        _ if stands(k) => Se2::IDENTITY,
        0 => Se2::new(5.0, 0.0, std::f64::consts::FRAC_PI_2),
        _ => Se2::new(5.0, 0.0, 0.0),
    };
    let mut truth = vec![Se2::IDENTITY];
    (0..laps * lap).for_each(|k| truth.push(truth[k] * step(k)));
    let (mut nodes, mut edges) = (vec![Se2::IDENTITY], vec![]);
    let information =
        |sigma: f64, turn: f64| Matrix3::from_diagonal(&Vector3::new(sigma.powi(-2), sigma.powi(-2), turn.powi(-2)));
    for k in 0..laps * lap {
        let (sigma, turn) = if stands(k) { (still, still) } else { (0.05, 0.02) };
        let measurement = step(k).plus(noise(sigma, turn));
        nodes.push(nodes[k] * measurement);
        edges.push(Edge { from: k, to: k + 1, measurement, information: information(sigma, turn), robust: false });
    }
    for k in (lap..=laps * lap).step_by(7) {
        let measurement = truth[k - lap].between(&truth[k]).plus(noise(0.05, 0.02));
        edges.push(Edge { from: k - lap, to: k, measurement, information: information(0.05, 0.02), robust: false });
    }
    PoseGraph { nodes, edges }
}

/// Factorisations of the dogleg and of the common loop, and whether the latter came to its end.
fn compare(seed: u64, still: f64) -> (usize, usize, bool) {
    let graph = drive(seed, 10, still);
    let weights = vec![1.0; graph.edges.len()];
    let (options, token) = (Options::default(), Token::new());
    let mut solver = Solver::new(&graph, &options, &weights, &token).unwrap();
    let effort = solver.full_effort();
    let own = solver.descend(graph.nodes.clone(), weights.clone(), effort).unwrap();
    assert!(own.converged);
    let system = System::new(&graph, &weights);
    let cholesky = Cholesky::analyze(&system.matrix).unwrap();
    let mut descent = Descent { graph: &graph, system, cholesky, factorisations: 0 };
    let limits = levenberg_marquardt::Options { max_iterations: MOST, tolerance: effort.tolerance };
    let common = minimize(&mut descent, graph.nodes.clone(), &limits).unwrap().unwrap();
    (solver.solution(own).iterations, descent.factorisations, common.converged)
}

#[test]
fn the_dogleg_needs_half_the_factorisations_and_ends_where_the_common_loop_creeps() {
    for still in [1e-3, 1e-6] {
        for seed in 1..=3 {
            let (own, common, converged) = compare(seed, still);
            println!(
                "standstill known to {still} m, seed {seed}: dogleg {own} factorisations; common loop {common}, converged {converged}"
            );
            assert!(2 * own < common && converged == (still > 1e-4));
        }
    }
}

//! Student's likelihood with every turn's weighted squares minimised by the loop of `estimation::levenberg_marquardt`, compared
//! with one step a turn: why the calibration of a vehicle does not use it.
//!
//! `cargo test --release -p groma-calibration --test vehicle_common_loop -- --nocapture` prints the figures.

#![allow(clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{Noise, Random, grid, noisy, spoil, stop_and_go, tricycle};
use groma_calibration::vehicle::options::RESIDUAL;
use groma_calibration::vehicle::parameters::Full;
use groma_calibration::vehicle::robust::{Fit, Problem as Vehicles};
use groma_calibration::vehicle::search::search;
use groma_calibration::vehicle::{Layout, Model, Motions, Options, Request, Segments, Vehicle, likelihood};
use groma_estimation::levenberg_marquardt::{self, Problem, minimize};
use groma_models::{Token, WheelNoise};
use nalgebra::{DMatrix, DVector, Matrix3};
use std::convert::Infallible;

const NO_NOISE: WheelNoise = WheelNoise { slip: 0.0, steering: 0.0, memory: 3.0 };

/// The weighted squares of one turn. The motions have one covariance each and no couplings, the wheels no noise of their own.
struct Turn<'a> {
    start: Vehicle,
    segments: &'a Segments,
    motions: &'a Motions,
    layout: &'a Layout,
    roots: &'a [Matrix3<f64>],
    weights: Vec<f64>,
    information: DMatrix<f64>,
    gradient: DVector<f64>,
    linearisations: usize,
}

impl Problem for Turn<'_> {
    type State = Full;
    type Step = DVector<f64>;
    type Error = Infallible;

    fn cost(&mut self, at: &Full) -> Result<Option<f64>, Infallible> {
        let residuals = likelihood::residuals(&self.start.with_full(at), self.segments, self.motions);
        let white = residuals.iter().zip(self.roots).map(|(r, root)| (root * r).norm_squared());
        Ok(Some(white.zip(&self.weights).map(|(square, w)| w * square).sum()))
    }

    fn linearize(&mut self, at: &Full) -> Result<(), Infallible> {
        self.linearisations += 1;
        let mut rows = likelihood::rows(&self.start.with_full(at), self.segments, self.motions);
        for ((row, root), w) in rows.iter_mut().zip(self.roots).zip(&self.weights) {
            (row.residual, row.design) = (root * row.residual, root * row.design);
            *row = row.weighted(*w);
        }
        let (normal, gradient) = likelihood::normal(&rows);
        (self.information, self.gradient) = (self.layout.reduced(&normal), self.layout.reduced_vector(&gradient));
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(DVector<f64>, f64)>, Infallible> {
        let added = self.information.diagonal() * damping;
        let damped = &self.information + DMatrix::from_diagonal(&added);
        let step = damped.cholesky().map(|c| c.solve(&self.gradient));
        Ok(step.map(|d| (d.clone(), added.component_mul(&d).dot(&d) + self.gradient.dot(&d))))
    }

    fn moved(&self, at: &Full, step: &DVector<f64>) -> Option<Full> {
        Some(self.layout.moved(at, step))
    }
}

/// Turns and linearisations until nothing moves, and the vehicle.
fn by_common_loop(start: Vehicle, problem: &Vehicles<'_>, roots: &[Matrix3<f64>]) -> (usize, usize, Vehicle) {
    let (motions, layout, student) = (problem.motions, problem.layout, problem.options.student());
    let segments = Segments::new(problem.log, &motions.motions, start.delay);
    let (mut vehicle, mut scale_sq, mut linearisations) = (start, f64::NAN, 0);
    for turn in 1..100 {
        let residuals = likelihood::residuals(&vehicle, &segments, motions);
        let d_sq: Vec<f64> = residuals.iter().zip(roots).map(|(r, root)| (root * r).norm_squared()).collect();
        let before = scale_sq;
        if turn == 1 {
            scale_sq = d_sq.iter().sum::<f64>() / (RESIDUAL * d_sq.len() as f64);
        }
        let weights: Vec<f64> = d_sq.iter().map(|d| student.weight(d / scale_sq)).collect();
        let squares: f64 = weights.iter().zip(&d_sq).map(|(w, d)| w * d).sum();
        scale_sq = squares / (RESIDUAL * weights.iter().sum::<f64>());
        let weights = weights.iter().map(|w| w / scale_sq).collect();
        let (information, gradient) = (DMatrix::zeros(0, 0), DVector::zeros(0));
        let mut fit = Turn {
            start: vehicle,
            segments: &segments,
            motions,
            layout,
            roots,
            weights,
            information,
            gradient,
            linearisations: 0,
        };
        let at = vehicle.to_full();
        let options = levenberg_marquardt::Options { max_iterations: 50, tolerance: 1e-10 };
        let Ok(end) = minimize(&mut fit, at, &options);
        let end = end.unwrap();
        linearisations += fit.linearisations;
        let moved = layout.values(&end.state) - layout.values(&at);
        vehicle = vehicle.with_full(&end.state);
        if (&fit.information * &moved).dot(&moved) < 1e-10 && (scale_sq / before - 1.0).abs() < 1e-6 {
            return (turn, linearisations, vehicle);
        }
    }
    panic!("no end");
}

#[test]
fn the_common_loop_saves_no_turns_and_linearises_more() {
    let truth = tricycle(false);
    let (log, spans) = stop_and_go(&truth, &grid(6, 18.0, 50.0, 180.0));
    let layout = Layout::new(Model::Tricycle, &[]).unwrap();
    let options = Options { noise: NO_NOISE, ..Options::default() };
    let (mut own_turns, mut turns, mut linearisations) = (0, 0, 0);
    for seed in 0..20 {
        let mut random = Random::new(seed);
        let mut motions = noisy(&truth, &log, &spans, &Noise::default_of_notes(), &mut random);
        spoil(&mut motions, 0.1, &mut random);
        motions.couplings = None;
        let token = Token::new();
        let problem = Vehicles { log: &log, motions: &motions, layout: &layout, options: &options, token: &token };
        let request = Request { wheelbase: Some(drives::WHEELBASE), ..Request::default() };
        let start = search(&problem, &request).unwrap();
        let fit: Fit = problem.estimate(start).unwrap();
        let blocks = &fit.noise.scatter.blocks;
        let roots: Vec<Matrix3<f64>> =
            blocks.iter().map(|s| s.cholesky().unwrap().l().try_inverse().unwrap()).collect();
        let (common, linearised, vehicle) = by_common_loop(start, &problem, &roots);
        let apart = layout.values(&vehicle.to_full()) - layout.values(&fit.vehicle.to_full());
        assert!(apart.iter().all(|e| e.abs() < 1e-8), "the same estimate: {apart}");
        (own_turns, turns, linearisations) = (own_turns + fit.turns, turns + common, linearisations + linearised);
    }
    println!("one step a turn: {own_turns} turns; common loop: {turns} turns, {linearisations} linearisations");
    assert!(20 * turns > 19 * own_turns && 2 * own_turns < linearisations);
}

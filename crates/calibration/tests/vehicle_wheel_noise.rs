//! The noise of the wheels is part of the likelihood: intervals cover under slip, a steering error that remembers and counters
//! in steps, for arcs with stops and for driving on, and the noise that is claimed is what drawn drives scatter.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{
    Noise, Random, between_scans, differential, done, driving_on, grid, noisy, stop_and_go, tricycle, windows,
};
use groma_calibration::vehicle::wheel_process::WheelProcess;
use groma_calibration::vehicle::{
    Calibration, Model, Motions, Options, Request, Segments, Vehicle, calibrate, prediction, stopping,
};
use groma_models::wheel_log::Step;
use groma_models::{Drive, Token, WheelLog, WheelNoise};
use nalgebra::{DVector, Matrix3, Vector3};

#[derive(Clone, Copy, Debug, PartialEq)]
enum Driving {
    /// So many arcs with stops.
    Arcs(usize),
    /// So many seconds, cut into windows of half a second whose neighbours share a scan.
    On(f64),
}

/// What the likelihood takes the steering error for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Assumed {
    /// What it is.
    Process,
    /// One number a motion, another one for the next.
    Constant,
    /// One number for six seconds, another one then and for the next motion.
    Blocks,
}

struct Cell {
    model: Model,
    driving: Driving,
    assumed: Assumed,
    noise: Noise,
}

struct Outcome {
    names: Vec<&'static str>,
    /// Claimed standard deviation, root mean square, over scatter.
    ratio: Vec<f64>,
    coverage: Vec<f64>,
}

impl Cell {
    fn vehicle(&self) -> Vehicle {
        match self.model {
            Model::Tricycle => tricycle(false),
            Model::TricycleAsymmetric => tricycle(true),
            Model::Differential => differential(),
        }
    }

    fn data(&self, random: &mut Random) -> (WheelLog, Motions) {
        let (vehicle, steering) = (self.vehicle(), std::f64::consts::TAU / 16384.0);
        let counter = if self.model == Model::Differential { std::f64::consts::TAU / 4096.0 } else { 1.0 };
        let (clean, motions) = match self.driving {
            Driving::Arcs(count) => {
                let (clean, spans) = stop_and_go(&vehicle, &grid(count / 4, 18.0, 50.0, 180.0));
                let motions = noisy(&vehicle, &clean, &spans, &self.noise, random);
                (clean, motions)
            }
            Driving::On(seconds) => {
                let clean = driving_on(&vehicle, seconds, random);
                let done = done(&vehicle, &clean, &self.noise, random);
                let motions = between_scans(&vehicle, &done, &windows(&done, 0.5, 0.3), &self.noise, random);
                (clean, motions)
            }
        };
        (drives::quantised(&clean, counter, steering), motions)
    }

    fn run(&self, seed: u64) -> Calibration {
        let (log, mut motions) = self.data(&mut Random::new(seed));
        let mut options = Options { folds: 0, ..Options::default() };
        if self.assumed != Assumed::Process {
            self.state(&log, &mut motions, &options.noise);
            (options.noise.slip, options.noise.steering) = (0.0, 0.0);
        }
        let (model, wheelbase) = (Some(self.model), Some(drives::WHEELBASE));
        let request = Request { model, wheelbase, ..Request::default() };
        calibrate(&log, &motions, &request, &options, &Token::new()).unwrap()
    }

    /// Adds the noise of the wheels to the stated covariances, as it is assumed.
    fn state(&self, log: &WheelLog, motions: &mut Motions, noise: &WheelNoise) {
        let vehicle = self.vehicle();
        let segments = Segments::new(log, &motions.motions, 0.0);
        for (k, covariance) in motions.covariances.as_mut().unwrap().iter_mut().enumerate() {
            let steps = segments.steps(k);
            let slip = WheelNoise { steering: 0.0, ..*noise };
            *covariance += WheelProcess::new(&vehicle, steps, &slip).covariance;
            if matches!(vehicle.drive, Drive::Tricycle(_)) {
                let length = if self.assumed == Assumed::Blocks { 6.0 } else { f64::INFINITY };
                *covariance += blocks(&vehicle, steps, length, noise.steering);
            }
        }
    }

    fn runs(&self, count: u64) -> Outcome {
        let truth = self.vehicle().to_full();
        let found: Vec<Calibration> = (0..count).map(|seed| self.run(seed)).collect();
        let errors: Vec<DVector<f64>> =
            found.iter().map(|f| f.layout.values(&f.vehicle.to_full()) - f.layout.values(&truth)).collect();
        let names = found[0].layout.names();
        let mean = |f: &dyn Fn(usize) -> f64| (0..found.len()).map(f).sum::<f64>() / found.len() as f64;
        let (mut ratio, mut coverage) = (Vec::new(), Vec::new());
        for (k, _) in names.iter().enumerate() {
            let claimed = |j: usize| found[j].covariance[(k, k)];
            let width = |j: usize| stopping::factor(0.95, Some(found[j].dof), 1) * claimed(j).sqrt();
            let bias = mean(&|j| errors[j][k]);
            ratio.push((mean(&claimed) / mean(&|j| (errors[j][k] - bias).powi(2))).sqrt());
            coverage.push(mean(&|j| f64::from(u8::from(errors[j][k].abs() <= width(j)))));
        }
        Outcome { names, ratio, coverage }
    }

    fn report(&self, count: u64) -> Outcome {
        let outcome = self.runs(count);
        println!("{} {:?}, {:?}, {count} runs", self.model.name(), self.driving, self.assumed);
        for (k, name) in outcome.names.iter().enumerate() {
            println!("  {name}: sigma over scatter {:.3}, coverage {:.3}", outcome.ratio[k], outcome.coverage[k]);
        }
        outcome
    }
}

/// Covariance of a motion by steering errors that are one number a block.
fn blocks(vehicle: &Vehicle, steps: &[Step], length: f64, steering: f64) -> Matrix3<f64> {
    const H: f64 = 1e-5;
    let total: f64 = steps.iter().map(|s| s.duration).sum();
    let count = (total / length).round().max(1.0);
    let mut sum = Matrix3::zeros();
    for block in 0..count as usize {
        let bent = |by: f64| {
            let mut at = 0.0;
            let bend = |s: &Step| {
                let own = ((at / total * count) as usize).min(count as usize - 1);
                at += s.duration;
                let mut s = *s;
                s.input.y += if own == block { by } else { 0.0 };
                s
            };
            prediction::motion(vehicle, &steps.iter().map(bend).collect::<Vec<_>>())
        };
        let by = bent(H).minus(&bent(-H)) / (2.0 * H) * steering;
        sum += by * by.transpose();
    }
    sum
}

fn cell(model: Model, driving: Driving) -> Cell {
    Cell { model, driving, assumed: Assumed::Process, noise: Noise::default_of_notes() }
}

#[test]
fn intervals_cover_for_arcs_with_quantised_encoders() {
    for model in [Model::Tricycle, Model::Differential] {
        let outcome = cell(model, Driving::Arcs(24)).report(200);
        assert!(outcome.coverage.iter().all(|c| (0.88..=0.99).contains(c)), "{:?}", outcome.coverage);
        assert!(outcome.ratio.iter().all(|r| (0.8..=1.3).contains(r)), "{:?}", outcome.ratio);
    }
}

#[test]
#[ignore = "1000 runs a cell"]
fn intervals_cover_whatever_is_driven() {
    for model in Model::ALL {
        for driving in [Driving::Arcs(16), Driving::Arcs(24), Driving::Arcs(80), Driving::On(60.0), Driving::On(240.0)]
        {
            let outcome = cell(model, driving).report(1000);
            assert!(outcome.coverage.iter().all(|c| (0.9..=0.99).contains(c)), "{:?}", outcome.coverage);
        }
    }
}

#[test]
#[ignore = "1000 runs a cell"]
fn a_steering_error_is_neither_constant_nor_in_blocks() {
    for (model, driving) in [
        (Model::Tricycle, Driving::Arcs(16)),
        (Model::TricycleAsymmetric, Driving::Arcs(16)),
        (Model::Tricycle, Driving::On(60.0)),
    ] {
        for assumed in [Assumed::Constant, Assumed::Blocks, Assumed::Process] {
            Cell { assumed, ..cell(model, driving) }.report(1000);
        }
    }
}

/// The claimed covariance of a motion, and of it with the next, against drives that were drawn.
#[test]
fn the_noise_of_the_wheels_is_what_it_scatters() {
    for (vehicle, path) in [(bent(), 9.0), (bent(), -9.0), (tricycle(false), 9.0), (differential(), 5.0)] {
        let arc = drives::Arc { steering: 0.5, path };
        let (log, spans) = stop_and_go(&vehicle, &[arc]);
        let noise = WheelNoise { slip: 1e-3, steering: 1e-3, memory: 2.0 };
        let drawn =
            Noise { place: 0.0, heading: 0.0, slip: noise.slip, steering: noise.steering, memory: noise.memory };
        let exact = drives::exact(&vehicle, &log, &spans);
        let segments = Segments::new(&log, &exact, 0.0);
        let claimed = WheelProcess::new(&vehicle, segments.steps(0), &noise).marginal(&noise);
        let coarse = [Step { duration: 9.0, ..sum(segments.steps(0), &vehicle) }];
        let at_once = WheelProcess::new(&vehicle, &coarse, &noise).marginal(&noise);
        let mut random = Random::new(1);
        let mut scatter = Matrix3::zeros();
        let count = 4000;
        for _ in 0..count {
            let moved = drives::exact(&vehicle, &done(&vehicle, &log, &drawn, &mut random), &spans)[0].motion;
            let error: Vector3<f64> = moved.minus(&exact[0].motion);
            scatter += error * error.transpose() / f64::from(count);
        }
        let unit = scatter.diagonal().map(|v| 1.0 / v.sqrt());
        let compare = |c: &Matrix3<f64>| (c - scatter).component_mul(&(unit * unit.transpose())).amax();
        assert!(compare(&claimed) < 0.08, "{claimed} {scatter}");
        if matches!(vehicle.drive, Drive::Tricycle(_)) {
            assert!(compare(&at_once) < 0.1, "{at_once} {scatter}");
        }
    }
}

/// A tricycle whose steering is mounted far off, and not the same way forward and backward.
fn bent() -> Vehicle {
    let mut vehicle = tricycle(true);
    if let Drive::Tricycle(t) = &mut vehicle.drive {
        (t.offset_forward, t.offset_backward) = (0.4, -0.9);
    }
    vehicle
}

/// All steps as one of constant steering.
fn sum(steps: &[Step], vehicle: &Vehicle) -> Step {
    let mut total = steps[0];
    for s in &steps[1..] {
        total.input.x += s.input.x;
        if matches!(vehicle.drive, Drive::Differential(_)) {
            total.input.y += s.input.y;
        }
    }
    total
}

//! The estimate scatters as the Cramer-Rao bound says, and its intervals cover, with and without outliers.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{Noise, Random, cdeg, grid, noisy, spoil, stop_and_go, tricycle};
use groma_calibration::vehicle::parameters::{OFFSET_BACKWARD, OFFSET_FORWARD};
use groma_calibration::vehicle::{
    Calibration, Model, Options, Request, Segments, Vehicle, calibrate, prediction, stopping,
};
use groma_models::{Token, WheelNoise};
use nalgebra::{DMatrix, DVector};

/// Errors of many runs with what they claimed.
struct Runs {
    errors: Vec<DVector<f64>>,
    found: Vec<Calibration>,
}

struct Setting<'a> {
    vehicle: Vehicle,
    model: Model,
    free: &'a [&'a str],
    count: usize,
    outliers: f64,
    options: Options,
}

impl Setting<'_> {
    fn request(&self) -> Request<'_> {
        let (model, wheelbase) = (Some(self.model), Some(drives::WHEELBASE));
        Request { model, wheelbase, free: self.free, ..Request::default() }
    }

    fn error(&self, found: &Calibration) -> DVector<f64> {
        found.layout.values(&found.vehicle.to_full()) - found.layout.values(&self.vehicle.to_full())
    }

    fn runs(&self, runs: u64) -> Runs {
        let (log, spans) = stop_and_go(&self.vehicle, &grid(self.count, 18.0, 50.0, 180.0));
        let request = self.request();
        let (mut errors, mut found) = (Vec::new(), Vec::new());
        for seed in 0..runs {
            let mut random = Random::new(seed);
            let mut motions = noisy(&self.vehicle, &log, &spans, &Noise::default_of_notes(), &mut random);
            spoil(&mut motions, self.outliers, &mut random);
            let one = calibrate(&log, &motions, &request, &self.options, &Token::new()).unwrap();
            errors.push(self.error(&one));
            found.push(one);
        }
        Runs { errors, found }
    }
}

impl Runs {
    fn scatter(&self) -> DMatrix<f64> {
        let n = self.errors[0].len();
        let sum = self.errors.iter().fold(DMatrix::zeros(n, n), |sum, e| sum + e * e.transpose());
        sum / self.errors.len() as f64
    }

    fn sigmas(&self) -> DVector<f64> {
        self.scatter().diagonal().map(f64::sqrt)
    }

    /// Share of 95 % intervals that hold the truth, by parameter.
    fn coverage(&self) -> DVector<f64> {
        let mut inside = DVector::zeros(self.errors[0].len());
        for (error, found) in self.errors.iter().zip(&self.found) {
            let factor = stopping::factor(0.95, Some(found.dof), 1);
            for k in 0..error.len() {
                inside[k] += f64::from(u8::from(error[k].abs() <= factor * found.covariance[(k, k)].sqrt()));
            }
        }
        inside / self.errors.len() as f64
    }

    fn mean_covariance(&self) -> DMatrix<f64> {
        let n = self.errors[0].len();
        self.found.iter().fold(DMatrix::zeros(n, n), |sum, f| sum + &f.covariance) / self.found.len() as f64
    }
}

fn quiet(options: Options) -> Options {
    Options { folds: 0, ..options }
}

fn known_noise() -> Options {
    quiet(Options { robust: false, noise_known: true, ..Options::default() })
}

fn symmetric(count: usize, options: Options) -> Setting<'static> {
    Setting { vehicle: tricycle(false), model: Model::Tricycle, free: &[], count, outliers: 0.0, options }
}

fn report(name: &str, runs: &Runs) {
    let ratio = runs.scatter().diagonal().component_div(&runs.mean_covariance().diagonal());
    println!("{name}: {:?}", runs.found[0].layout.names());
    println!("  sigma {:?}", runs.sigmas().as_slice());
    println!("  variance over claimed {:.3?}", ratio.as_slice());
    println!("  coverage {:.3?}", runs.coverage().as_slice());
}

/// Variance over the bound: the covariance with known noise is the inverse of the Fisher information.
fn reaches_the_bound(setting: &Setting<'_>, runs: u64, band: f64) {
    let runs = setting.runs(runs);
    report("known noise", &runs);
    let ratio = runs.scatter().diagonal().component_div(&runs.mean_covariance().diagonal());
    assert!(ratio.iter().all(|r| (r - 1.0).abs() < band), "{ratio}");
}

#[test]
fn variance_is_that_of_the_bound() {
    reaches_the_bound(&symmetric(4, known_noise()), 500, 0.2);
}

#[test]
#[ignore = "5000 runs each"]
fn variance_is_that_of_the_bound_for_every_model() {
    for (asymmetric, model) in [(false, Model::Tricycle), (true, Model::TricycleAsymmetric)] {
        for free in [&[][..], &["wheelbase"], &["wheelbase", "gain"]] {
            let setting = Setting { vehicle: tricycle(asymmetric), model, free, ..symmetric(6, known_noise()) };
            reaches_the_bound(&setting, 5000, 0.1);
        }
    }
}

/// The row of the notes: 16 arcs, 18 to 50 deg, half turns, a steering error that is constant over an arc and another one on
/// the next: part of the stated covariance here.
#[test]
fn sixteen_arcs_give_the_sigmas_of_the_notes() {
    let setting =
        symmetric(4, Options { noise: WheelNoise { steering: 0.0, ..WheelNoise::default() }, ..known_noise() });
    let (log, spans) = stop_and_go(&setting.vehicle, &grid(4, 18.0, 50.0, 180.0));
    let (noise, request) = (Noise::default_of_notes(), setting.request());
    let mut errors = Vec::new();
    for seed in 0..1000 {
        let mut random = Random::new(seed);
        let straight = Noise { steering: 0.0, ..noise };
        let mut motions = noisy(&setting.vehicle, &log, &spans, &straight, &mut random);
        let segments = Segments::new(&log, &motions.motions, 0.0);
        for (k, m) in motions.motions.iter_mut().enumerate() {
            let by = prediction::predict(&setting.vehicle, segments.steps(k)).jacobian;
            let bent = (by.column(OFFSET_FORWARD) + by.column(OFFSET_BACKWARD)) * noise.steering;
            let error = bent * random.normal();
            (m.motion, m.turn) = (m.motion.plus(error), m.turn + error.z);
            motions.covariances.as_mut().unwrap()[k] += bent * bent.transpose();
        }
        let found = calibrate(&log, &motions, &request, &setting.options, &Token::new()).unwrap();
        errors.push(setting.error(&found));
    }
    let sigmas = Runs { errors, found: vec![] }.sigmas();
    let notes = [cdeg(0.58), 1.9e-8, 0.29e-3, 0.32e-3, cdeg(0.62)];
    println!("sigmas {sigmas}");
    for (got, expected) in sigmas.iter().zip(notes) {
        assert!((got / expected - 1.0).abs() < 0.1, "{got} {expected}");
    }
}

fn covers(name: &str, setting: &Setting<'_>, runs: u64, band: (f64, f64)) {
    let runs = setting.runs(runs);
    report(name, &runs);
    assert!(runs.coverage().iter().all(|c| *c >= band.0 && *c <= band.1), "{name}: {}", runs.coverage());
}

#[test]
fn intervals_cover_with_and_without_outliers() {
    let robust = quiet(Options::default());
    for (count, outliers) in [(6, 0.0), (6, 0.03)] {
        let setting = Setting { outliers, ..symmetric(count, robust) };
        covers(&format!("robust, {} arcs, outliers {outliers}", 4 * count), &setting, 400, (0.91, 0.985));
    }
    covers("scaled, 16 arcs", &symmetric(4, quiet(Options { robust: false, ..robust })), 400, (0.91, 0.985));
}

#[test]
#[ignore = "4000 runs each"]
fn intervals_cover_for_every_model() {
    let robust = quiet(Options::default());
    for (asymmetric, model) in [(false, Model::Tricycle), (true, Model::TricycleAsymmetric)] {
        for (count, outliers) in [(4, 0.0), (4, 0.03), (6, 0.0), (6, 0.03), (20, 0.0), (20, 0.03)] {
            for free in [&[][..], &["wheelbase"]] {
                let setting =
                    Setting { vehicle: tricycle(asymmetric), model, free, outliers, ..symmetric(count, robust) };
                covers(
                    &format!("{} {free:?}, {} arcs, outliers {outliers}", model.name(), 4 * count),
                    &setting,
                    4000,
                    (0.92, 0.98),
                );
            }
        }
    }
}

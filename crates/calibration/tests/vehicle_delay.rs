//! A delay between wheels and scanner, from driving on without stops, beside all that the notes simulate: rounded counts,
//! a steering error with memory, slip, scan poses with errors of their own.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{Noise, Random, between_scans, driving_on, quantised, tricycle, windows};
use groma_calibration::vehicle::{
    Calibration, Model, Motions, Options, Request, Segments, Vehicle, calibrate, prediction, stopping,
};
use groma_geometry::Se2;
use groma_models::{Drive, Token, Tricycle, WheelLog};

const DELAY: f64 = 0.03;

fn vehicle() -> Vehicle {
    let mut vehicle = tricycle(true);
    let Drive::Tricycle(t) = vehicle.drive else { return vehicle };
    vehicle.drive = Drive::Tricycle(Tricycle { gain: 1.003, ..t });
    vehicle.delay = DELAY;
    vehicle
}

/// Readings of the drive as encoders give them, and the motions between its scans.
fn data(vehicle: &Vehicle, seconds: f64, random: &mut Random) -> (WheelLog, Motions) {
    let noise = Noise::default_of_notes();
    let clean = driving_on(vehicle, seconds, random);
    let done = drives::done(vehicle, &clean, &noise, random);
    let motions = between_scans(vehicle, &done, &windows(&done, 1.0, 0.3), &noise, random);
    (quantised(&clean, 1.0, std::f64::consts::TAU / 16384.0), motions)
}

fn run(seed: u64, seconds: f64, options: &Options) -> Calibration {
    let (vehicle, mut random) = (vehicle(), Random::new(seed));
    let (seen, motions) = data(&vehicle, seconds, &mut random);
    let request = Request {
        model: Some(Model::TricycleAsymmetric),
        wheelbase: Some(drives::WHEELBASE),
        free: &["wheelbase", "gain", "delay"],
        ..Request::default()
    };
    calibrate(&seen, &motions, &request, options, &Token::new()).unwrap()
}

fn runs(count: u64, seconds: f64, options: &Options) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let truth = vehicle().to_full();
    let found: Vec<Calibration> = (0..count).map(|seed| run(seed, seconds, options)).collect();
    let layout = &found[0].layout;
    let (n, mut rmse, mut cover, mut claimed) = (layout.len(), vec![], vec![], vec![]);
    for k in 0..n {
        let errors: Vec<f64> =
            found.iter().map(|f| (layout.values(&f.vehicle.to_full()) - layout.values(&truth))[k]).collect();
        let sigmas: Vec<f64> = found.iter().map(|f| f.covariance[(k, k)].sqrt()).collect();
        let inside = |(e, f): (&f64, &Calibration)| {
            e.abs() <= stopping::factor(0.95, Some(f.dof), 1) * f.covariance[(k, k)].sqrt()
        };
        rmse.push((errors.iter().map(|e| e * e).sum::<f64>() / count as f64).sqrt());
        claimed.push(sigmas.iter().sum::<f64>() / count as f64);
        cover.push(errors.iter().zip(&found).filter(|&(e, f)| inside((e, f))).count() as f64 / count as f64);
    }
    println!("{seconds} s, {count} runs, lags {:?}", found.iter().take(5).map(|f| f.correlated).collect::<Vec<_>>());
    for (k, name) in layout.names().iter().enumerate() {
        println!("  {name}: rmse {:.3e}, claimed {:.3e}, coverage {:.3}", rmse[k], claimed[k], cover[k]);
    }
    (rmse, claimed, cover)
}

fn quick() -> Options {
    Options { folds: 0, ..Options::default() }
}

#[test]
fn a_delay_comes_out_of_a_minute() {
    let (rmse, ..) = runs(6, 60.0, &quick());
    assert!(*rmse.last().unwrap() < 1e-3, "{rmse:?}");
}

#[test]
#[ignore = "60 runs of one to two minutes"]
fn driving_on_covers() {
    for (robust, seconds) in [(true, 60.0), (false, 60.0), (true, 120.0), (true, 240.0)] {
        let (rmse, _, cover) = runs(60, seconds, &Options { robust, ..quick() });
        assert!(*rmse.last().unwrap() < 1e-3, "{rmse:?}");
        assert!(cover.iter().all(|c| *c >= 0.78), "{cover:?}");
    }
}

#[test]
fn segments_beyond_the_log_say_nothing() {
    let vehicle = vehicle();
    let log = driving_on(&vehicle, 10.0, &mut Random::new(1));
    let mut motions = drives::exact(&vehicle, &log, &windows(&log, 1.0, 0.3));
    motions[0].start = -5.0;
    let segments = Segments::new(&log, &motions, 0.0);
    assert!(segments.steps(0).is_empty() && !segments.steps(1).is_empty());
    assert!(prediction::motion(&vehicle, segments.steps(0)).minus(&Se2::IDENTITY).norm() < 1e-15);
}

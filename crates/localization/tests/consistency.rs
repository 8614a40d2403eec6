//! The filter against many drives: errors as large as it says, in static, mixed and dynamic maps and in EKF-SLAM.
//!
//! NEES of 3 degrees of freedom; the mean of R independent runs at one time is chi-square with 3 R degrees of freedom over
//! R (Bar-Shalom, Li, Kirubarajan, "Estimation with applications to tracking and navigation", 2001, 5.4.2).

#![allow(clippy::unwrap_used)] // helpers of tests may fail loudly

mod drive;

use drive::{Draw, Hall, Wheels, nees, step};
use groma_estimation::chi_square::quantile;
use groma_geometry::Se2;
use groma_localization::{Localizer, Mode, Options, Start, Status};
use groma_models::{LandmarkKind, LandmarkMap};
use nalgebra::{Matrix3, Vector3};

const RATE: f64 = 20.0;

struct Outcome {
    nees: Vec<f64>,
    position_sq: f64,
    wrong: usize,
    right: usize,
    lost: bool,
}

/// One drive of `scans` scans.
fn run(seed: u64, hall: &Hall, mode: Mode, scans: usize, calibrated: bool) -> Outcome {
    let mut draw = Draw::new(seed);
    let (wheels, mount_error) =
        if calibrated { Wheels::calibrated(&mut draw) } else { (Wheels::good(), Se2::IDENTITY) };
    let mount = Se2::new(0.4, 0.0, 0.1);
    let kept = |kind: LandmarkKind| mode != Mode::Mixed || kind == LandmarkKind::Reflector;
    let map =
        if mode == Mode::Dynamic || mode == Mode::Slam { LandmarkMap::default() } else { hall.survey(&mut draw, kept) };
    let on_map: Vec<usize> = (0..hall.places.len()).filter(|k| kept(hall.places[*k].0)).collect();
    let p0 = Matrix3::from_diagonal(&Vector3::new(2.5e-5, 2.5e-5, 1e-5));
    let mut truth = Se2::new(14.0, 8.0, 0.3);
    let start = truth * Se2::exp(draw.of(&p0)).inverse();
    let setup = Start { stamp: 0.0, pose: Some((start, p0)), mount, calibration: wheels.calibration };
    let mut localizer = Localizer::new(map.clone(), &setup, Options { mode, ..Options::default() }).unwrap();
    let mut outcome = Outcome { nees: Vec::new(), position_sq: 0.0, wrong: 0, right: 0, lost: false };
    for k in 1..=scans {
        let (path, turn) = step(k, RATE, 1.0);
        let stamp = k as f64 / RATE;
        let motion = wheels.say(path, turn, &mut draw);
        truth = truth * Se2::exp(Vector3::new(path, 0.0, turn));
        localizer.predict(stamp, &motion).unwrap();
        let seen = hall.look(&(truth * mount * mount_error), stamp, &mut draw);
        let observations: Vec<_> = seen.iter().map(|(_, o)| *o).collect();
        let sees = |polar: nalgebra::Vector2<f64>| polar.x < hall.reach;
        let update = localizer.update(&observations, Some(&sees));
        for m in update.matches.iter().filter(|m| m.landmark < map.landmarks.len()) {
            let right = seen[m.observation].0 == Some(on_map[m.landmark]);
            outcome.right += usize::from(right);
            outcome.wrong += usize::from(!right);
        }
        outcome.nees.push(nees(&truth, &localizer.pose(), &localizer.covariance()));
        outcome.position_sq += (truth.translation - localizer.pose().translation).norm_squared() / scans as f64;
        outcome.lost |= update.quality.status == Status::Lost;
    }
    outcome
}

/// Prints and returns the mean NEES over runs at ten times, and the 95 % band of one such mean.
#[allow(clippy::print_stdout)] // the figures
fn study(runs: u64, hall: &Hall, mode: Mode, scans: usize, calibrated: bool) -> (Vec<f64>, (f64, f64), f64, f64) {
    let outcomes: Vec<Outcome> = (0..runs).map(|seed| run(seed, hall, mode, scans, calibrated)).collect();
    assert!(outcomes.iter().all(|o| !o.lost), "a run was lost");
    let at: Vec<usize> = (1..=10).map(|k| k * scans / 10 - 1).collect();
    let mean = |k: &usize| outcomes.iter().map(|o| o.nees[*k]).sum::<f64>() / runs as f64;
    let dof = 3 * runs as usize;
    let band = (quantile(0.025, dof) / runs as f64, quantile(0.975, dof) / runs as f64);
    let rmse = (outcomes.iter().map(|o| o.position_sq).sum::<f64>() / runs as f64).sqrt();
    let (right, wrong) = outcomes.iter().fold((0, 0), |(r, w), o| (r + o.right, w + o.wrong));
    let means: Vec<f64> = at.iter().map(mean).collect();
    println!(
        "{mode:?} calibrated {calibrated}: NEES {means:.2?}, band {band:.2?}, RMSE {:.1} mm, wrong pairings {:.5}",
        1e3 * rmse,
        wrong as f64 / (right + wrong).max(1) as f64
    );
    (means, band, rmse, wrong as f64 / (right + wrong).max(1) as f64)
}

/// The mean over all times must lie in the band of one; of ten single times one may be outside.
fn assert_inside(means: &[f64], (low, high): (f64, f64)) {
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    assert!(mean > low && mean < high, "{mean} not in {low}..{high}: {means:?}");
    let outside = means.iter().filter(|m| **m < low || **m > high).count();
    assert!(outside <= 1, "{outside} of {} outside {low}..{high}: {means:?}", means.len());
}

fn hall() -> Hall {
    Hall::new(1, 70, 12, 30.0, 0.6)
}

#[test]
fn static_map_errors_are_as_large_as_said() {
    let (means, band, _, wrong) = study(30, &hall(), Mode::Static, 300, false);
    assert_inside(&means, band);
    assert!(wrong < 0.002, "{wrong}");
}

#[test]
#[ignore = "statistics: minutes"]
fn static_map_errors_are_as_large_as_said_over_100_runs() {
    let (means, band, ..) = study(100, &hall(), Mode::Static, 1200, false);
    assert_inside(&means, band);
    let (means, band, ..) = study(100, &hall(), Mode::Static, 1200, true);
    assert_inside(&means, band);
}

#[test]
fn mixed_map_errors_are_as_large_as_said() {
    let (means, band, ..) = study(20, &hall(), Mode::Mixed, 200, false);
    assert_inside(&means, band);
}

#[test]
#[ignore = "statistics: minutes"]
fn mixed_map_errors_are_as_large_as_said_over_100_runs() {
    let (means, band, ..) = study(100, &hall(), Mode::Mixed, 600, false);
    assert_inside(&means, band);
}

#[test]
#[ignore = "statistics: minutes"]
fn dynamic_map_and_slam_over_100_runs() {
    let (dynamic, ..) = study(100, &hall(), Mode::Dynamic, 200, false);
    let (slam, ..) = study(30, &hall(), Mode::Slam, 200, false);
    assert!(dynamic.iter().chain(&slam).all(|m| *m < 6.0));
}

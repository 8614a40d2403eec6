//! Times the closed forms of 1000 motions and the likelihood of 4400:
//! `cargo bench -p groma-benches --bench vehicle`.

#![allow(clippy::disallowed_methods, clippy::print_stdout, clippy::unwrap_used, reason = "a bench measures and prints")]

#[path = "../../calibration/tests/drives/mod.rs"]
mod drives;

use drives::{Noise, Random, differential, driving_on, noisy, tricycle, windows};
use groma_calibration::vehicle::hand_eye::Form;
use groma_calibration::vehicle::robust::Problem;
use groma_calibration::vehicle::start::{Known, Weights, closed_form};
use groma_calibration::vehicle::{Layout, Model, Motions, Options, Request, Segments, Vehicle, calibrate};
use groma_models::{Token, WheelLog};
use std::time::{Duration, Instant};

fn best(times: usize, mut run: impl FnMut()) -> Duration {
    let one = |()| {
        let begun = Instant::now();
        run();
        begun.elapsed()
    };
    std::iter::repeat_n((), times).map(one).min().unwrap()
}

/// A drive whose log has a reading at the ends of every motion only: one step a motion.
fn data(vehicle: &Vehicle, count: usize) -> (WheelLog, Motions) {
    let mut random = Random::new(1);
    let fine = driving_on(vehicle, count as f64 * 0.8 + 1.0, &mut random);
    let every = (0..fine.time().len()).step_by(40);
    let (time, readings) = every.map(|k| (fine.time()[k], fine.reading(k))).unzip();
    let log = WheelLog::new(fine.kind(), time, readings).unwrap();
    let spans: Vec<_> = windows(&log, 0.8, 0.0).into_iter().take(count).collect();
    let motions = noisy(vehicle, &log, &spans, &Noise::default_of_notes(), &mut random);
    (log, motions)
}

fn main() {
    for (name, vehicle, model) in [
        ("differential", differential(), Model::Differential),
        ("tricycle", tricycle(false), Model::Tricycle),
        ("tricycle-asymmetric", tricycle(true), Model::TricycleAsymmetric),
    ] {
        let (log, motions) = data(&vehicle, 1000);
        let segments = Segments::new(&log, &motions.motions, 0.0);
        let weights = vec![Weights::UNIT; motions.motions.len()];
        let all: Vec<usize> = (0..motions.motions.len()).collect();
        let known = Known { model, wheelbase: Some(drives::WHEELBASE), gain: 1.0, delay: 0.0 };
        let closed = best(400, || {
            std::hint::black_box(closed_form(&known, &segments, &motions.motions, &weights, &all, Form::Wheels));
        });
        let (log, mut motions) = data(&vehicle, 4400);
        motions.covariances = None; // As the tuples of Censi et al.: one covariance is estimated for all.
        let layout = Layout::new(model, &[]).unwrap();
        for robust in [false, true] {
            let options = Options { robust, folds: 0, ..Options::default() };
            let problem =
                Problem { log: &log, motions: &motions, layout: &layout, options: &options, token: &Token::new() };
            let start = problem.estimate(vehicle).unwrap();
            let mut off = start.vehicle;
            off.laser =
                groma_geometry::Se2::new(off.laser.x() + 0.003, off.laser.y() - 0.003, off.laser.theta() + 0.002);
            let likelihood = best(10, || {
                std::hint::black_box(problem.estimate(off).unwrap());
            });
            let request = Request { model: Some(model), wheelbase: Some(drives::WHEELBASE), ..Request::default() };
            let whole = best(3, || {
                std::hint::black_box(calibrate(&log, &motions, &request, &options, &Token::new()).unwrap());
            });
            println!(
                "{name}, robust {robust}: closed form of 1000 {closed:?}, likelihood of 4400 {likelihood:?}, {} turns, with tests {whole:?}",
                start.turns
            );
        }
    }
}

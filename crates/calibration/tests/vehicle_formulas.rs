//! Derivatives against differences, the closed form against the Lagrange problem that it replaces.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{Noise, Random, differential, driving_on, exact, noisy, stop_and_go, tricycle, windows};
use groma_calibration::vehicle::hand_eye::{self, Form, Pair};
use groma_calibration::vehicle::parameters::FULL;
use groma_calibration::vehicle::{Segments, Vehicle, prediction};
use groma_models::{WheelKind, WheelLog};
use nalgebra::{Complex, Matrix2x5, Matrix5, SymmetricEigen, Vector3, Vector5};

fn moved(vehicle: &Vehicle, k: usize, by: f64) -> Vehicle {
    let mut x = vehicle.to_full();
    x[k] += by;
    vehicle.with_full(&x)
}

#[test]
fn derivatives_of_prediction_and_residual_equal_differences() {
    for mut vehicle in [tricycle(true), differential()] {
        vehicle.delay = 0.013;
        let log = driving_on(&vehicle, 20.0, &mut Random::new(7));
        let motions = exact(&vehicle, &log, &windows(&log, 1.37, 0.3));
        let segments = Segments::new(&log, &motions, vehicle.delay);
        for (k, m) in motions.iter().enumerate() {
            let measured = m.motion.plus(Vector3::new(0.05, -0.03, 0.04));
            let predicted = prediction::predict(&vehicle, segments.steps(k));
            let residual = prediction::residual(&measured, &predicted.motion);
            let design = prediction::design(&predicted, &residual);
            for p in 0..FULL {
                let h = 1e-6 * vehicle.to_full()[p].abs().max(1e-3);
                let at = |by: f64| {
                    let other = moved(&vehicle, p, by);
                    let steps = Segments::new(&log, &motions, other.delay);
                    prediction::residual(&measured, &prediction::motion(&other, steps.steps(k)))
                };
                let numeric = -(at(h) - at(-h)) / (2.0 * h);
                let error = (numeric - design.column(p)).norm();
                assert!(
                    error < 1e-5 * (1.0 + numeric.norm()),
                    "motion {k}, number {p}: {numeric} {}",
                    design.column(p)
                );
            }
        }
    }
}

/// `min |M x|` with `|(x_4, x_5)| = 1`, x = (size, place, heading): a quadratic for the multiplier by elimination of the
/// three free unknowns, as Censi et al. solve it.
fn lagrange(pairs: &[Pair]) -> Vector5<f64> {
    let row = |p: &Pair| {
        let (o, a, s) = (p.base, p.lever, p.laser);
        Matrix2x5::new(o.re, a.re, -a.im, -s.re, s.im, o.im, a.im, a.re, -s.im, -s.re) * p.weight.sqrt()
    };
    let m: Matrix5<f64> = pairs.iter().map(|p| row(p).tr_mul(&row(p))).sum();
    let (free, cross, bound) = (m.fixed_view::<3, 3>(0, 0), m.fixed_view::<3, 2>(0, 3), m.fixed_view::<2, 2>(3, 3));
    let eliminated = free.try_inverse().unwrap() * cross;
    let eigen = SymmetricEigen::new(bound - cross.tr_mul(&eliminated));
    let z = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let others = -(eliminated * z);
    let x = Vector5::new(others.x, others.y, others.z, z.x, z.y);
    if others.x > 0.0 { x } else { -x }
}

#[test]
fn hand_eye_solves_the_problem_with_its_multiplier() {
    for seed in 0..20 {
        let vehicle = if seed % 2 == 0 { tricycle(false) } else { differential() };
        let mut random = Random::new(seed);
        let (log, spans) = stop_and_go(&vehicle, &drives::grid(4, 18.0, 50.0, 40.0 + 8.0 * seed as f64));
        let motions =
            noisy(&vehicle, &log, &spans, &Noise { place: 0.02, ..Noise::default_of_notes() }, &mut random).motions;
        let segments = Segments::new(&log, &motions, 0.0);
        for form in [Form::Wheels, Form::Centres] {
            let pair = |k: usize| {
                let weight = 1.0 + (k % 3) as f64;
                Pair::new(&vehicle.drive, segments.steps(k), &motions[k].motion, motions[k].turn, form, weight)
            };
            let pairs: Vec<Pair> = (0..motions.len()).map(pair).collect();
            let (ours, oracle) = (hand_eye::solve(pairs.iter().copied(), true).unwrap(), lagrange(&pairs));
            let place = Complex::new(oracle[1], oracle[2]);
            let heading = Complex::new(oracle[3], oracle[4]);
            assert!((ours.size - oracle[0]).abs() < 1e-10 && (ours.place - place).norm() < 1e-10);
            assert!((ours.heading - heading).norm() < 1e-10);
        }
    }
}

/// A plain integration of many small straight steps, with steering interpolated in time, comes to the same motion.
#[test]
fn windows_of_a_log_equal_fine_integration() {
    let vehicle = tricycle(true);
    let log = driving_on(&vehicle, 30.0, &mut Random::new(5));
    let motions = exact(&vehicle, &log, &windows(&log, 1.3, 0.3));
    for m in &motions {
        let fine = finely(&vehicle, &log, m.start, m.end);
        assert!(fine.minus(&m.motion).norm() < 2e-4, "{}", fine.minus(&m.motion));
    }
}

fn finely(vehicle: &Vehicle, log: &WheelLog, start: f64, end: f64) -> groma_geometry::Se2 {
    const STEP: f64 = 1e-4;
    assert_eq!(log.kind(), WheelKind::Steered);
    let (mut x, mut y, mut heading) = (0.0, 0.0, 0.0_f64);
    let count = ((end - start) / STEP).round() as usize;
    let at = |k: usize| start + (end - start) * k as f64 / count as f64;
    for k in 0..count {
        for step in log.steps(at(k), at(k + 1)).unwrap() {
            let u = vehicle.drive.path_and_turn(step.input);
            (x, y) = (x + u.x * (heading + u.y / 2.0).cos(), y + u.x * (heading + u.y / 2.0).sin());
            heading += u.y;
        }
    }
    vehicle.laser.inverse() * groma_geometry::Se2::new(x, y, heading) * vehicle.laser
}

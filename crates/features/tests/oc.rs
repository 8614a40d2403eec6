//! Orthogonal corners in rooms whose corners are known.

use groma_estimation::random::SplitMix64;
use groma_features::Keypoint;
use groma_features::oc::{Detector, Options, detect_all};
use groma_models::BeamGeometry;
use nalgebra::{Rotation2, Vector2};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const STEP: f64 = TAU / 720.0;

fn geometry(angle_min: f64, angle_increment: f64) -> BeamGeometry {
    BeamGeometry { angle_min, angle_increment, time_increment: 0.0, range_min: 0.05, range_max: 20.0 }
}

fn detect(geometry: BeamGeometry, ranges: &[f64]) -> Vec<Keypoint> {
    let mut keypoints = Vec::new();
    Detector::new(geometry, ranges.len(), Options::default()).detect(ranges, &mut keypoints);
    keypoints
}

/// Corners of a room of 7 x 5 m, not centred, about its own axes.
fn corners() -> [Vector2<f64>; 4] {
    [(4.0, 3.0), (-3.0, 3.0), (-3.0, -2.0), (4.0, -2.0)].map(|(x, y)| Vector2::new(x, y))
}

/// A scan from the origin of the room turned by `turn`, from bearing `angle_min` on, with noise.
fn room(angle_min: f64, turn: f64, sigma: f64, seed: u64) -> Vec<f64> {
    let mut draw = SplitMix64::new(seed);
    let mut reading = |i: usize| {
        let (sin, cos) = (angle_min + i as f64 * STEP - turn).sin_cos();
        let (ahead, aside) = (if cos > 0.0 { 4.0 } else { -3.0 } / cos, if sin > 0.0 { 3.0 } else { -2.0 } / sin);
        ahead.min(aside) + sigma * draw.normal()
    };
    (0..720).map(&mut reading).collect()
}

#[test]
fn finds_the_corners_and_nothing_else() {
    for (k, sigma) in [(0, 0.0), (1, 0.005), (2, 0.01), (3, 0.01), (4, 0.01)] {
        let turn = 0.37 * f64::from(k);
        let found = detect(geometry(-1.0, STEP), &room(-1.0, turn, sigma, k as u64));
        assert_eq!(found.len(), 4, "{found:?}");
        for corner in corners().map(|c| Rotation2::new(turn) * c) {
            let keypoint = found.iter().find(|k| (k.point - corner).norm() < 0.04).unwrap();
            let local = Rotation2::new(-turn) * corner;
            let opening = (-local.y.signum()).atan2(-local.x.signum());
            assert!((keypoint.orientation - turn - opening).sin().abs() < 0.02, "{keypoint:?}");
            assert!((keypoint.orientation - turn - opening).cos() > 0.9);
        }
    }
}

/// Mean squared Mahalanobis error: 2 for a covariance that is right. Noise of a fifth of the width of the arms makes a
/// false corner now and then.
#[test]
fn covariance_covers() {
    let (mut errors, mut strays) = (Vec::new(), 0);
    for seed in 0..200 {
        let (turn, sigma) = (0.031 * seed as f64, 0.01);
        for keypoint in detect(geometry(0.0, STEP), &room(0.0, turn, sigma, seed)) {
            let near = corners().map(|c| Rotation2::new(turn) * c - keypoint.point);
            let error = near.into_iter().min_by(|s, t| s.norm().total_cmp(&t.norm())).unwrap();
            if error.norm() < 0.1 {
                errors.push(error.dot(&(keypoint.covariance.try_inverse().unwrap() * error)));
            } else {
                strays += 1;
            }
        }
    }
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    assert!(errors.len() > 780 && (1.0..3.0).contains(&mean) && strays < 20, "{} {mean} {strays}", errors.len());
}

proptest! {
    #[test]
    fn turning_the_scanner_turns_the_keypoints(angle in -20.0..20.0_f64, turn in 0.0..TAU, seed in 0_u64..1000) {
        let ranges = room(0.0, turn, 0.02, seed);
        let (before, after) = (detect(geometry(0.0, STEP), &ranges), detect(geometry(angle, STEP), &ranges));
        prop_assert_eq!(before.len(), after.len());
        for (a, b) in before.iter().zip(&after) {
            prop_assert_eq!(a.index, b.index);
            prop_assert!((Rotation2::new(angle) * a.point - b.point).norm() < 1e-12);
            prop_assert!((a.orientation + angle - b.orientation).sin().abs() < 1e-12);
        }
    }

    /// The grid of directions is fixed to beam 0, so another first beam may move a corner by a little.
    #[test]
    fn where_a_closed_scan_begins_does_not_matter(shift in 0_usize..720, turn in 0.0..TAU) {
        let before = room(0.0, turn, 0.005, 1);
        let mut after = before.clone();
        after.rotate_left(shift);
        let (before, after) = (detect(geometry(0.0, STEP), &before), detect(geometry(shift as f64 * STEP, STEP), &after));
        prop_assert_eq!(before.len(), after.len());
        for a in &before {
            prop_assert!(after.iter().any(|b| (a.point - b.point).norm() < 0.005 && (a.orientation - b.orientation).sin().abs() < 0.01));
        }
    }

    #[test]
    fn a_scanner_that_turns_the_other_way_sees_the_same(turn in 0.0..TAU) {
        let forward = room(0.0, turn, 0.0, 1);
        let backward: Vec<f64> = (0..720).map(|i| forward[(720 - i) % 720]).collect();
        let (one, other) = (detect(geometry(0.0, STEP), &forward), detect(geometry(0.0, -STEP), &backward));
        prop_assert_eq!(one.len(), other.len());
        for a in &one {
            let near = |b: &&Keypoint| (a.point - b.point).norm() < 0.02 && (a.orientation - b.orientation).cos() > 0.99;
            prop_assert!(other.iter().any(|b| near(&b)), "{:?} {:?}", a, other);
        }
    }

    #[test]
    fn any_input_is_survived(
        ranges in prop::collection::vec(prop_oneof![0.0..3.0_f64, Just(f64::NAN), Just(f64::INFINITY), Just(1e300)], 0..60),
        angle_increment in prop_oneof![-2.0..2.0_f64, Just(0.0), Just(f64::NAN), Just(TAU / 36.0)],
        a in 0.01..5.0_f64,
        beams in 0_usize..60,
    ) {
        let mut keypoints = Vec::new();
        let options = Options { a, ..Options::default() };
        Detector::new(geometry(0.0, angle_increment), beams, options).detect(&ranges, &mut keypoints);
        prop_assert!(keypoints.iter().all(|k| k.point.norm().is_finite() && k.index < beams.max(1)));
    }
}

#[test]
fn what_has_no_corners_gives_none() {
    let wall: Vec<f64> = (0..300).map(|i| 2.0 / (-0.75 + 0.005 * f64::from(i)).cos()).collect();
    let circle = vec![3.0; 720];
    assert_eq!(detect(geometry(-0.75, 0.005), &wall), []);
    assert_eq!(detect(geometry(0.0, STEP), &circle), []);
    assert_eq!(detect(geometry(0.0, STEP), &[f64::NAN; 720]), []);
    assert_eq!(detect(geometry(0.0, STEP), &[]), []);
}

#[test]
fn many_scans_at_once_equal_one_by_one() {
    let scans: Vec<Vec<f64>> = (0..20).map(|k| room(-PI, 0.1 * k as f64, 0.01, k)).collect();
    let scans: Vec<&[f64]> = scans.iter().map(|s| if s[0] > 3.0 { &s[..] } else { &s[..500] }).collect();
    let each: Vec<_> = scans.iter().map(|s| detect(geometry(-PI, STEP), s)).collect();
    assert_eq!(detect_all(geometry(-PI, STEP), &scans, Options::default()), each);
}

#[test]
fn settings_are_checked() {
    let said = |options: Options| options.validate().unwrap_err().to_string();
    assert_eq!(Options::default().validate(), Ok(()));
    assert_eq!(said(Options { tolerance: 0.0, ..Options::default() }), "tolerance = 0: it must be above 0 m");
    assert_eq!(
        said(Options { rho_max: FRAC_PI_2 * 1e9, ..Options::default() }),
        format!("rho_max = {}: it must be 1 to 15000 times rho_step", FRAC_PI_2 * 1e9)
    );
}

//! Landmarks of a room that is known.

#![allow(clippy::unwrap_used)]

mod room;

use groma_estimation::random::SplitMix64;
use groma_features::Keypoint;
use groma_geometry::{Se2, wrap};
use groma_mapping::keyframe::Keyframe;
use groma_mapping::landmarks;
use groma_models::{Landmark, LandmarkMap, Token};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use room::{Disc, HALF, keyframe, scan};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// The upper right corner of the room, and the direction into which it opens.
const CORNER: (Vector2<f64>, f64) = (Vector2::new(HALF.0, HALF.1), -3.0 * FRAC_PI_4);
/// Chi-square of two degrees of freedom, 95 %.
const NINETY_FIVE: f64 = 5.991;

fn landmarks(keyframes: &[Keyframe], poses: &[Se2], covariances: &[Matrix3<f64>]) -> LandmarkMap {
    landmarks::landmarks(keyframes, poses, covariances, &Token::new()).unwrap()
}

fn poses(n: usize) -> Vec<Se2> {
    (0..n).map(|i| Se2::new(-4.0 + 8.0 * i as f64 / n as f64, 0.3, 0.4 * i as f64)).collect()
}

/// A corner of the map as a vehicle at `pose` detects it.
fn sight(pose: &Se2, (point, orientation): (Vector2<f64>, f64), covariance: Matrix2<f64>) -> Keypoint {
    let orientation = wrap(orientation - pose.theta());
    Keypoint { index: 0, point: pose.inverse().act(point), orientation, radius: 0.3, covariance }
}

/// What vehicles at `poses` see of the room with `discs`, the `i`-th detecting the corners `detected(i)`.
fn see(poses: &[Se2], discs: &[Disc], detected: impl Fn(usize) -> Vec<(Vector2<f64>, f64)>) -> Vec<Keyframe> {
    let covariance = Matrix2::identity() * 1e-4;
    let at = |(i, pose): (usize, &Se2)| {
        let corners = detected(i).into_iter().map(|c| sight(pose, c, covariance)).collect();
        keyframe(&scan(pose, discs, || 0.0), corners)
    };
    poses.iter().enumerate().map(at).collect()
}

fn map(keyframes: &[Keyframe], poses: &[Se2]) -> LandmarkMap {
    landmarks(keyframes, poses, &vec![Matrix3::zeros(); poses.len()])
}

#[test]
fn a_corner_seen_from_many_places_is_one() {
    let poses = poses(8);
    let found = map(&see(&poses, &[], |i| if i < 5 { vec![CORNER] } else { vec![] }), &poses).landmarks;
    let [only] = &found[..] else { panic!("{} landmarks", found.len()) };
    assert!((only.position - CORNER.0).norm() < 1e-9);
    assert!(wrap(only.orientation.unwrap() - CORNER.1).abs() < 1e-9);
    // The five that saw it, and the three that show its walls but detected nothing.
    assert_eq!((only.seen, only.visible), (5, 8));
}

#[test]
fn corners_half_a_metre_apart_stay_two() {
    let poses = poses(6);
    let other = (CORNER.0 - Vector2::new(0.5, 0.0), CORNER.1);
    let found = map(&see(&poses, &[], |i| if i % 2 == 0 { vec![CORNER, other] } else { vec![other, CORNER] }), &poses);
    let positions: Vec<_> = found.landmarks.iter().map(|l| l.position).collect();
    assert_eq!(positions.len(), 2);
    assert!((positions[0] - CORNER.0).norm() < 1e-9 && (positions[1] - other.0).norm() < 1e-9);
    assert!(found.landmarks.iter().all(|l| l.seen == 6));
}

#[test]
fn corners_that_a_scan_distinguishes_stay_two_however_close() {
    let poses = poses(6);
    let other = (CORNER.0 - Vector2::new(0.15, 0.0), CORNER.1);
    let found = map(&see(&poses, &[], |_| vec![CORNER, other]), &poses).landmarks;
    assert_eq!(found.iter().map(|l| l.seen).collect::<Vec<_>>(), [6, 6]);
}

#[test]
fn a_corner_that_some_scans_show_twice_is_one() {
    let poses = poses(12);
    let twin = (CORNER.0 - Vector2::new(0.12, 0.0), CORNER.1);
    // The third scan shows it twice; some later ones show it where its twin was begun.
    let shown = |i: usize| match i {
        2 => vec![CORNER, twin],
        4 | 7 | 9 | 10 => vec![twin],
        _ => vec![CORNER],
    };
    let found = map(&see(&poses, &[], shown), &poses).landmarks;
    assert_eq!(found.iter().map(|l| (l.seen, l.visible)).collect::<Vec<_>>(), [(12, 12)]);
    // It lies among its sights, and its covariance tells of their scatter.
    assert!((found[0].position.y - HALF.1).abs() < 1e-9 && (found[0].position.x - HALF.0 + 0.04).abs() < 1e-3);
    assert!(found[0].covariance[(0, 0)] > 0.01_f64.powi(2));
}

#[test]
fn corners_that_open_the_other_way_stay_two() {
    let poses = poses(6);
    let other = (CORNER.0 + Vector2::new(0.1, 0.0), CORNER.1 + PI);
    let found = map(&see(&poses, &[], |i| vec![if i % 2 == 0 { CORNER } else { other }]), &poses).landmarks;
    assert_eq!(found.len(), 2);
    assert!(wrap(found[0].orientation.unwrap() - found[1].orientation.unwrap()).abs() > FRAC_PI_2);
}

#[test]
fn the_hidden_does_not_count_as_visible() {
    let poses = poses(8);
    // A pillar between the last poses and the corner.
    let pillar = (Vector2::new(3.8, 1.8), 0.3);
    let lit = |i: usize| {
        let from = (poses[i] * room::MOUNT).translation;
        let to = CORNER.0 - from;
        let aside = (pillar.0 - from).perp(&to).abs() / to.norm();
        assert!((aside - pillar.1).abs() > 0.08);
        aside > pillar.1
    };
    let shown = (0..8).filter(|i| lit(*i)).count();
    assert!(shown > 3 && shown < 7);
    let found = map(&see(&poses, &[pillar], |i| if lit(i) { vec![CORNER] } else { vec![] }), &poses).landmarks;
    assert_eq!((found[0].seen as usize, found[0].visible as usize), (shown, shown));
}

#[test]
fn what_is_seen_too_seldom_is_dropped() {
    let poses = poses(20);
    // A pallet's corner in the middle of the room: detected in the first scans, seen through in the others.
    let pallet = (Vector2::new(1.0, -1.5), 0.3);
    let after =
        |scans: usize| map(&see(&poses, &[], |i| if i < scans { vec![pallet] } else { vec![] }), &poses).landmarks;
    assert!(after(2).is_empty() && after(3).is_empty());
    assert_eq!(after(4).len(), 1);
    assert!(after(4)[0].visible >= 19, "{}", after(4)[0].visible);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let poses = poses(20);
    let keyframes = see(&poses, &[], |i| vec![CORNER, (Vector2::new(0.3 * i as f64 - 3.0, -HALF.1), 1.0)]);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| map(&keyframes, &poses))
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn numbers_that_are_none_are_left_out() {
    let poses = poses(5);
    let mut keyframes = see(&poses, &[], |_| vec![CORNER]);
    keyframes[0].corners[0].point.x = f64::NAN;
    keyframes[1].corners[0].covariance = Matrix2::identity() * f64::INFINITY;
    assert_eq!(map(&keyframes, &poses).landmarks[0].seen, 3);
    assert!(map(&[], &[]).landmarks.is_empty());
}

/// What is wrong in a Monte-Carlo run: independent position errors of each pose, a shift and turn of all.
struct Errors {
    scatter: f64,
    common: Vector3<f64>,
}

/// Share of runs within the 95 % ellipse, and the mean squared Mahalanobis distance, over runs with 8 sights each.
fn coverage(errors: &Errors, runs: usize) -> (f64, f64) {
    let mut g = SplitMix64::new(11);
    let truth = poses(8);
    let mut keyframes = see(&truth, &[], |_| vec![]);
    let (mut inside, mut sum) = (0, 0.0);
    for _ in 0..runs {
        let eta = errors.common.map(|sigma| sigma * g.normal());
        let bias = Vector2::new(g.normal(), g.normal()) * 0.005;
        let mut placed = Vec::new();
        let mut covariances = Vec::new();
        for (k, pose) in keyframes.iter_mut().zip(&truth) {
            let noise = Vector2::new(0.02 * g.normal(), 0.008 * g.normal());
            let mut seen = sight(pose, CORNER, Matrix2::from_diagonal(&Vector2::new(4e-4, 6.4e-5)));
            seen.point += pose.rotation.inverse().act(bias) + noise;
            k.corners = vec![seen];
            let shift = Vector2::new(g.normal(), g.normal()) * errors.scatter;
            let moved = Se2 { translation: pose.translation + shift, rotation: pose.rotation };
            placed.push(Se2::exp(eta) * moved);
            let ad = pose.inverse().adjoint();
            covariances.push(ad * Matrix3::from_diagonal(&errors.common.map(|s| s * s)) * ad.transpose());
        }
        let map = landmarks(&keyframes, &placed, &covariances);
        let Landmark { position, covariance, seen, .. } = &map.landmarks[0];
        assert_eq!(*seen, 8);
        let e = position - CORNER.0;
        let d_sq = covariance.try_inverse().map_or(f64::NAN, |w| e.dot(&(w * e)));
        inside += usize::from(d_sq < NINETY_FIVE);
        sum += d_sq;
    }
    (inside as f64 / runs as f64, sum / runs as f64)
}

fn assert_covers(errors: &Errors, band: std::ops::Range<f64>, nees: std::ops::Range<f64>) {
    let (share, mean) = coverage(errors, 2000);
    assert!(band.contains(&share) && nees.contains(&mean), "95 % ellipses hold {share}, NEES of 2 is {mean}");
}

#[test]
fn the_ellipse_of_a_landmark_holds_it() {
    // Nothing but the noise of the corners and the floor. The scatter is never taken for less than none, so that the
    // covariance is a little large: 95 % and more, NEES 2 and less.
    assert_covers(&Errors { scatter: 0.0, common: Vector3::zeros() }, 0.94..0.98, 1.6..2.1);
}

#[test]
fn the_ellipse_holds_it_where_poses_scatter() {
    // The scatter is estimated from eight sights, 14 degrees of freedom: tails are those of a t-distribution.
    assert_covers(&Errors { scatter: 0.03, common: Vector3::zeros() }, 0.91..0.96, 1.9..2.6);
}

#[test]
fn the_ellipse_holds_it_where_all_poses_share_an_error() {
    assert_covers(&Errors { scatter: 0.0, common: Vector3::new(0.03, 0.05, 0.01) }, 0.935..0.97, 1.8..2.15);
}

#[test]
fn more_sights_do_not_average_out_what_they_share() {
    let truth = poses(40);
    let keyframes = see(&truth, &[], |_| vec![CORNER]);
    let shared = Matrix3::from_diagonal(&Vector3::new(1e-3, 1e-3, 0.0));
    let found = &landmarks(&keyframes, &truth, &[shared; 40]).landmarks[0];
    let least = found.covariance.symmetric_eigenvalues().min();
    assert!(least > 1e-3 + 2.5e-5 && least < 1.1e-3, "{least}");
}

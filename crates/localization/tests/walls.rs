//! A map of which only the occupancy grid is left: the place is found by its walls, and they constrain the pose.

#![allow(clippy::unwrap_used)] // helpers of tests may fail loudly

mod drive;

use drive::{Draw, nees};
use groma_geometry::Se2;
use groma_localization::{Localizer, Motion, Options, RelocalizeOptions, Relocalizer, Start, Status};
use groma_models::{BeamGeometry, Cell, Grid, LandmarkMap, LaserScan};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};
use std::sync::Arc;

const BEAMS: BeamGeometry =
    BeamGeometry { angle_min: -2.35, angle_increment: 0.0131, time_increment: 0.0, range_min: 0.1, range_max: 25.0 };

/// Walls (x0, y0, x1, y1) of offices along a corridor, no two alike: doors are gaps.
const OFFICES: [[f64; 4]; 22] = [
    [0.0, 0.0, 20.0, 0.1],
    [0.0, 13.9, 20.0, 14.0],
    [0.0, 0.0, 0.1, 14.0],
    [19.9, 0.0, 20.0, 14.0],
    [0.0, 5.9, 1.5, 6.0],
    [2.5, 5.9, 6.0, 6.0],
    [7.0, 5.9, 13.0, 6.0],
    [14.0, 5.9, 16.5, 6.0],
    [17.5, 5.9, 20.0, 6.0],
    [0.0, 8.0, 4.0, 8.1],
    [5.0, 8.0, 10.5, 8.1],
    [11.5, 8.0, 18.0, 8.1],
    [19.0, 8.0, 20.0, 8.1],
    [5.0, 0.0, 5.1, 6.0],
    [9.0, 0.0, 9.1, 6.0],
    [15.5, 0.0, 15.6, 6.0],
    [7.0, 8.0, 7.1, 14.0],
    [12.0, 8.0, 12.1, 14.0],
    [1.0, 2.0, 2.2, 2.8],
    [10.5, 2.5, 11.0, 4.5],
    [2.0, 11.0, 4.2, 11.6],
    [15.0, 10.5, 15.8, 12.5],
];

fn grid(walls: &[[f64; 4]]) -> Grid {
    let (resolution, width, height) = (0.05, 400, 280);
    let cell = |k: usize| {
        let p = Vector2::new((k % width) as f64 + 0.5, (k / width) as f64 + 0.5) * resolution;
        let inside = |w: &[f64; 4]| p.x > w[0] && p.x < w[2] && p.y > w[1] && p.y < w[3];
        if walls.iter().any(inside) { Cell::Occupied } else { Cell::Free }
    };
    Grid { resolution, origin: Vector2::zeros(), width, height, cells: (0..width * height).map(cell).collect() }
}

/// The distance to the first wall: slabs.
fn cast(walls: &[[f64; 4]], from: Vector2<f64>, direction: Vector2<f64>) -> f64 {
    let hit = |w: &[f64; 4]| {
        let (mut near, mut far) = (0.0_f64, f64::INFINITY);
        for k in 0..2 {
            let (a, b) = ((w[k] - from[k]) / direction[k], (w[k + 2] - from[k]) / direction[k]);
            (near, far) = (near.max(a.min(b)), far.min(a.max(b)));
        }
        if near <= far { near } else { f64::INFINITY }
    };
    walls.iter().map(hit).fold(f64::INFINITY, f64::min)
}

fn scan(walls: &[[f64; 4]], pose: &Se2, stamp: f64, draw: &mut Draw) -> LaserScan {
    let range = |k: usize| {
        let (s, c) = (pose.theta() + BEAMS.bearing(k)).sin_cos();
        cast(walls, pose.translation, Vector2::new(c, s)) + 0.012 * draw.normal()
    };
    LaserScan { stamp, geometry: BEAMS, ranges: (0..360).map(range).collect(), intensities: Vec::new() }
}

fn localizer(walls: &[[f64; 4]], pose: Option<(Se2, Matrix3<f64>)>) -> Localizer {
    let relocalizer = Relocalizer::new(LandmarkMap::default(), Some(grid(walls)), RelocalizeOptions::default());
    let start = Start { stamp: 0.0, pose, mount: Se2::IDENTITY, calibration: None };
    let plain = Localizer::new(LandmarkMap::default(), &start, Options::default()).unwrap();
    plain.with_relocalizer(Arc::new(relocalizer.unwrap()))
}

fn variances(sigma: [f64; 3]) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(sigma).map(|s| s * s))
}

/// Along the corridor and back, with odometry `worse` times as bad as it says: steps of 0.1 m; what `look` makes of each.
fn drive(localizer: &mut Localizer, from: Se2, worse: f64, seed: u64, mut look: impl FnMut(&Localizer, &Se2) -> bool) {
    let (mut truth, mut draw) = (from, Draw::new(seed));
    for k in 1..=260 {
        let turn = if (120..151).contains(&k) { std::f64::consts::PI / 31.0 } else { 0.0 };
        let step = Se2::exp(Vector3::new(if turn == 0.0 { 0.1 } else { 0.01 }, 0.0, turn));
        let sigma = Vector3::new(0.01, 0.003, 0.004 + 0.03 * turn.abs());
        let error = sigma.map(|s| worse * s * draw.normal());
        truth = truth * step;
        let motion =
            Motion { motion: step * Se2::exp(error), covariance: variances(sigma.into()), by_drive: SMatrix::zeros() };
        let stamp = 0.1 * f64::from(k);
        localizer.predict(stamp, &motion).unwrap();
        localizer.look(&scan(&OFFICES, &truth, stamp, &mut draw));
        localizer.update(&[], None);
        if look(localizer, &truth) {
            return;
        }
    }
}

#[test]
fn walls_constrain_the_pose_where_there_are_no_landmarks() {
    for (seed, worse, bounds) in [(1, 1.0, (0.12, 2.0)), (2, 4.0, (0.25, 4.0))] {
        let from = Se2::new(1.5, 7.0, 0.02);
        let mut held = localizer(&OFFICES, Some((from, variances([0.05, 0.05, 0.02]))));
        let (mut sum, mut n, mut largest) = (0.0, 0.0, 0.0_f64);
        drive(&mut held, from, worse, seed, |localizer, truth| {
            assert_eq!(localizer.quality().status, Status::Tracking);
            sum += nees(truth, &localizer.pose(), &localizer.covariance()) / 3.0;
            n += 1.0;
            largest = largest.max((truth.translation - localizer.pose().translation).norm());
            false
        });
        assert!(
            largest < bounds.0 && sum / n < bounds.1,
            "odometry {worse} times as bad: {largest} m, NEES/dof {}",
            sum / n
        );
    }
}

#[test]
fn a_pose_that_the_walls_contradict_is_lost_and_found_again() {
    let (from, wrong) = (Se2::new(1.5, 7.0, 0.0), Se2::new(3.5, 10.0, 0.5));
    let mut astray = localizer(&OFFICES, Some((wrong, variances([0.02, 0.02, 0.01]))));
    let (mut lost, mut found) = (None, None);
    drive(&mut astray, from, 1.0, 3, |localizer, truth| {
        let is_lost = localizer.quality().status == Status::Lost;
        lost = lost.or(is_lost.then(|| localizer.distance()));
        if lost.is_some() && !is_lost {
            found = Some((localizer.distance(), truth.minus(&localizer.pose()).norm()));
        }
        found.is_some()
    });
    let (way, error) = found.unwrap();
    assert!(
        lost.unwrap() < 4.0 && way < 10.0 && error < 0.1,
        "lost after {lost:?} m, found after {way} m, {error} off"
    );
}

/// How the start is found from several places: right, wrong, and the ways.
fn starts(walls: &[[f64; 4]], places: &[Se2]) -> (usize, usize, Vec<f64>) {
    let (mut right, mut wrong, mut ways) = (0, 0, Vec::new());
    for (k, from) in places.iter().enumerate() {
        let mut lost = localizer(walls, None);
        drive(&mut lost, *from, 1.0, k as u64, |localizer, truth| {
            if localizer.quality().status == Status::Lost {
                return localizer.distance() > 9.0;
            }
            let error = truth.minus(&localizer.pose());
            let is_right = error.xy().norm() < 0.2 && error.z.abs() < 0.05;
            (right, wrong) = (right + usize::from(is_right), wrong + usize::from(!is_right));
            ways.push(localizer.distance());
            true
        });
    }
    (right, wrong, ways)
}

#[test]
fn the_place_is_found_by_walls_alone() {
    let places: Vec<Se2> = (0..5).map(|k| Se2::new(1.0 + 1.2 * f64::from(k), 6.8, 0.03)).collect();
    let (right, wrong, ways) = starts(&OFFICES, &places);
    assert!(wrong == 0 && right == places.len(), "{right} right, {wrong} wrong: {ways:?}");
    assert!(ways.iter().all(|w| *w < 5.0), "{ways:?}");
}

#[test]
fn a_room_that_is_not_on_the_map_is_not_taken_for_one_like_it() {
    // The map shows the first office and its twin elsewhere; the vehicle stands in a third that is like them.
    let twins = [[0.0, 0.0, 5.0, 0.1], [0.0, 0.0, 0.1, 6.0], [4.9, 0.0, 5.0, 6.0], [0.0, 5.9, 5.0, 6.0]];
    let other = twins.map(|[x0, y0, x1, y1]| [x0 + 12.0, y0 + 7.0, x1 + 12.0, y1 + 7.0]);
    let relocalizer =
        Relocalizer::new(LandmarkMap::default(), Some(grid(&twins)), RelocalizeOptions::default()).unwrap();
    let mut draw = Draw::new(1);
    let mut view = groma_localization::LocalView::default();
    view.look(&scan(&other, &Se2::new(14.0, 9.5, 0.3), 0.0, &mut draw), &Se2::IDENTITY, Vector3::zeros());
    assert!(relocalizer.certain(&view).is_none(), "{:?}", relocalizer.locate(&view).first());
    assert!(!relocalizer.locate(&view).is_empty());
}

//! Occupancy of a room that is known.

#![allow(clippy::unwrap_used)]

mod room;

use groma_estimation::random::SplitMix64;
use groma_geometry::Se2;
use groma_mapping::keyframe::Keyframe;
use groma_mapping::occupancy;
use groma_models::{Cell, Grid, Token};
use nalgebra::Vector2;
use room::{Disc, HALF, keyframe, scan};

const CELL: f64 = 0.05;

fn occupancy(keyframes: &[Keyframe], poses: &[Se2], cell: f64) -> Grid {
    occupancy::occupancy(keyframes, poses, cell, &Token::new()).unwrap()
}

/// A drive along the room, and what it saw with a range noise of `sigma`; `discs` stand there during the first scan only.
fn drive(sigma: f64, discs: &[Disc]) -> (Vec<Keyframe>, Vec<Se2>) {
    let mut gaussian = SplitMix64::new(7);
    let poses: Vec<Se2> = (0..9).map(|i| Se2::new(-4.0 + i as f64, 0.3, 0.1 * i as f64)).collect();
    let see = |(i, pose): (usize, &Se2)| {
        let discs = if i == 0 { discs } else { &[] };
        keyframe(&scan(pose, discs, || sigma * gaussian.normal()), vec![])
    };
    (poses.iter().enumerate().map(see).collect(), poses)
}

fn map(sigma: f64, discs: &[Disc], cell: f64) -> Grid {
    let (keyframes, poses) = drive(sigma, discs);
    occupancy(&keyframes, &poses, cell)
}

/// Points along the walls, a centimetre apart and `inset` away from the corners, with the outward normals.
fn wall_points(inset: f64) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let steps =
        |half: f64| (0..).map(move |i| inset - half + 0.01 * f64::from(i)).take_while(move |x| *x < half - inset);
    let flat = steps(HALF.0).flat_map(|x| [1.0, -1.0].map(|s| (Vector2::new(x, s * HALF.1), Vector2::new(0.0, s))));
    let steep = steps(HALF.1).flat_map(|y| [1.0, -1.0].map(|s| (Vector2::new(s * HALF.0, y), Vector2::new(s, 0.0))));
    flat.chain(steep).collect()
}

/// Least and greatest number of occupied cells on the way through the wall, from half a metre before to half behind.
fn thickness(grid: &Grid, inset: f64) -> (usize, usize) {
    let cells = |(p, n): &(Vector2<f64>, Vector2<f64>)| {
        let on_way = (-10..=10).map(|k| p + n * (CELL * f64::from(k)));
        on_way.filter(|q| grid.at(*q) == Cell::Occupied).count()
    };
    let counts = wall_points(inset).iter().map(cells).collect::<Vec<_>>();
    counts.iter().fold((usize::MAX, 0), |(least, most), n| (least.min(*n), most.max(*n)))
}

#[test]
fn walls_are_occupied_the_inside_free_the_outside_unknown() {
    let grid = map(0.0, &[], CELL);
    assert_eq!(thickness(&grid, 0.1), (1, 1));
    let (mut inside, mut free, mut outside) = (0_u32, 0_u32, 0_u32);
    for row in 0..grid.height {
        for column in 0..grid.width {
            let p = grid.origin + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) * CELL;
            let depth = (HALF.0 - p.x.abs()).min(HALF.1 - p.y.abs());
            inside += u32::from(depth > CELL);
            free += u32::from(depth > CELL && grid.at(p) == Cell::Free);
            outside += u32::from(depth < -CELL && grid.at(p) != Cell::Unknown);
        }
    }
    assert!(f64::from(free) > 0.999 * f64::from(inside), "{free} of {inside} cells inside are free");
    assert_eq!(outside, 0);
}

#[test]
fn noise_neither_opens_the_walls_nor_thickens_them() {
    let grid = map(0.02, &[], CELL);
    let (least, most) = thickness(&grid, 0.1);
    assert!(least >= 1 && most <= 3, "walls are {least} to {most} cells thick");
    let sum: usize = grid.cells.iter().filter(|c| **c == Cell::Occupied).count();
    let perimeter = 4.0 * (HALF.0 + HALF.1) / CELL;
    assert!((sum as f64) < 2.0 * perimeter, "{sum} occupied cells for a wall of {perimeter}");
}

#[test]
fn beams_along_a_wall_do_not_wash_it_out() {
    // All the drive a hand's breadth from the wall: most readings of it are grazing.
    let poses: Vec<Se2> = (0..40).map(|i| Se2::new(-4.0 + 0.2 * f64::from(i), 2.7, 0.0)).collect();
    let mut gaussian = SplitMix64::new(3);
    let keyframes: Vec<Keyframe> =
        poses.iter().map(|pose| keyframe(&scan(pose, &[], || 0.01 * gaussian.normal()), vec![])).collect();
    let (least, most) = thickness(&occupancy(&keyframes, &poses, CELL), 0.3);
    assert!(least >= 1 && most <= 3, "walls are {least} to {most} cells thick");
}

#[test]
fn a_person_seen_in_one_scan_is_erased() {
    let person = (Vector2::new(-2.0, 0.6), 0.25);
    let (keyframes, poses) = drive(0.0, &[person]);
    let on_person = person.0 - Vector2::new(person.1, 0.0);
    let near = |grid: &Grid, state: Cell| {
        let around = (-4..=4).flat_map(|i| (-4..=4).map(move |j| Vector2::new(f64::from(i), f64::from(j)) * CELL));
        around.filter(|d| grid.at(on_person + d) == state).count()
    };
    let first = occupancy(&keyframes[..1], &poses[..1], CELL);
    assert!(near(&first, Cell::Occupied) > 3);
    let all = occupancy(&keyframes, &poses, CELL);
    assert_eq!(near(&all, Cell::Occupied), 0);
    assert_eq!(near(&all, Cell::Free), 81);
}

#[test]
fn a_beam_without_return_marks_nothing() {
    let pose = Se2::IDENTITY;
    let mut silent = scan(&pose, &[], || 0.0);
    silent.ranges[1..].fill(f64::INFINITY);
    let grid = occupancy(&[keyframe(&silent, vec![])], &[pose], CELL);
    let known = grid.cells.iter().filter(|c| **c != Cell::Unknown).count();
    assert_eq!(grid.cells.iter().filter(|c| **c == Cell::Occupied).count(), 1);
    assert!(known as f64 <= silent.ranges[0] / CELL + 2.0);
}

#[test]
fn a_far_reading_clears_its_way_but_is_not_drawn() {
    let pose = Se2::IDENTITY;
    let mut far = scan(&pose, &[], || 0.0);
    far.ranges.fill(70.0);
    let grid = occupancy(&[keyframe(&far, vec![])], &[pose], 0.5);
    assert!(grid.cells.iter().all(|c| *c != Cell::Occupied));
    assert_eq!(grid.at(Vector2::new(28.0, 0.0)), Cell::Free);
    assert!(grid.width as f64 * grid.resolution < 70.0);
}

#[test]
fn the_origin_is_a_multiple_of_the_resolution() {
    let grid = map(0.0, &[], CELL);
    for x in [grid.origin.x, grid.origin.y] {
        assert!((x / CELL - (x / CELL).round()).abs() < 1e-9);
    }
    let margin = Vector2::new(-HALF.0, -HALF.1) - grid.origin;
    assert!(margin.min() >= 3.0 * CELL && margin.max() < 6.0 * CELL);
}

#[test]
fn a_vast_map_gets_larger_cells() {
    let (mut keyframes, mut poses) = drive(0.0, &[]);
    keyframes.push(keyframes[0].clone());
    poses.push(Se2::new(1500.0, 1000.0, 0.0));
    let grid = occupancy(&keyframes, &poses, CELL);
    assert_eq!(grid.resolution, 0.2);
    assert!(grid.cells.len() <= 40_000_000);
    assert_eq!(grid.at(Vector2::new(1502.0, 1000.0)), Cell::Free);
}

#[test]
fn what_cannot_be_mapped_gives_no_cells() {
    let (keyframes, poses) = drive(0.0, &[]);
    assert!(occupancy(&[], &[], CELL).cells.is_empty());
    for resolution in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(occupancy(&keyframes, &poses, resolution).cells.is_empty());
    }
    let lost = vec![Se2::new(f64::NAN, 0.0, 0.0), Se2::new(1e300, 0.0, 0.0)];
    assert!(occupancy(&keyframes[..2], &lost, CELL).cells.is_empty());
}

/// A mount or a beam that is no number leaves its readings out, and nothing else; nothing runs for ever.
#[test]
fn readings_that_are_nowhere_are_left_out() {
    let (mut keyframes, poses) = drive(0.0, &[]);
    let whole = occupancy(&keyframes[1..], &poses[1..], CELL);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let lost = |mount: Se2, increment: f64| {
            let mut seen = scan(&poses[0], &[], || 0.0);
            seen.geometry.angle_increment *= increment;
            groma_registration::PolarView::new(&seen, &mount, nalgebra::Vector3::zeros())
        };
        let increment = if bad.is_finite() { f64::NAN } else { bad };
        for view in [lost(Se2::new(bad, 0.0, 0.0), 1.0), lost(room::MOUNT, increment)] {
            keyframes[0].tracked.view = view.into();
            assert_eq!(occupancy(&keyframes, &poses, CELL), whole);
        }
    }
}

#[test]
fn a_cancelled_grid_is_none() {
    let (keyframes, poses) = drive(0.0, &[]);
    let token = Token::new();
    token.cancel();
    assert!(occupancy::occupancy(&keyframes, &poses, CELL, &token).is_err());
}

#[test]
fn beams_start_where_the_laser_was_when_they_were_fired() {
    // A turn of one radian during the sweep: in the frame of its stamp the scan shows the same room.
    let (pose, twist) = (Se2::new(0.5, 0.2, 0.3), nalgebra::Vector3::new(0.3, 0.0, 1.0));
    let mut swept = scan(&pose, &[], || 0.0);
    swept.geometry.time_increment = 1.0 / 720.0;
    for i in 0..720 {
        let at = pose.plus(twist * (i as f64 / 720.0));
        swept.ranges[i] = scan(&at, &[], || 0.0).ranges[i];
    }
    let mut seen = keyframe(&swept, vec![]);
    seen.tracked.view = groma_registration::PolarView::new(&swept, &room::MOUNT, twist).into();
    let grid = occupancy(&[seen], &[pose], CELL);
    assert_eq!(thickness(&grid, 0.1).1, 1);
}

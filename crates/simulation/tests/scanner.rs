//! What a scanner reads, against what can be computed by hand.

use groma_estimation::streams::{Purpose, Random};
use groma_geometry::Se2;
use groma_models::LaserScan;
use groma_simulation::Scanner;
use groma_simulation::world::{REFLECTOR, RayCaster, WALL, World};
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

/// Walls x = 3, y = 2, x = -4, y = -5.
fn hall() -> World {
    let mut world = World::default();
    world.rectangle(Vector2::new(-0.5, -1.5), Vector2::new(7.0, 7.0), 0.0, WALL);
    world
}

/// Distance to the walls of the hall from `p` at bearing `b`.
fn wall_distance(p: Vector2<f64>, b: f64) -> f64 {
    let (s, c) = b.sin_cos();
    let x = if c > 0.0 { (3.0 - p.x) / c } else { (-4.0 - p.x) / c };
    let y = if s > 0.0 { (2.0 - p.y) / s } else { (-5.0 - p.y) / s };
    x.min(y)
}

/// A scanner without faults that looks all around.
fn perfect() -> Scanner {
    Scanner {
        mount: [0.0, 0.0, 0.0],
        beams: 720,
        angle_min: -PI + 0.001,
        angle_increment: TAU / 720.0,
        sigma: 0.0,
        quantum: 0.0,
        dropout: 0.0,
        ..Scanner::default()
    }
}

fn scan(world: &World, scanner: &Scanner, base: impl Fn(f64) -> Se2) -> LaserScan {
    scanner.sweep(&RayCaster::new(world), base, 0.0, &mut Random::new(7, Purpose::Ranges))
}

#[test]
fn reads_the_walls_exactly_from_its_mount() {
    let scanner = Scanner { mount: [0.3, -0.2, 0.4], ..perfect() };
    let base = Se2::new(-1.0, 0.5, 1.1);
    let laser = base * Se2::new(0.3, -0.2, 0.4);
    let scan = scan(&hall(), &scanner, |_| base);
    for (i, &r) in scan.ranges.iter().enumerate() {
        let want = wall_distance(laser.translation, laser.theta() + scan.geometry.bearing(i));
        assert!((r - want).abs() < 1e-12, "beam {i}: {r} instead of {want}");
    }
}

#[test]
fn each_beam_leaves_from_where_the_scanner_is_then() {
    let scanner = Scanner { time_increment: 1e-3, ..perfect() };
    let base = |t: f64| Se2::new(-2.0 + 1.5 * t, 0.2, 0.9 * t);
    let scan = scan(&hall(), &scanner, base);
    for (i, &r) in scan.ranges.iter().enumerate() {
        let then = base(1e-3 * i as f64);
        let want = wall_distance(then.translation, then.theta() + scan.geometry.bearing(i));
        assert!((r - want).abs() < 1e-12, "beam {i}: {r} instead of {want}");
    }
    let still = self::scan(&hall(), &perfect(), base);
    assert!((still.ranges[700] - scan.ranges[700]).abs() > 0.1);
}

#[test]
fn noise_has_the_stated_deviation() {
    let scanner = Scanner { sigma: 0.02, beams: 40_000, angle_increment: TAU / 40_000.0, ..perfect() };
    let base = Se2::new(0.0, 0.0, 0.0);
    let scan = scan(&hall(), &scanner, |_| base);
    let error = |i: usize| scan.ranges[i] - wall_distance(base.translation, scan.geometry.bearing(i));
    let errors: Vec<f64> = (0..scanner.beams).map(error).collect();
    let n = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    // Five standard deviations of the mean and of the deviation.
    assert!(mean.abs() < 5.0 * 0.02 / n.sqrt(), "mean {mean}");
    assert!((deviation - 0.02).abs() < 5.0 * 0.02 / (2.0 * n).sqrt(), "deviation {deviation}");
    let within = errors.iter().filter(|e| e.abs() < 0.02).count() as f64 / n;
    assert!((within - 0.6827).abs() < 0.012, "share within one sigma {within}");
}

#[test]
fn ranges_come_in_steps() {
    let scan = scan(&hall(), &Scanner { sigma: 0.01, quantum: 0.01, ..perfect() }, |_| Se2::IDENTITY);
    assert!(scan.ranges.iter().all(|r| ((r / 0.01) - (r / 0.01).round()).abs() < 1e-9));
}

#[test]
fn loses_the_stated_share_of_echoes() {
    let scanner = Scanner { dropout: 0.1, beams: 20_000, angle_increment: TAU / 20_000.0, ..perfect() };
    let scan = scan(&hall(), &scanner, |_| Se2::IDENTITY);
    let lost = scan.ranges.iter().filter(|r| r.is_infinite()).count() as f64 / 20_000.0;
    assert!((lost - 0.1).abs() < 5.0 * (0.1 * 0.9 / 20_000.0_f64).sqrt(), "share {lost}");
}

#[test]
fn sees_nothing_beyond_its_range_and_nothing_valid_below() {
    let scanner = Scanner { range_max: 4.5, range_min: 2.5, ..perfect() };
    let scan = scan(&hall(), &scanner, |_| Se2::IDENTITY);
    for (i, &r) in scan.ranges.iter().enumerate() {
        let want = wall_distance(Vector2::zeros(), scan.geometry.bearing(i));
        assert!(match want {
            w if w > 4.5 => r == f64::INFINITY,
            w if w < 2.5 => r.is_nan(),
            w => (r - w).abs() < 1e-12,
        });
    }
    assert!(scan.ranges.iter().any(|r| r.is_nan()) && scan.ranges.iter().any(|r| r.is_infinite()));
}

#[test]
fn reflectors_shine_and_walls_fade_with_range_and_incidence() {
    let mut world = hall();
    world.circle(Vector2::new(-2.0, 0.0), 0.05, REFLECTOR);
    let scanner = Scanner { beams: 4, angle_min: 0.0, angle_increment: PI / 2.0, ..perfect() };
    let ahead = scan(&world, &scanner, |_| Se2::IDENTITY).intensities;
    assert!(ahead[2] > 20.0 * ahead[0], "reflector {} wall {}", ahead[2], ahead[0]);
    assert!(ahead[1] > ahead[0] && ahead[0] > ahead[3], "nearer walls are brighter: {ahead:?}");
    let turned = scan(&hall(), &scanner, |_| Se2::new(0.0, 0.0, 0.5));
    let want = 1000.0 * WALL * 0.5_f64.cos() / (1.0 + (turned.ranges[0] / 5.0).powi(2));
    assert!((turned.intensities[0] - want).abs() < 1e-9);
}

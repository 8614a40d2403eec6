//! Drives and their odometry against closed forms.

use groma_estimation::streams::{Purpose, Random};
use groma_geometry::{Se2, wrap};
use groma_models::Token;
use groma_simulation::drive::{Drive, Limits, Route, Vehicle, WheelErrors, WheelReadings, Wheels};
use groma_simulation::simulate::simulate_in;
use groma_simulation::world::World;
use groma_simulation::{Scenario, SimulationError};
use nalgebra::Vector2;

const DIFFERENTIAL: Vehicle = Vehicle::Differential { left_radius: 0.1, right_radius: 0.101, separation: 0.4 };
const TRICYCLE: Vehicle = Vehicle::Tricycle { radius: 0.12, wheelbase: 1.3, steering_offset: 0.02 };

fn faultless() -> WheelErrors {
    WheelErrors { radius: [0.0; 2], base: 0.0, steering: 0.0, slip: 0.0, encoder_step: 0.0, final_error: None }
}

fn detour() -> Route {
    let mut route = Route::from(Vector2::new(1.0, 2.0));
    for (x, y) in [(9.0, 2.0), (9.0, 8.0), (3.0, 11.0), (3.0, 20.0)] {
        route.to(Vector2::new(x, y));
    }
    route
}

fn read(drive: &Drive, vehicle: &Vehicle, errors: &WheelErrors) -> Result<WheelReadings, SimulationError> {
    WheelReadings::of(drive, vehicle, errors, &mut Random::new(5, Purpose::Wheels), &Token::new())
}

fn furthest(a: &[Se2], b: &[Se2]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.between(b)).to_vector().norm()).fold(0.0, f64::max)
}

#[test]
fn arcs_are_exact() {
    let (v, w) = (0.9, 0.35);
    let mut drive = Drive::from(Se2::new(1.0, -2.0, 0.3), 0.02);
    for _ in 0..2000 {
        drive.advance(v, w);
    }
    for t in [0.0, 0.013, 7.777, 39.99, 40.0] {
        let (r, a) = (v / w, 0.3 + w * t);
        let want = Vector2::new(1.0 + r * (a.sin() - 0.3_f64.sin()), -2.0 - r * (a.cos() - 0.3_f64.cos()));
        let here = drive.at(t);
        assert!((here.translation - want).norm() < 1e-9, "at {t} s");
        assert!(wrap(here.theta() - a).abs() < 1e-9, "at {t} s");
    }
    assert!((drive.length() - 36.0).abs() < 1e-9);
}

#[test]
fn odometry_without_errors_is_the_truth() {
    for (vehicle, spot) in [(DIFFERENTIAL, true), (TRICYCLE, false)] {
        let limits = Limits { corner_radius: 1.5, ..Limits::default() };
        let drive = Drive::along(&detour(), &limits, spot).unwrap();
        let readings = read(&drive, &vehicle, &faultless()).unwrap();
        let placed: Vec<Se2> = readings.odometry.iter().map(|&pose| drive.poses[0] * pose).collect();
        assert!(furthest(&placed, &drive.poses) < 1e-9);
        assert!(drive.length() > 20.0);
    }
}

#[test]
fn joints_of_a_tricycle_integrate_back_to_the_truth() {
    let drive = Drive::along(&detour(), &Limits { corner_radius: 1.5, ..Limits::default() }, false).unwrap();
    let joints = read(&drive, &TRICYCLE, &faultless()).unwrap().positions;
    let mut pose = drive.poses[0];
    for (k, pair) in joints.windows(2).enumerate() {
        // The textbook form: Ds cos(alpha) along, Ds sin(alpha) / L around, alpha = reading + offset.
        let (travel, alpha) = (0.12 * (pair[1][0] - pair[0][0]), pair[1][1] + 0.02);
        let (delta, phi) = (travel * alpha.cos(), travel * alpha.sin() / 1.3);
        let chord = if phi.abs() < 1e-12 { delta } else { delta * (phi / 2.0).sin() / (phi / 2.0) };
        let middle = pose.theta() + phi / 2.0;
        pose = Se2::new(pose.x() + chord * middle.cos(), pose.y() + chord * middle.sin(), pose.theta() + phi);
        assert!(pose.between(&drive.poses[k + 1]).to_vector().norm() < 1e-9, "step {k}");
    }
    assert!(joints.iter().any(|j| (j[1] + 0.02).abs() > 0.3), "the route steers");
}

#[test]
fn systematic_errors_act_as_believed() {
    let mut drive = Drive::from(Se2::IDENTITY, 0.02);
    for _ in 0..500 {
        drive.advance(0.5, 0.0);
    }
    let errors = WheelErrors { radius: [0.01, -0.01], ..faultless() };
    let end = *read(&drive, &DIFFERENTIAL, &errors).unwrap().odometry.last().unwrap();
    assert!((end.theta() - wrap(5.0 * -0.02 / 0.4)).abs() < 1e-9);
    let errors = WheelErrors { steering: 0.05, ..faultless() };
    let end = *read(&drive, &TRICYCLE, &errors).unwrap().odometry.last().unwrap();
    assert!((end.theta() - 5.0 * 0.05_f64.sin() / 1.3).abs() < 1e-9);
}

#[test]
fn slip_grows_with_the_root_of_the_distance() {
    let errors = WheelErrors { slip: 0.01, ..faultless() };
    let mut drive = Drive::from(Se2::IDENTITY, 0.02);
    for _ in 0..200 {
        drive.advance(0.5, 0.0);
    }
    let excess = |seed| {
        let mut random = Random::new(seed, Purpose::Wheels);
        let end = WheelReadings::of(&drive, &DIFFERENTIAL, &errors, &mut random, &Token::new()).unwrap().positions[200];
        0.1 * end[0] - 2.0
    };
    let squares: Vec<f64> = (0..2000).map(|seed| excess(seed).powi(2)).collect();
    let deviation = (squares.iter().sum::<f64>() / 2000.0).sqrt();
    let want = 0.01 * 2.0_f64.sqrt();
    assert!((deviation - want).abs() < 5.0 * want / (2.0 * 2000.0_f64).sqrt(), "{deviation} instead of {want}");
}

#[test]
fn the_final_error_can_be_set() {
    let drive = Drive::along(&detour(), &Limits::default(), true).unwrap();
    let errors = WheelErrors { final_error: Some(0.7), ..WheelErrors::default() };
    let end = *read(&drive, &DIFFERENTIAL, &errors).unwrap().odometry.last().unwrap();
    let truth = drive.poses[0].between(drive.poses.last().unwrap());
    assert!(((end.translation - truth.translation).norm() - 0.7).abs() < 1e-3);
    let nothing_to_scale = WheelErrors { final_error: Some(0.7), ..faultless() };
    assert_eq!(read(&drive, &DIFFERENTIAL, &nothing_to_scale).unwrap_err(), SimulationError::FinalError(0.7));
}

#[test]
fn encoders_report_whole_steps() {
    let errors = WheelErrors { encoder_step: 0.01, ..faultless() };
    let drive = Drive::along(&detour(), &Limits::default(), true).unwrap();
    let readings = read(&drive, &DIFFERENTIAL, &errors).unwrap();
    assert!(readings.positions.iter().flatten().all(|p| (p / 0.01 - (p / 0.01).round()).abs() < 1e-6));
    let placed: Vec<Se2> = readings.odometry.iter().map(|&pose| drive.poses[0] * pose).collect();
    assert!(furthest(&placed, &drive.poses) < 0.1, "whole steps do not add up to a drift");
}

#[test]
fn a_vehicle_keeps_to_its_limits_and_reaches_every_stop() {
    let limits = Limits { sway: 0.0, ..Limits::default() };
    let mut route = detour();
    route.stop(1.0);
    route.to(Vector2::new(3.0, 15.0));
    let drive = Drive::along(&route, &limits, true).unwrap();
    assert!(drive.twists.iter().all(|[v, w]| *v <= limits.speed && w.abs() <= limits.turn_rate && *v >= 0.0));
    for stop in [Vector2::new(3.0, 20.0), Vector2::new(3.0, 15.0)] {
        assert!(drive.poses.iter().any(|pose| (pose.translation - stop).norm() < 0.03));
    }
    let standing = drive.twists.iter().filter(|twist| **twist == [0.0, 0.0]).count();
    assert!(standing >= 50, "one second of steps");
}

#[test]
fn a_stall_freezes_the_odometry_and_then_jumps_to_where_it_would_have_been() {
    let scenario = Scenario { stalls: 4, stall_duration: 1.0, ..Scenario::default() };
    let plain = Scenario { stalls: 0, ..scenario.clone() };
    let (stalled, plain) = (
        simulate_in(World::default(), &detour(), &scenario, &Token::new()).unwrap(),
        simulate_in(World::default(), &detour(), &plain, &Token::new()).unwrap(),
    );
    assert_eq!(stalled.stalls.len(), 4);
    let mut old = 0;
    let mut last = plain.odometry[0].pose;
    for (given, undisturbed) in stalled.odometry.iter().zip(&plain.odometry) {
        let t = given.stamp - 100.0;
        let frozen = stalled.stalls.iter().any(|s| (s.start + 1e-9..s.start + s.duration - 1e-9).contains(&t));
        assert_eq!(given.pose, if frozen { last } else { undisturbed.pose }, "after {t} s");
        old += usize::from(given != undisturbed);
        last = given.pose;
    }
    assert!(old > 4 * 20, "{old} readings of 4 stalls are old");
    assert_eq!(stalled.truth, plain.truth);
    assert_eq!(stalled.joints, plain.joints);
}

#[test]
fn what_is_in_the_way_is_an_error() {
    let mut world = World::default();
    world.circle(Vector2::new(6.0, 2.1), 0.05, 0.5);
    let error = simulate_in(world, &detour(), &Scenario::default(), &Token::new()).unwrap_err();
    assert!(matches!(error, SimulationError::Collision { x, .. } if x > 5.0 && x < 6.0), "{error}");
    let mut dash = Route::from(Vector2::zeros());
    assert_eq!(Drive::along(&dash, &Limits::default(), true).unwrap_err(), SimulationError::EmptyRoute);
    dash.to(Vector2::new(0.0, 5.0));
    dash.to(Vector2::new(0.1, 0.0));
    dash.to(Vector2::new(3.0, 3.0));
    let hasty = Limits { turn_rate: 1e-3, speed: 2.0, ..Limits::default() };
    assert!(matches!(Drive::along(&dash, &hasty, false), Err(SimulationError::NotFollowed { leg: 0, .. })));
}

#[test]
fn a_standing_tricycle_keeps_its_steering() {
    let held = Wheels { first: 0.4, second: 0.2 };
    assert_eq!(TRICYCLE.wheels(0.0, 0.0, held), Wheels { first: 0.0, second: 0.2 });
}

//! Drives of a calibrated vehicle, and what is known when one begins or the motions pause.

#![allow(clippy::unwrap_used, clippy::panic)]

#[allow(dead_code)]
mod world;

use groma_geometry::Se2;
use groma_models::{Differential, Drive, LandmarkKind, ParameterCovariance, Scanner, Vehicle};
use groma_pipeline::Message;
use groma_pipeline::localize::{Begin, Localize, Localized, Setup};
use groma_pipeline::message::{StartPose, WheelReading};
use nalgebra::{DMatrix, Matrix3, Vector2};
use world::{MOUNT, Truth, arriving, blind, draw, odometry, scans, setup, strips, without_map};

const UNTIL: f64 = 7.0;
const RADIUS: f64 = 0.1;
const AXLE: f64 = 0.5;

fn run(setup: Setup, messages: Vec<Message>) -> Localized {
    let mut machine = Localize::new(setup).unwrap();
    messages.into_iter().for_each(|message| drop(machine.push(message)));
    machine.finish().unwrap()
}

/// What the wheels of a differential drive read on the true path; from `reset` on the counters begin anew.
fn wheels(truth: &Truth, reset: f64) -> Vec<Message> {
    let mut angles = [40.0, -7.0];
    let mut before = truth.at(0.0);
    let reading = |k: i32| {
        let stamp = 0.02 * f64::from(k);
        let step = before.between(&truth.at(stamp)).log();
        before = truth.at(stamp);
        for (angle, side) in angles.iter_mut().zip([-1.0, 1.0]) {
            *angle += (step.x + side * step.z * AXLE / 2.0) / RADIUS;
        }
        let from = if stamp >= reset { 1000.0 } else { 0.0 };
        let positions = vec![(0, angles[0] - from), (1, angles[1] - from)];
        Message::Wheels(WheelReading::new(stamp, positions).unwrap())
    };
    (0..(50.0 * UNTIL) as i32).map(reading).collect()
}

fn vehicle(mount_sigma: f64) -> Vehicle {
    let mount = Se2::new(MOUNT.0, MOUNT.1, MOUNT.2);
    let scanner = Scanner { name: String::new(), mount, range_offset: 0.0 };
    let drive = Drive::Differential(Differential { left: RADIUS, right: RADIUS, axle: AXLE });
    let plain = Vehicle::new(drive, vec![scanner], 0.0).unwrap();
    let matrix = DMatrix::from_element(1, 1, mount_sigma * mount_sigma);
    plain.with_covariance(ParameterCovariance { names: vec!["laser_x".to_owned()], matrix }).unwrap()
}

fn on_wheels(truth: &Truth, mount_sigma: f64) -> Localized {
    let messages = [wheels(truth, f64::INFINITY), scans(truth, UNTIL, &mut draw(1))].concat();
    let setup = Setup { vehicle: Some(vehicle(mount_sigma)), mount: Se2::IDENTITY, ..setup(truth) };
    run(setup, arriving(messages, |_| 0.0))
}

#[test]
fn the_scanner_is_where_the_vehicle_has_it() {
    let truth = Truth::new();
    let track = on_wheels(&truth, 1e-4).track;
    assert!(track.iter().all(|fix| (fix.pose.translation - truth.at(fix.stamp).translation).norm() < 0.03));
}

#[test]
fn what_a_calibration_leaves_open_is_counted() {
    let truth = Truth::new();
    let along = |mount_sigma: f64| on_wheels(&truth, mount_sigma).track.last().unwrap().covariance.m11.sqrt();
    let (well, badly) = (along(1e-4), along(0.02));
    assert!(well < 0.01 && badly > 1.8 * well, "{well} {badly}");
}

#[test]
fn counters_that_begin_anew_move_nobody() {
    let truth = Truth::new();
    let mut messages = wheels(&truth, 4.0);
    messages.extend((0..60).map(|k| blind(0.1 * f64::from(k) + 0.03)));
    let result = run(Setup { vehicle: Some(vehicle(1e-4)), ..without_map() }, arriving(messages, |_| 0.0));
    for fix in &result.track {
        let moved = truth.at(0.0).between(&truth.at(fix.stamp));
        assert!((fix.pose.translation - moved.translation).norm() < 0.05, "{} {:?}", fix.stamp, fix.pose);
    }
}

#[test]
fn a_start_told_late_is_moved_on_and_is_no_better_than_the_motions_since() {
    let truth = Truth::new();
    let told_at = |stamp: f64| {
        let mut machine = Localize::new(without_map()).unwrap();
        odometry(&truth, 6.0, 0.0, &mut draw(1)).into_iter().for_each(|m| drop(machine.push(m)));
        let covariance = Matrix3::from_diagonal_element(1e-4);
        machine.push(Message::StartPose(StartPose { stamp, pose: truth.at(stamp), covariance }));
        machine.state().unwrap()
    };
    let (early, late) = (told_at(4.0), told_at(5.98));
    assert!(early.pose.minus(&truth.at(early.stamp)).norm() < 1e-3, "{:?}", early.pose);
    assert!(late.pose.minus(&truth.at(late.stamp)).norm() < 1e-3);
    assert!((late.covariance.m22.sqrt() - 0.01).abs() < 0.005);
    let driven = odometry_sigma(&truth, 4.0, 5.98);
    assert!(early.covariance.m11 > 1e-4 + 0.8 * driven, "{} {driven}", early.covariance.m11);
}

/// Variance along that the motions between two times add at least [m^2].
fn odometry_sigma(truth: &Truth, from: f64, to: f64) -> f64 {
    groma_pipeline::localize::Options::default().odometry.variances(&truth.at(from).between(&truth.at(to))).x
}

#[test]
fn a_start_that_a_person_gives_is_good_to_a_step() {
    let truth = Truth::new();
    let mut machine = Localize::new(Setup { begin: Begin::About(truth.at(0.0)), ..setup(&truth) }).unwrap();
    machine.push(odometry(&truth, 0.1, 0.0, &mut draw(1)).remove(0));
    let sigmas = machine.state().unwrap().covariance.diagonal().map(f64::sqrt);
    assert!((0.1..0.3).contains(&sigmas.x) && (0.1..0.3).contains(&sigmas.y) && (0.05..0.2).contains(&sigmas.z));
}

#[test]
fn what_a_vehicle_did_before_its_first_motion_is_open() {
    let truth = Truth::new();
    let mut messages = odometry(&truth, 3.0, 0.0, &mut draw(1));
    messages.retain(|m| m.stamp() >= 0.5);
    messages.extend((0..25).map(|k| blind(0.1 * f64::from(k) + 0.003)));
    let track = run(without_map(), arriving(messages, |_| 0.0)).track;
    assert!(track.last().unwrap().quality.sigma_position > 0.05, "{}", track.last().unwrap().quality.sigma_position);
}

#[test]
fn scans_tell_the_way_through_a_pause_that_ends() {
    let truth = Truth::new();
    let mut noise = draw(4);
    let mut all = [odometry(&truth, UNTIL, 0.1, &mut noise), scans(&truth, UNTIL, &mut noise)].concat();
    all.retain(|m| matches!(m, Message::Scan { .. }) || !(4.0..5.3).contains(&m.stamp()));
    let result = run(setup(&truth), arriving(all, |_| 0.0));
    for fix in result.track.iter().filter(|fix| (4.2..5.3).contains(&fix.stamp)) {
        let off = (fix.pose.translation - truth.at(fix.stamp).translation).norm();
        assert!(off < 0.04 && fix.quality.sigma_position < 0.01, "{} {off} {:?}", fix.stamp, fix.quality);
    }
}

#[test]
fn a_reading_after_a_pause_costs_nothing_that_scans_knew() {
    let truth = Truth::new();
    let mut noise = draw(4);
    let all = [odometry(&truth, UNTIL, 0.1, &mut noise), scans(&truth, UNTIL, &mut noise)].concat();
    let without = |from: f64, to: f64| {
        let heard = |m: &Message| matches!(m, Message::Scan { .. }) || !(from..to).contains(&m.stamp());
        run(setup(&truth), arriving(all.iter().filter(|m| heard(m)).cloned().collect(), |_| 0.0)).track
    };
    let (paused, dead) = (without(4.0, 5.3), without(4.0, f64::INFINITY));
    for (a, b) in paused.iter().zip(&dead).filter(|(fix, _)| (4.3..5.0).contains(&fix.stamp)) {
        assert!(a.quality.sigma_position < 1.02 * b.quality.sigma_position, "{:?} {:?}", a.quality, b.quality);
    }
}

#[test]
fn what_a_vehicle_did_between_its_start_and_its_first_motion_is_open() {
    let truth = Truth::new();
    let mut machine = Localize::new(without_map()).unwrap();
    let covariance = Matrix3::from_diagonal_element(1e-8);
    machine.push(Message::StartPose(StartPose { stamp: 0.0, pose: truth.at(0.0), covariance }));
    odometry(&truth, 1.0, 0.0, &mut draw(1)).into_iter().skip(25).for_each(|m| drop(machine.push(m)));
    assert!(machine.state().unwrap().quality.sigma_position > 0.1, "{:?}", machine.state());
}

#[test]
fn a_start_may_be_told_late_while_motions_are_late_too() {
    let truth = Truth::new();
    let mut messages = odometry(&truth, 6.0, 0.0, &mut draw(1));
    messages.extend((0..68).map(|k| blind(0.1 * f64::from(k))));
    let late = |m: &Message| if matches!(m, Message::Odometry(_)) { 0.9 } else { 0.0 };
    let mut machine = Localize::new(without_map()).unwrap();
    arriving(messages, late).into_iter().for_each(|m| drop(machine.push(m)));
    let covariance = Matrix3::from_diagonal_element(1e-4);
    machine.push(Message::StartPose(StartPose { stamp: 4.2, pose: truth.at(4.2), covariance }));
    let state = machine.state().unwrap();
    assert!((state.pose.translation - truth.at(state.stamp).translation).norm() < 0.15, "{state:?}");
}

/// A scan begins before the vehicle is where it ends; few scans show the marks as well as many.
#[test]
fn marks_seen_on_the_way_are_where_they_are() {
    let truth = Truth::new();
    for every in [1, 5] {
        let few = scans(&truth, UNTIL, &mut draw(2)).into_iter().step_by(every).collect();
        let messages = [odometry(&truth, UNTIL, 0.1, &mut draw(3)), few].concat();
        let seen = run(setup(&truth), arriving(messages, |_| 0.0)).seen.unwrap().landmarks;
        let off = |at: Vector2<f64>| {
            let all = strips().into_iter().map(|strip| at - strip);
            all.min_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap()
        };
        let strips: Vec<_> = seen.iter().filter(|mark| mark.kind == LandmarkKind::Reflector).collect();
        let mean = strips.iter().map(|mark| off(mark.position)).sum::<Vector2<f64>>() / strips.len() as f64;
        let ahead = truth.at(4.0).act(Vector2::x()) - truth.at(4.0).translation;
        assert!(strips.len() > 8 && mean.dot(&ahead).abs() < 0.005, "{every}: {} {mean}", strips.len());
    }
}

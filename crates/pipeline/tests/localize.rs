//! Drives localized message by message: against the ground truth, with motions in time, late and out of order.

#![allow(clippy::unwrap_used, clippy::panic)]

mod world;

use groma_geometry::Se2;
use groma_localization::Status;
use groma_models::finding::Code;
use groma_models::{Differential, Drive, Odometry, Scanner, Tricycle, Vehicle};
use groma_pipeline::Message;
use groma_pipeline::localize::{Begin, Error, Localize, Localized, Setup};
use groma_pipeline::message::{StartPose, WheelReading};
use nalgebra::Matrix3;
use world::{MOUNT, Truth, arriving, blind, draw, map, odometry, scan, scans, setup, without_map};

/// How long the drives last [s]: it stands from 8 to 11 s.
const DRIVE: f64 = 14.0;

fn run(setup: Setup, messages: Vec<Message>) -> Localized {
    let mut machine = Localize::new(setup).unwrap();
    messages.into_iter().for_each(|message| drop(machine.push(message)));
    machine.finish().unwrap()
}

/// Messages of a drive, each as late as told.
fn messages(truth: &Truth, seed: u64, late: impl FnMut(&Message) -> f64) -> Vec<Message> {
    let mut noise = draw(seed);
    let all = [odometry(truth, DRIVE, 0.1, &mut noise), scans(truth, DRIVE, &mut noise)].concat();
    arriving(all, late)
}

/// Largest and root mean square distance from the truth of known poses [m].
fn errors(result: &Localized, truth: &Truth) -> (f64, f64) {
    let known = || result.track.iter().filter(|fix| fix.is_known());
    let off = known().map(|fix| (fix.pose.translation - truth.at(fix.stamp).translation).norm());
    let (most, square) = off.fold((0.0_f64, 0.0), |(most, square), d| (most.max(d), square + d * d));
    (most, (square / known().count() as f64).sqrt())
}

/// Squared errors over their covariance, per degree of freedom.
fn nees(result: &Localized, truth: &Truth) -> f64 {
    let of = |fix: &groma_pipeline::localize::Fix| {
        let e = fix.pose.minus(&truth.at(fix.stamp));
        e.dot(&(fix.covariance.try_inverse().unwrap() * e)) / 3.0
    };
    result.track.iter().map(of).sum::<f64>() / result.track.len() as f64
}

#[test]
fn strips_of_tape_place_the_vehicle_to_a_centimetre() {
    let truth = Truth::new();
    let result = run(setup(&truth), messages(&truth, 1, |_| 0.0));
    let (most, rms) = errors(&result, &truth);
    assert!(rms < 0.012 && most < 0.04, "{rms} {most}");
    assert_eq!((result.times_lost(), result.found_after()), (0, Some(result.track[0].distance)));
    assert!(result.used.iter().filter(|n| **n > 20).count() > 8, "{:?}", result.used);
    assert!(result.track.iter().all(|fix| fix.quality.status == Status::Tracking));
    assert!(result.seen.unwrap().landmarks.len() > 8);
}

#[test]
fn a_fix_is_of_the_end_of_its_scan_and_the_covariance_is_consistent() {
    let truth = Truth::new();
    let mut mean = 0.0;
    for seed in 0..6 {
        let result = run(setup(&truth), messages(&truth, seed, |_| 0.0));
        let end = |k: usize| 0.1 * k as f64 + 0.013 + 0.025;
        assert!(result.track.iter().enumerate().all(|(k, fix)| (fix.stamp - end(k)).abs() < 1e-3));
        mean += nees(&result, &truth) / 6.0;
    }
    assert!((0.4..1.6).contains(&mean), "{mean}");
}

#[test]
fn odometry_that_comes_late_gives_the_same_poses_once_it_has_come() {
    let truth = Truth::new();
    let timely = run(setup(&truth), messages(&truth, 3, |_| 0.0));
    for late_by in [0.03, 0.25, 0.9] {
        let delay = |message: &Message| if matches!(message, Message::Odometry(_)) { late_by } else { 0.0 };
        let late = run(setup(&truth), messages(&truth, 3, delay));
        assert_eq!(timely.track.len(), late.track.len());
        assert!(late.track.iter().all(|fix| fix.extrapolated < late_by + 0.11));
        // The last scans are still extrapolated when the drive ends.
        let ended = 2 + (late_by / 0.1) as usize;
        for (a, b) in timely.track.iter().zip(&late.track).take(timely.track.len() - ended) {
            let sigma = a.covariance.trace().sqrt();
            assert!(a.pose.minus(&b.pose).norm() < 1e-6 * sigma, "{} s late, at {}", late_by, a.stamp);
            assert!((a.covariance - b.covariance).norm() < 1e-6 * sigma * sigma);
            assert_eq!((&a.paired, a.quality.status), (&b.paired, b.quality.status));
            assert!((a.distance - b.distance).abs() < 1e-9 && (a.turn - b.turn).abs() < 1e-9);
        }
        assert!(nees(&late, &truth) < 1.6);
        assert_eq!(late.findings.iter().any(|f| f.code == Code::OdometryLate), late_by > 0.1);
    }
    assert!(timely.findings.is_empty(), "{:?}", timely.findings);
}

#[test]
fn events_tell_of_each_scan_once_and_of_every_correction() {
    let truth = Truth::new();
    for late_by in [-0.05, 0.15] {
        let delay = |message: &Message| if matches!(message, Message::Odometry(_)) { late_by } else { 0.0 };
        let mut machine = Localize::new(setup(&truth)).unwrap();
        let all = messages(&truth, 6, delay);
        let events: Vec<_> = all.into_iter().flat_map(|message| machine.push(message)).collect();
        let track = machine.finish().unwrap().track;
        let new: Vec<usize> = events.iter().filter(|e| !e.corrected).map(|e| e.scan).collect();
        assert_eq!(new, (0..track.len()).collect::<Vec<_>>());
        let told = |k: usize| events.iter().any(|e| e.corrected && e.scan == k);
        assert!(track.iter().enumerate().all(|(k, fix)| fix.corrected == told(k)));
        assert_eq!(track.iter().filter(|fix| fix.corrected).count() > 20, late_by > 0.0);
    }
}

#[test]
fn arrival_that_jitters_costs_neither_accuracy_nor_consistency() {
    let truth = Truth::new();
    let mut mean = 0.0;
    for seed in 10..14 {
        let mut noise = draw(seed + 100);
        let mut latest = 0.0_f64;
        let jitter = |message: &Message| {
            let wanted = message.end() + 0.03 * world::normal(&mut noise).abs();
            if matches!(message, Message::Odometry(_)) {
                latest = latest.max(wanted);
                return latest - message.end();
            }
            wanted - message.end()
        };
        let result = run(setup(&truth), messages(&truth, seed, jitter));
        let (most, rms) = errors(&result, &truth);
        assert!(rms < 0.013 && most < 0.045, "{rms} {most}");
        mean += nees(&result, &truth) / 4.0;
    }
    assert!((0.4..1.6).contains(&mean), "{mean}");
}

#[test]
fn scans_keep_the_pose_while_odometry_is_silent() {
    let truth = Truth::new();
    let silent = |m: &Message| matches!(m, Message::Odometry(_)) && (3.0..6.0).contains(&m.stamp());
    let heard = messages(&truth, 5, |_| 0.0).into_iter().filter(|m| !silent(m)).collect();
    let result = run(setup(&truth), heard);
    let (most, _) = errors(&result, &truth);
    assert!(most < 0.08, "{most}");
    let during: Vec<_> = result.track.iter().filter(|fix| (3.5..6.0).contains(&fix.stamp)).collect();
    assert!(during.iter().all(|fix| fix.is_known() && fix.quality.matched > 3));
    assert!(nees(&result, &truth) < 1.8);
}

#[test]
fn without_landmarks_the_covariance_grows_with_the_time_of_silence() {
    let truth = Truth::new();
    let noise = &mut draw(1);
    let mut all = odometry(&truth, 3.0, 0.0, noise);
    all.extend((0..80).map(|k| blind(0.1 * f64::from(k))));
    let track = run(without_map(), arriving(all, |_| 0.0)).track;
    let sigma = |t: f64| track.iter().find(|fix| fix.stamp > t).unwrap().quality.sigma_position;
    assert!(sigma(2.9) < 0.05 && sigma(4.0) > 0.1 && sigma(6.0) > 4.0 * sigma(4.0));
    let error = |t: f64| {
        let fix = track.iter().find(|fix| fix.stamp > t).unwrap();
        (fix.pose.translation - truth.at(0.0).between(&truth.at(fix.stamp)).translation).norm()
    };
    assert!(error(3.5) < 3.0 * sigma(3.5) && error(7.0) < 3.0 * sigma(7.0));
}

#[test]
fn exact_odometry_is_followed_exactly() {
    let truth = Truth::new();
    let mut all = odometry(&truth, DRIVE, 0.0, &mut draw(1));
    all.extend((0..130).map(|k| blind(0.1 * f64::from(k) + 0.007)));
    let result = run(without_map(), arriving(all, |m| if matches!(m, Message::Scan { .. }) { 0.03 } else { 0.0 }));
    for fix in &result.track {
        let moved = truth.at(0.0).between(&truth.at(fix.stamp));
        assert!(fix.pose.minus(&moved).norm() < 2e-4, "{} {}", fix.stamp, fix.pose.minus(&moved).norm());
    }
    let driven: f64 = result.track.iter().map(|fix| fix.distance).sum();
    let chords = (0..1296).map(|k| truth.at(0.01 * f64::from(k)).between(&truth.at(0.01 * f64::from(k + 1))));
    assert!((driven - chords.map(|c| c.translation.norm()).sum::<f64>()).abs() < 0.01, "{driven}");
    assert_eq!(result.halts.len(), 1);
    let halt = result.halts[0];
    assert!((halt.from - 8.0).abs() < 0.35 && (halt.to - 11.0).abs() < 0.35, "{halt:?}");
    assert_eq!((result.counts.scans_read, result.counts.odometry_read), (130, 700));
}

/// Readings of the wheels of a drive over an even S, with a delay of their clock, and where the base is at each.
fn wheels(drive: &Drive, delay: f64, offsets: [f64; 2]) -> (Vec<Message>, Vec<(f64, Se2)>) {
    let (mut messages, mut poses, mut pose) = (Vec::new(), Vec::new(), Se2::IDENTITY);
    let mut reading = nalgebra::Vector2::from(offsets);
    for k in 0..500 {
        let stamp = 0.02 * f64::from(k);
        messages.push(Message::Wheels(WheelReading::new(stamp + delay, vec![(0, reading.x), (1, reading.y)]).unwrap()));
        poses.push((stamp, pose));
        let before = reading;
        let input = match drive {
            Drive::Tricycle(_) => {
                reading = nalgebra::Vector2::new(reading.x + 0.11, 0.25 * (0.02 * f64::from(k)).sin());
                nalgebra::Vector2::new(0.11, (before.y + reading.y) / 2.0)
            }
            Drive::Differential(_) => {
                reading += nalgebra::Vector2::new(0.1 + 0.03 * (0.01 * f64::from(k)).sin(), 0.11);
                reading - before
            }
        };
        pose = pose * drive.increment(input).motion;
    }
    (messages, poses)
}

#[test]
fn wheels_of_a_calibrated_vehicle_lead_where_they_say() {
    let tricycle = Drive::Tricycle(Tricycle::from_parameters([0.125, 1.4, 0.98, 0.03, -0.02]));
    let differential = Drive::Differential(Differential { left: 0.1, right: 0.102, axle: 0.55 });
    for (drive, offsets) in [(tricycle, [5e4, 0.0]), (differential, [-300.0, 800.0])] {
        let mount = Se2::new(MOUNT.0, MOUNT.1, MOUNT.2);
        let scanner = Scanner { name: String::new(), mount, range_offset: 0.0 };
        let vehicle = Vehicle::new(drive, vec![scanner], 0.15).unwrap();
        let (mut all, poses) = wheels(&drive, 0.15, offsets);
        // Scans are stamped by their own clock: those of the wheels are 0.15 s ahead of it.
        all.extend((0..90).map(|k| blind(0.1 * f64::from(k) + 0.02)));
        let late = |m: &Message| if matches!(m, Message::Wheels(_)) { -0.15 } else { 0.04 };
        let result = run(Setup { vehicle: Some(vehicle), ..without_map() }, arriving(all, late));
        for fix in &result.track {
            let k = poses.partition_point(|(t, _)| *t <= fix.stamp + 1e-9) - 1;
            let expected = poses[k].1.interpolate(&poses[k + 1].1, (fix.stamp - poses[k].0) / 0.02);
            assert!(fix.pose.minus(&expected).norm() < 1e-3, "{} {}", fix.stamp, fix.pose.minus(&expected).norm());
        }
        assert_eq!((result.counts.wheels_read, result.counts.odometry_read), (500, 0));
    }
}

#[test]
fn the_start_is_found_where_nobody_tells_it() {
    let truth = Truth::new();
    let unknown = Setup { begin: Begin::Unknown, ..setup(&truth) };
    let result = run(unknown, messages(&truth, 7, |_| 0.0));
    let (most, _) = errors(&result, &truth);
    assert!(result.found_after().unwrap() < 3.0 && most < 0.1, "{:?} {most}", result.found_after());
}

#[test]
fn a_start_that_a_person_gives_may_be_a_little_off_and_a_message_may_give_it() {
    let truth = Truth::new();
    let off = truth.at(0.0) * Se2::new(0.15, -0.1, 0.05);
    let about = run(Setup { begin: Begin::About(off), ..setup(&truth) }, messages(&truth, 8, |_| 0.0));
    assert!(errors(&about, &truth).1 < 0.02);
    let mut told = messages(&truth, 8, |_| 0.0);
    let covariance = Matrix3::from_diagonal_element(0.01);
    told.insert(120, Message::StartPose(StartPose { stamp: 0.5, pose: truth.at(0.5), covariance }));
    let found = run(Setup { begin: Begin::At(Se2::new(50.0, 50.0, 1.0), covariance * 1e-4), ..setup(&truth) }, told);
    let after = found.track.iter().filter(|fix| fix.stamp > 3.0);
    assert!(after.clone().count() > 90);
    assert!(after.clone().all(|fix| (fix.pose.translation - truth.at(fix.stamp).translation).norm() < 0.08));
}

#[test]
fn a_place_that_is_not_on_the_map_is_never_found() {
    let truth = Truth::new();
    let mut far = map();
    far.landmarks.iter_mut().enumerate().for_each(|(k, l)| l.position += nalgebra::Vector2::new(3.7 * k as f64, 90.0));
    let result = run(Setup { map: far, begin: Begin::Unknown, ..setup(&truth) }, messages(&truth, 9, |_| 0.0));
    assert_eq!(result.found_after(), None);
    assert_eq!(result.findings[0].code, Code::NeverFound);
    assert!(result.seen.is_none());
}

#[test]
fn a_snapshot_is_what_finishing_then_would_give() {
    let truth = Truth::new();
    let all = messages(&truth, 2, |_| 0.0);
    let mut whole = Localize::new(setup(&truth)).unwrap();
    assert_eq!((whole.state(), whole.snapshot().unwrap_err()), (None, Error::NoScan));
    let (first, second) = all.split_at(all.len() / 2);
    let mut events = 0;
    for message in first {
        events += whole.push(message.clone()).iter().filter(|event| !event.corrected).count();
    }
    let half = whole.snapshot().unwrap();
    assert_eq!((half.track.len(), whole.scans()), (events, events));
    second.iter().for_each(|message| drop(whole.push(message.clone())));
    let result = whole.finish().unwrap();
    let again = run(setup(&truth), all);
    assert_eq!((&result.track, &result.seen, &result.halts), (&again.track, &again.seen, &again.halts));
    assert_eq!(half.track[..half.track.len() - 1], result.track[..half.track.len() - 1]);
    assert_eq!(whole.state().unwrap().pose.translation, whole.state().unwrap().pose.translation);
}

#[test]
fn lateness_puts_messages_into_order_and_says_what_stays_out() {
    let truth = Truth::new();
    let mut all = messages(&truth, 4, |_| 0.0);
    for k in (0..all.len() - 9).step_by(9) {
        all.swap(k, k + 5);
    }
    let timely = run(setup(&truth), messages(&truth, 4, |_| 0.0));
    let strict = run(setup(&truth), all.clone());
    assert!(strict.findings.iter().any(|f| f.code == Code::StampsLate && f.values[0].value > 10.0));
    let mut patient = setup(&truth);
    patient.options.lateness = 0.5;
    let sorted = run(patient, all);
    assert!(sorted.findings.iter().all(|f| f.code != Code::StampsLate), "{:?}", sorted.findings);
    let same = timely.track.iter().zip(&sorted.track).filter(|(a, b)| a.pose.minus(&b.pose).norm() < 1e-9).count();
    assert!(same as f64 > 0.9 * timely.track.len() as f64, "{same}");
}

#[test]
fn a_scan_before_any_odometry_and_other_scanners_do_no_harm() {
    let truth = Truth::new();
    let mut noise = draw(1);
    let mut all = vec![scan(&truth, 0.0, &mut noise)];
    all.extend(messages(&truth, 1, |_| 0.0));
    if let Message::Scan { scan, .. } = scan(&truth, 1.0, &mut noise) {
        all.insert(200, Message::Scan { scanner: 1, scan });
    }
    all.insert(300, Message::Odometry(Odometry { stamp: f64::NAN, pose: Se2::IDENTITY }));
    let result = run(setup(&truth), all);
    assert!(errors(&result, &truth).0 < 0.05);
    assert_eq!(result.counts.passed_over, 1);
    assert!(result.findings.iter().any(|f| f.code == Code::ValuesInvalid));
}

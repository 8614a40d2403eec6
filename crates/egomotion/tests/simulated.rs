//! Motions of a simulated laser against the ground truth: right, and as sure as they say.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests may fail loudly and tell figures")]

use groma_egomotion::{Follower, Motion, Station, Verdict};
use groma_geometry::Se2;
use groma_models::Token;
use groma_simulation::calibration::{CalibrationDrive, CalibrationScenario, Drivetrain, Program};
use groma_simulation::simulate_calibration;

const TRICYCLE: Drivetrain = Drivetrain::Tricycle {
    drive_scale: 0.125,
    wheelbase: 1.5,
    steering_gain: 1.0,
    steering_offset_forward: -0.0133,
    steering_offset_backward: -0.0133,
};

fn measured(scenario: &CalibrationScenario, stations: Vec<Station>) -> (CalibrationDrive, Vec<Motion>) {
    let drive = simulate_calibration(scenario, &Token::new()).unwrap();
    let mut follower = Follower::default();
    for scan in &drive.scans {
        let stands = stations.iter().any(|s| s.is_standstill() && s.from <= scan.stamp && scan.stamp < s.to);
        follower.push(scan.clone(), stands, true).unwrap();
    }
    let motions = follower.motions(&stations, &Token::new()).unwrap();
    (drive, motions)
}

/// The true pose of the laser at a time.
fn laser_at(scenario: &CalibrationScenario, drive: &CalibrationDrive, stamp: f64) -> Se2 {
    let after = drive.stamps.partition_point(|s| *s < stamp - 1e-9).clamp(1, drive.stamps.len() - 1);
    let (a, b) = (drive.stamps[after - 1], drive.stamps[after]);
    let base = drive.truth[after - 1].interpolate(&drive.truth[after], ((stamp - a) / (b - a)).clamp(0.0, 1.0));
    let [x, y, yaw] = scenario.scanner.mount;
    base * Se2::new(x, y, yaw)
}

/// Errors of good motions in the tangent: root mean squares [m], [rad], and the mean NEES per degree of freedom.
fn errors(scenario: &CalibrationScenario, drive: &CalibrationDrive, motions: &[Motion]) -> (f64, f64, f64) {
    let (mut position, mut heading, mut nees, mut count) = (0.0, 0.0, 0.0, 0.0);
    for m in motions.iter().filter(|m| m.verdict == Verdict::Good) {
        let truth = laser_at(scenario, drive, m.start).between(&laser_at(scenario, drive, m.end));
        let e = Se2::new(m.motion.x, m.motion.y, m.motion.z).minus(&truth);
        position += e.xy().norm_squared();
        heading += e.z * e.z;
        nees += e.dot(&(m.covariance.try_inverse().unwrap() * e)) / 3.0;
        count += 1.0;
    }
    ((position / count).sqrt(), (heading / count).sqrt(), nees / count)
}

/// The standstills of a simulated drive.
fn standstills(drive: &CalibrationDrive) -> Vec<Station> {
    let mut out: Vec<Station> = vec![];
    let mut begin: Option<f64> = None;
    for k in 1..drive.stamps.len() {
        let stands = drive.readings[k][0] == drive.readings[k - 1][0];
        let last = k + 1 == drive.stamps.len();
        match (stands && !last, begin) {
            (true, None) => begin = Some(drive.stamps[k - 1]),
            (false, Some(from)) => {
                if drive.stamps[k] - from > 1.0 {
                    out.push(Station { from: from + 0.1, to: drive.stamps[k] - 0.1 });
                }
                begin = None;
            }
            _ => {}
        }
    }
    out
}

#[test]
fn arcs_of_half_a_turn_are_measured_between_standstills() {
    let (mut nees, runs) = (0.0, 3);
    for seed in 1..=runs {
        let mut scenario = CalibrationScenario::new(TRICYCLE, seed);
        if let Program::Arcs { angles, .. } = &mut scenario.program {
            *angles = 2;
        }
        scenario.scanner.period = 0.2;
        let stations = standstills(&simulate_calibration(&scenario, &Token::new()).unwrap());
        assert_eq!(stations.len(), 9);
        let (drive, motions) = measured(&scenario, stations);
        assert!(motions.iter().all(|m| m.verdict == Verdict::Good));
        assert!(motions.iter().all(|m| (m.motion.z.abs().to_degrees() - 180.0).abs() < 15.0), "turns are whole");
        let (position, heading, ratio) = errors(&scenario, &drive, &motions);
        println!("seed {seed}: {:.2} mm {:.4} deg, NEES {ratio:.2}", position * 1e3, heading.to_degrees());
        assert!(position < 0.002 && heading.to_degrees() < 0.02);
        nees += ratio / runs as f64;
    }
    assert!((0.4..1.8).contains(&nees), "NEES {nees}");
}

#[test]
fn ordinary_driving_is_measured_from_moment_to_moment() {
    let (mut mean, runs) = (0.0, 3);
    for seed in 5..5 + runs {
        let mut scenario = CalibrationScenario::new(TRICYCLE, seed);
        scenario.program = Program::Continuous { duration: 30.0, to: 0.9 };
        let moments = (2..58).map(|k| 100.0 + 0.5 * f64::from(k)).map(|t| Station { from: t, to: t });
        let (drive, motions) = measured(&scenario, moments.collect());
        let good = motions.iter().filter(|m| m.verdict == Verdict::Good).count();
        assert!(good >= motions.len() - 2, "{good} of {}", motions.len());
        let (position, heading, nees) = errors(&scenario, &drive, &motions);
        println!("seed {seed}: {:.2} mm {:.4} deg, NEES {nees:.2}", position * 1e3, heading.to_degrees());
        assert!(position < 0.003 && heading.to_degrees() < 0.03);
        mean += nees / runs as f64;
    }
    assert!((0.5..1.7).contains(&mean), "NEES {mean}");
}

#[test]
fn what_was_not_seen_is_told() {
    let mut scenario = CalibrationScenario::new(TRICYCLE, 5);
    scenario.program = Program::Continuous { duration: 5.0, to: 0.9 };
    let at = |t: f64| Station { from: t, to: t };
    let (_, motions) = measured(&scenario, vec![at(101.0), at(102.0), at(200.0), at(201.0)]);
    assert_eq!(
        motions.iter().map(|m| m.verdict).collect::<Vec<_>>(),
        [Verdict::Good, Verdict::Unseen, Verdict::Unseen]
    );
    assert!(Follower::default().motions(&[], &Token::new()).unwrap().is_empty());
}

//! Simulated drives as messages through the whole pipeline, against the parameters that were simulated.

use super::*;
use crate::message::WheelReading;
use groma_geometry::Se2;
use groma_models::Odometry;
use groma_simulation::calibration::{CalibrationDrive, CalibrationScenario, Drivetrain, Program};
use groma_simulation::simulate_calibration;

const TRICYCLE: Drivetrain = Drivetrain::Tricycle {
    drive_scale: 0.125,
    wheelbase: 1.5,
    steering_gain: 1.0,
    steering_offset_forward: -0.0133,
    steering_offset_backward: -0.0133,
};
const DIFFERENTIAL: Drivetrain = Drivetrain::Differential { left_radius: 0.1, right_radius: 0.1003, axle: 0.55 };

fn scenario(drivetrain: Drivetrain, seed: u64) -> CalibrationScenario {
    let mut scenario = CalibrationScenario::new(drivetrain, seed);
    if let Program::Arcs { angles, .. } = &mut scenario.program {
        *angles = 2;
    }
    scenario.scanner.period = 0.2;
    scenario
}

fn driving_on(seconds: f64) -> CalibrationScenario {
    let program = Program::Continuous { duration: seconds, to: 0.9 };
    CalibrationScenario { program, ..scenario(TRICYCLE, 5) }
}

/// Scans and readings in the order of their stamps, joints in one message or each in its own.
fn messages(drive: &CalibrationDrive, apart: bool) -> Vec<Message> {
    let wheels = drive.stamps.iter().zip(&drive.readings).flat_map(|(stamp, r)| {
        let reading = |positions| Message::Wheels(WheelReading { stamp: *stamp, positions });
        if apart {
            vec![reading(vec![(0, r[0])]), reading(vec![(1, r[1])])]
        } else {
            vec![reading(vec![(0, r[0]), (1, r[1])])]
        }
    });
    let scans = drive.scans.iter().map(|scan| Message::Scan { scanner: 0, scan: scan.clone() });
    let mut all: Vec<Message> = wheels.chain(scans).collect();
    all.sort_by(|a, b| a.end().total_cmp(&b.end()));
    all
}

fn settings(drivetrain: Drivetrain) -> Settings {
    let steered = drivetrain.steers();
    Settings { steered, wheelbase: steered.then_some(1.5), ..Settings::default() }
}

fn machine(settings: &Settings, messages: &[Message]) -> CalibrateVehicle {
    let mut machine = CalibrateVehicle::new(settings.clone()).unwrap();
    messages.iter().for_each(|m| machine.push(m.clone()));
    machine
}

fn run(settings: &Settings, messages: &[Message]) -> Result<Outcome, Error> {
    machine(settings, messages).finish(&Token::new())
}

fn value(outcome: &Outcome, name: &str) -> (f64, f64) {
    let (layout, k) = (&outcome.calibration.layout, outcome.calibration.layout.position(name).unwrap());
    (layout.values(&outcome.calibration.vehicle.to_full())[k], outcome.calibration.covariance[(k, k)].sqrt())
}

/// Wheels, steering and laser of both drives, from raw scans; the same however joints come, and asked before the end.
#[test]
fn arcs_tell_the_vehicle_however_its_joints_come() {
    for drivetrain in [TRICYCLE, DIFFERENTIAL] {
        let scenario = scenario(drivetrain, 1);
        let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
        let (whole, settings) = (messages(&drive, false), settings(drivetrain));
        let found = run(&settings, &whole).unwrap();
        assert_eq!((found.segments.kind, found.motions.motions.len()), (SegmentKind::StopAndGo, 8));
        let [x, y, yaw] = scenario.scanner.mount;
        for (name, truth) in [("laser_x", x), ("laser_y", y), ("laser_yaw", yaw)] {
            let (got, sigma) = value(&found, name);
            assert!((got - truth).abs() < 4.0 * sigma && sigma < 2e-3, "{name}: {got} +- {sigma}, {truth}");
        }
        let lengths: &[(&str, f64)] = match drivetrain {
            Drivetrain::Tricycle { .. } => &[("drive_scale", 0.125), ("steering_offset", -0.0133)],
            Drivetrain::Differential { .. } => &[("left_radius", 0.1), ("right_radius", 0.1003), ("axle", 0.55)],
        };
        for (name, truth) in lengths {
            let (got, sigma) = value(&found, name);
            assert!((got - truth).abs() < 4.0 * sigma, "{name}: {got} +- {sigma}, {truth}");
        }
        assert!(["calibrated", "misfit"].contains(&found.verdict), "{:?}", found.findings);
        let apart = run(&settings, &messages(&drive, true)).unwrap();
        assert_eq!(apart.calibration.vehicle, found.calibration.vehicle);
    }
}

#[test]
fn a_snapshot_is_what_the_end_would_be_and_changes_nothing() {
    let drive = simulate_calibration(&driving_on(20.0), &Token::new()).unwrap();
    let (all, settings) = (messages(&drive, false), settings(TRICYCLE));
    let half = all.len() / 2;
    let mut asked = machine(&settings, &all[..half]);
    let then = asked.snapshot(&Token::new()).unwrap();
    assert_eq!(then.calibration.vehicle, run(&settings, &all[..half]).unwrap().calibration.vehicle);
    let state = asked.state();
    assert!(state.sights > 40 && state.readings > 400 && state.kept < state.sights && !state.stands);
    all[half..].iter().for_each(|m| asked.push(m.clone()));
    let (late, whole) = (asked.finish(&Token::new()).unwrap(), run(&settings, &all).unwrap());
    assert_eq!(late.calibration.vehicle, whole.calibration.vehicle);
    assert_eq!(late.calibration.covariance, whole.calibration.covariance);
    assert!(whole.motions.motions.len() > then.motions.motions.len());
}

/// A second scanner sits elsewhere: its scans say nothing of where the first one is.
#[test]
fn scans_of_another_scanner_are_passed_over() {
    let drive = simulate_calibration(&driving_on(20.0), &Token::new()).unwrap();
    let (first, settings) = (messages(&drive, false), settings(TRICYCLE));
    let mirrored = |message: &Message| match message {
        Message::Scan { scan, .. } => {
            let ranges = scan.ranges.iter().rev().copied().collect();
            let scan = LaserScan { stamp: scan.stamp + 0.01, ranges, ..scan.clone() };
            vec![message.clone(), Message::Scan { scanner: 1, scan }]
        }
        other => vec![other.clone()],
    };
    let both: Vec<Message> = first.iter().flat_map(mirrored).collect();
    let (alone, beside) = (run(&settings, &first).unwrap(), run(&settings, &both).unwrap());
    assert_eq!(alone.calibration.vehicle, beside.calibration.vehicle);
}

/// The estimate of the pipeline is that of the library on the motions that it hands over.
#[test]
fn the_library_says_the_same_on_the_same_motions() {
    for (scenario, window) in [(scenario(TRICYCLE, 2), None), (driving_on(20.0), Some(0.5))] {
        let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
        let settings = Settings { window, ..settings(TRICYCLE) };
        let found = run(&settings, &messages(&drive, false)).unwrap();
        let request = Request { wheelbase: Some(1.5), ..Request::default() };
        let alone = calibrate(&found.log, &found.motions, &request, &settings.estimate, &Token::new()).unwrap();
        assert_eq!(alone.vehicle, found.calibration.vehicle);
        assert_eq!(alone.covariance, found.calibration.covariance);
    }
}

/// Scans that were let go of would have had no part in it.
#[test]
fn what_is_kept_suffices() {
    for scenario in [scenario(TRICYCLE, 3), scenario(DIFFERENTIAL, 3), driving_on(15.0)] {
        let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
        let found = run(&settings(scenario.drivetrain), &messages(&drive, false)).unwrap();
        let mut all = Follower::default();
        for scan in &drive.scans {
            let stands = found.segments.stations.iter().any(|s| s.from <= scan.stamp && scan.stamp < s.to);
            all.push(scan.clone(), stands, true).unwrap();
        }
        let motions = all.motions(&found.segments.stations, &Token::new()).unwrap();
        for used in &found.motions.motions {
            let same = motions.iter().find(|m| m.start == used.start && m.end == used.end).unwrap();
            let apart = Se2::new(same.motion.x, same.motion.y, same.motion.z).minus(&used.motion).norm();
            assert!(apart < 1e-4, "{apart}");
        }
    }
}

/// A wheel clock 30 ms before that of the scans, in seconds and in this sense.
#[test]
fn a_delay_is_told_with_its_sign_and_unit() {
    let scenario = CalibrationScenario { delay: 0.03, ..driving_on(30.0) };
    let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
    let settings = Settings { free: vec!["delay".into()], ..settings(TRICYCLE) };
    let found = run(&settings, &messages(&drive, false)).unwrap();
    let (delay, sigma) = value(&found, "delay");
    assert!((delay - 0.03).abs() < 0.004 && sigma < 0.003, "{delay} +- {sigma}");
}

/// The same where it is given, of scans that are rare and begin before the wheels: with the other sign the residuals would be far larger.
#[test]
fn a_delay_that_is_known_is_used_as_it_is_told() {
    let scenario = CalibrationScenario { delay: 0.1, ..driving_on(20.0) };
    let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
    let of = |delay: f64| run(&Settings { delay, ..settings(TRICYCLE) }, &messages(&drive, false)).unwrap();
    let (known, not_known) = (of(0.1).calibration.noise_scale, of(0.0).calibration.noise_scale);
    assert!(known < 1.5 && not_known > 2.0 * known, "{known}, {not_known}");
}

/// Wheels that come a quarter of a second after scans of their time: with enough lateness nothing is lost, to the end.
#[test]
fn late_wheels_are_waited_for() {
    let drive = simulate_calibration(&driving_on(15.0), &Token::new()).unwrap();
    let (ordered, plain) = (messages(&drive, false), settings(TRICYCLE));
    let arrival = |m: &Message| m.end() + if matches!(m, Message::Wheels(_)) { 0.25 } else { 0.0 };
    let mut late = ordered.clone();
    late.sort_by(|a, b| arrival(a).total_cmp(&arrival(b)));
    let (whole, waited) = (run(&plain, &ordered), run(&Settings { lateness: 0.3, ..plain.clone() }, &late));
    let (whole, waited) = (whole.unwrap(), waited.unwrap());
    assert_eq!(waited.calibration.vehicle, whole.calibration.vehicle);
    assert_eq!(waited.log.span(), whole.log.span());
}

#[test]
fn poses_of_the_sensor_serve_as_well() {
    let scenario = scenario(TRICYCLE, 4);
    let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
    let mount = scenario.scanner.mount;
    let mount = Se2::new(mount[0], mount[1], mount[2]);
    let mut all: Vec<Message> =
        messages(&drive, false).into_iter().filter(|m| matches!(m, Message::Wheels(_))).collect();
    let poses = drive.scans.iter().zip(&drive.scan_poses);
    all.extend(poses.map(|(s, pose)| Message::Odometry(Odometry { stamp: s.stamp, pose: *pose * mount })));
    all.sort_by(|a, b| a.stamp().total_cmp(&b.stamp()));
    let settings = Settings { source: Source::Poses, ..settings(TRICYCLE) };
    let found = run(&settings, &all).unwrap();
    assert!(found.motions.covariances.is_none());
    assert!((value(&found, "laser_x").0 - mount.x()).abs() < 3e-3);
    assert!((value(&found, "laser_yaw").0 - mount.theta()).abs() < 2e-3);
}

/// Distances, turns and the path of the laser against the simulated poses, of a drive that turns both ways and back.
#[test]
fn what_the_wheels_did_is_what_was_driven() {
    for drivetrain in [TRICYCLE, DIFFERENTIAL] {
        let scenario = CalibrationScenario { delay: 0.2, ..scenario(drivetrain, 6) };
        let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
        let settings = Settings { delay: 0.2, ..settings(drivetrain) };
        let found = run(&settings, &messages(&drive, false)).unwrap();
        let at = |t: f64| drive.scan_poses[drive.scans.partition_point(|s| s.stamp < t).min(drive.scans.len() - 1)];
        let driven = found.driven();
        assert!(driven.iter().any(|d| d.x < 0.0) && driven.iter().any(|d| d.y < 0.0));
        for (m, d) in found.motions.motions.iter().zip(&driven) {
            let (from, to) = (at(m.start), at(m.end));
            let chord = from.between(&to);
            let radius = d.x / d.y;
            assert!((groma_geometry::wrap(d.y - chord.theta())).abs() < 0.02, "{d} {chord:?}");
            assert!((2.0 * radius * (d.y / 2.0).sin()).abs() - chord.translation.norm() < 0.03, "{d} {chord:?}");
            assert!(d.x.signum() == chord.x().signum() || d.y.abs() > 3.0, "{d} {chord:?}");
        }
        let [x, y, yaw] = scenario.scanner.mount;
        let (laser, start) = (Se2::new(x, y, yaw), at(drive.stamps[0]));
        let paths = found.laser_paths();
        let ends = paths.iter().flat_map(|p| [p.told.last().unwrap(), p.measured.last().unwrap()]);
        let truth = start.between(&(at(found.motions.motions.last().unwrap().end) * laser)).translation;
        for end in ends.skip(2 * (paths.len() - 1)) {
            assert!((end - truth).norm() < 0.2, "{end} {truth}");
        }
        let count: usize = paths.iter().map(|p| p.measured.len() - 1).sum();
        assert_eq!(count, found.motions.motions.len());
    }
}

/// A result that was made, spoilt in one way after the other.
#[test]
fn what_contradicts_a_result_is_told_and_what_is_not_known_well_enough() {
    let drive = simulate_calibration(&driving_on(12.0), &Token::new()).unwrap();
    let mut found = run(&settings(TRICYCLE), &messages(&drive, false)).unwrap().calibration;
    let is_told = |found: &Calibration| {
        judgement::findings(found, SegmentKind::Windows).iter().any(|f| f.code == Code::ModelMisfit)
    };
    let mut spoil = |noise: f64, p: f64| {
        found.noise_scale = noise;
        found.tests.iter_mut().for_each(|t| t.p_value = p);
        is_told(&found)
    };
    assert!(!spoil(1.2, 0.05));
    assert!(spoil(4.0, 0.05) && spoil(1.2, 1e-4));
    let width = found.half_widths(CONFIDENCE)[found.layout.position("laser_yaw").unwrap()];
    let lacks = |tolerance: f64| missed(&found, &BTreeMap::from([("laser_yaw".to_string(), tolerance)]));
    assert!(lacks(1.01 * width).is_empty());
    assert!(lacks(width / 3.0)[0].text.contains("9.0 times"), "{:?}", lacks(width / 3.0));
}

/// Poses of the sensor every 0.4 s, of a vehicle whose steering encoder is geared.
#[test]
fn rare_poses_are_used_all_and_a_gain_that_is_known_as_it_is_told() {
    let geared = Drivetrain::Tricycle {
        drive_scale: 0.125,
        wheelbase: 1.5,
        steering_gain: 0.8,
        steering_offset_forward: 0.02,
        steering_offset_backward: 0.02,
    };
    let scenario = CalibrationScenario { drivetrain: geared, ..driving_on(20.0) };
    let drive = simulate_calibration(&scenario, &Token::new()).unwrap();
    let [x, y, yaw] = scenario.scanner.mount;
    let mut all: Vec<Message> =
        messages(&drive, false).into_iter().filter(|m| matches!(m, Message::Wheels(_))).collect();
    let rare = drive.scans.iter().zip(&drive.scan_poses).step_by(2);
    all.extend(rare.map(|(s, pose)| Message::Odometry(Odometry { stamp: s.stamp, pose: *pose * Se2::new(x, y, yaw) })));
    all.sort_by(|a, b| a.stamp().total_cmp(&b.stamp()));
    let found = run(&Settings { source: Source::Poses, gain: 0.8, ..settings(geared) }, &all).unwrap();
    assert!(found.motions.motions.len() > 44, "{} motions", found.motions.motions.len());
    let (offset, _) = value(&found, "steering_offset");
    assert!((offset - 0.02).abs() < 2e-3 && (value(&found, "laser_x").0 - x).abs() < 0.01, "{offset}");
}

#[test]
fn cancelled_work_ends_at_once() {
    let drive = simulate_calibration(&driving_on(10.0), &Token::new()).unwrap();
    let mut asked = machine(&settings(TRICYCLE), &messages(&drive, false));
    let token = Token::new();
    token.cancel();
    assert_eq!(asked.finish(&token).unwrap_err(), Error::Cancelled(Cancelled));
    assert!(asked.finish(&Token::new()).is_ok(), "and can be finished again");
}

#[test]
fn what_came_to_nothing_is_told() {
    let still = |stamp: f64| Message::Wheels(WheelReading { stamp, positions: vec![(0, 1.0), (1, 0.0)] });
    let stood: Vec<Message> = (0..200).map(|k| still(0.02 * f64::from(k))).collect();
    let settings = settings(TRICYCLE);
    assert!(matches!(run(&settings, &stood).unwrap_err(), Error::NoMotion(_)));
    assert_eq!(run(&settings, &stood[..2]).unwrap_err(), Error::FewReadings(2));
    let drive = simulate_calibration(&driving_on(3.0), &Token::new()).unwrap();
    let wheels: Vec<Message> =
        messages(&drive, false).into_iter().filter(|m| matches!(m, Message::Wheels(_))).collect();
    let text = run(&settings, &wheels).unwrap_err().to_string();
    assert!(text.contains("no scan at one of its ends"), "{text}");
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let refused = |settings: Settings| CalibrateVehicle::new(settings).err().unwrap().to_string();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        assert!(refused(Settings { window: Some(bad), ..Settings::default() }).starts_with("window"));
    }
    assert!(refused(Settings { lateness: 1e300, ..Settings::default() }).starts_with("lateness"));
    assert!(refused(Settings { model: Some("bicycle".into()), ..Settings::default() }).contains("bicycle"));
}

/// Two seconds of driving, and then so many of something else: how many scans at 50 Hz are kept of the rest.
fn kept_of(seconds: usize, then: [f64; 2]) -> usize {
    let mut keeping = Keeping::new(groma_models::WheelKind::Differential, None);
    let mut row = |k: usize| {
        let end = 0.02 * k as f64;
        let input = if k < 100 { nalgebra::Vector2::repeat(1.0) } else { nalgebra::Vector2::from(then) };
        let step = Some(crate::wheels::WheelStep { start: end - 0.02, end, input });
        keeping.read(&crate::wheels::WheelRow { stamp: end, reading: input * k as f64, step });
        keeping.decide(end + 0.001).keep
    };
    (0..100 + 50 * seconds).filter(|k| row(*k) && *k >= 100).count()
}

/// What is kept of a long drive is bounded by its windows and stops; a creeping robot, or turns with one wheel, does not stand.
#[test]
fn a_long_standstill_keeps_few_scans() {
    let kept = kept_of(400, [0.0, 0.0]);
    assert!((800..900).contains(&kept), "two a second, and fifty: {kept}");
    assert_eq!(kept_of(400, [0.001, 0.0]), kept, "a thousandth of the pace");
    for creeps in [[0.1, 0.1], [0.1, 0.0], [0.0, -0.1]] {
        let kept = kept_of(10, creeps);
        assert!((19..=21).contains(&kept), "two a second: {kept} of {creeps:?}");
    }
}

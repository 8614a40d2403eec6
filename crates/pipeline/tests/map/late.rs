//! Odometry that comes later than its scans: extrapolated at first, corrected when it comes.

use crate::feed::{Arrival, arrivals, codes, errors, estimate, fed, in_turn, laps, mapped};
use groma_geometry::Se2;
use groma_mapping::options::Options;
use groma_models::{LaserScan, Odometry};
use groma_pipeline::Message;

/// Odometry that is collected and comes every `period` seconds.
fn in_bursts(all: &[Arrival], period: f64) -> Vec<Arrival> {
    let due = |(at, message): &Arrival| match message {
        Message::Odometry(_) => ((at / period).ceil() * period, message.clone()),
        _ => (*at, message.clone()),
    };
    in_turn(all.iter().map(due).collect())
}

#[test]
fn odometry_up_to_half_a_second_late_gives_the_same_map() {
    let (simulated, mount) = laps(3);
    let run = |all: &[Arrival]| mapped(&Options::default(), mount, all);
    let timely = arrivals(&simulated.scans, &simulated.odometry, 0.0);
    let in_time = run(&timely);
    assert!(errors(&simulated, &in_time).1 < 0.05 && !codes(&in_time).contains(&"odometry-late"));
    for delay in [0.05, 0.25, 0.5] {
        let late = run(&arrivals(&simulated.scans, &simulated.odometry, delay));
        assert!(estimate(&late) == estimate(&in_time), "{delay} s late");
        assert_eq!(codes(&late).contains(&"odometry-late"), delay > 0.2, "{delay} s late");
    }
    for period in [0.25, 0.5] {
        let late = run(&in_bursts(&timely, period));
        assert!(estimate(&late) == estimate(&in_time), "every {period} s");
        assert!(codes(&late).contains(&"odometry-late"), "every {period} s");
    }
}

/// Nobody waits for ever: the drive is mapped by its scans, and what odometry says is learned when it comes.
#[test]
fn odometry_that_is_seconds_late_costs_little_and_is_told() {
    let (simulated, mount) = laps(3);
    let run = |delay| mapped(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, delay));
    let (timely, late) = (errors(&simulated, &run(0.0)), run(2.5));
    let found = errors(&simulated, &late);
    assert!(found.0 < 2.0 * timely.0 + 0.02 && found.1 < 2.0 * timely.1 + 0.05, "{found:?}, in time {timely:?}");
    let told = late.findings.iter().find(|f| f.code.name() == "odometry-late").unwrap();
    let longest = told.values.iter().find(|v| v.name == "longest").unwrap();
    assert!(longest.value > 2.2 && longest.value <= 2.55 && longest.unit == "s", "{longest:?}");
    let (from, to) = told.span.unwrap();
    assert!(from < simulated.scans[5].stamp && to > simulated.scans[simulated.scans.len() - 40].stamp);
}

/// What came late counts in the end: between two scans the trajectory has the shape that the odometry tells.
#[test]
fn the_trajectory_holds_all_odometry_however_late() {
    let (simulated, mount) = laps(3);
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, 0.25));
    assert!(simulated.odometry.iter().all(|o| outcome.map.trajectory.iter().any(|(t, _)| (t - o.stamp).abs() < 2e-6)));
}

/// Odometry that dies is waited for once, and not with every scan.
#[test]
fn where_odometry_has_died_scans_are_taken_as_they_come() {
    let (simulated, mount) = laps(3);
    let alive: Vec<Odometry> = simulated.odometry[..simulated.odometry.len() / 3].to_vec();
    let (end, all) = (alive[alive.len() - 1].stamp, arrivals(&simulated.scans, &alive, 0.0));
    let mut map = fed(&Options::default(), mount, &[]);
    for (at, message) in &all {
        map.push(message.clone());
        if *at > end + 2.0 && matches!(message, Message::Scan { .. }) {
            let taken = map.state().unwrap();
            let spread = taken.covariance.fixed_view::<2, 2>(0, 0).trace().sqrt();
            assert!(taken.stamp == message.stamp() && spread < 0.5, "{spread}");
        }
    }
}

/// Before any scan was taken the vehicle is where the odometry, and its twist beyond, lead from the first.
#[test]
fn the_state_counts_from_the_first_scan_though_it_waits() {
    let (simulated, mount) = laps(3);
    let at = |stamp: f64| LaserScan { stamp, ..simulated.scans[0].clone() };
    let drives = |k: i32| Odometry { stamp: 0.1 * f64::from(k), pose: Se2::new(0.08 * f64::from(k), 0.0, 0.0) };
    let all = arrivals(&[at(0.98), at(1.18)], &(0..11).map(drives).collect::<Vec<_>>(), 0.0);
    let state = fed(&Options::default(), mount, &all).state().unwrap();
    assert!(state.stamp == 1.18 && (state.pose.x() - 0.16).abs() < 0.01, "{state:?}");
}

/// The state is that of the newest scan whether its odometry has come or not, and lies within its covariance of the truth.
#[test]
fn the_state_follows_the_drive_within_its_covariance() {
    let (simulated, mount) = laps(8);
    for delay in [0.0, 0.12, 0.3] {
        let mut map = fed(&Options::default(), mount, &[]);
        assert!(map.state().is_none());
        let (mut beyond, mut asked, mut next, mut worst) = (0, 0, 0, 0.0_f64);
        for (_, message) in arrivals(&simulated.scans, &simulated.odometry, delay) {
            map.push(message.clone());
            let Message::Scan { scan, .. } = message else { continue };
            let state = map.state().unwrap();
            assert_eq!(state.stamp, scan.stamp);
            let truth = simulated.scan_poses[0].between(&simulated.scan_poses[next]);
            next += 1;
            let e = state.pose.minus(&truth);
            worst = worst.max(e.xy().norm());
            if let Some(information) = state.covariance.try_inverse().filter(|_| next > 20) {
                asked += 1;
                beyond += usize::from(e.dot(&(information * e)) > 16.27); // 0.1 % of chi-square with 3 degrees of freedom
            }
        }
        assert!(asked > 100 && beyond * 20 < asked, "{delay} s late: {beyond} of {asked}");
        assert!(worst < 0.1 + 0.5 * delay, "{delay} s late: {worst} m off");
        let state = map.state().unwrap();
        assert!(state.keyframes > 50 && state.local_maps > 2 && state.closures > 0);
    }
}

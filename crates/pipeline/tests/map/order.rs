//! Order of arrival: what is late, what is shuffled, what is asked on the way.

use crate::feed::{Arrival, arrivals, bytes, errors, fed, in_turn, laps, mapped};
use groma_mapping::options::Options;
use groma_models::Token;
use groma_pipeline::Message;

/// Late odometry: extrapolated at first, known later. The map hardly differs.
#[test]
fn odometry_that_comes_late_gives_nearly_the_same_map() {
    let (simulated, mount) = laps(3);
    let run = |delay| mapped(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, delay));
    let timely = errors(&simulated, &run(0.0));
    assert!(timely.1 < 0.05, "{timely:?}");
    for delay in [0.03, 0.12, 0.25] {
        let late = errors(&simulated, &run(delay));
        assert!(late.0 < timely.0 + 0.01 && late.1 < timely.1 + 0.02, "{delay} s: {late:?}, in time {timely:?}");
    }
}

/// What came late counts in the end: between two scans the trajectory has the shape that the odometry tells.
#[test]
fn the_trajectory_holds_all_odometry_however_late() {
    let (simulated, mount) = laps(3);
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, 0.25));
    assert!(simulated.odometry.iter().all(|o| outcome.map.trajectory.iter().any(|(t, _)| (t - o.stamp).abs() < 2e-6)));
}

#[test]
fn who_waits_for_what_is_late_gets_the_map_of_what_is_in_time() {
    let (simulated, mount) = laps(4);
    let patient = Options { lateness: 0.4, ..Options::default() };
    let timely = mapped(&patient, mount, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    let late = mapped(&patient, mount, &arrivals(&simulated.scans, &simulated.odometry, 0.25));
    assert_eq!(bytes(&late), bytes(&timely));
}

/// Every message comes up to 0.3 s late, each by its own delay.
#[test]
fn an_order_of_arrival_shuffled_within_the_lateness_changes_nothing() {
    let (simulated, mount) = laps(5);
    let patient = Options { lateness: 0.35, ..Options::default() };
    let timely = arrivals(&simulated.scans, &simulated.odometry, 0.0);
    let delay = |k: usize| 0.3 * ((k * 7919) % 101) as f64 / 101.0;
    let shuffled: Vec<Arrival> = timely.iter().enumerate().map(|(k, (t, m))| (t + delay(k), m.clone())).collect();
    let shuffled = in_turn(shuffled);
    assert!(shuffled.windows(2).any(|w| w[0].1.stream() == w[1].1.stream() && w[0].1.stamp() > w[1].1.stamp()));
    assert_eq!(bytes(&mapped(&patient, mount, &shuffled)), bytes(&mapped(&patient, mount, &timely)));
    let hasty = mapped(&Options::default(), mount, &shuffled);
    assert!(hasty.findings.iter().any(|f| f.code.name() == "stamps-late"));
}

#[test]
fn asking_on_the_way_changes_nothing() {
    let (simulated, mount) = laps(6);
    let all = arrivals(&simulated.scans, &simulated.odometry, 0.02);
    let whole = mapped(&Options::default(), mount, &all);
    let third = all.len() / 3;
    let mut asked = fed(&Options::default(), mount, &all[..third]);
    let early = asked.snapshot(&Token::new()).unwrap();
    let cancelled = Token::new();
    cancelled.cancel();
    assert!(asked.snapshot(&cancelled).unwrap().map.is_interrupted);
    all[third..].iter().for_each(|(_, message)| {
        asked.push(message.clone());
        assert!(asked.state().is_some());
    });
    assert_eq!(bytes(&asked.finish(&Token::new()).unwrap()), bytes(&whole));
    assert_eq!(bytes(&early), bytes(&mapped(&Options::default(), mount, &all[..third])));
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let (simulated, mount) = laps(7);
    let all = arrivals(&simulated.scans, &simulated.odometry, 0.0);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bytes(&mapped(&Options::default(), mount, &all)))
    };
    assert_eq!(run(1), run(2));
}

/// The state is that of the last scan that had its turn, and lies within its covariance of the truth.
#[test]
fn the_state_follows_the_drive_within_its_covariance() {
    let (simulated, mount) = laps(8);
    let mut map = fed(&Options::default(), mount, &[]);
    assert!(map.state().is_none());
    let (mut beyond, mut asked) = (0, 0);
    let mut next = 0;
    for (_, message) in arrivals(&simulated.scans, &simulated.odometry, 0.0) {
        map.push(message.clone());
        let Message::Scan { scan, .. } = message else { continue };
        let state = map.state().unwrap();
        assert_eq!(state.stamp, scan.stamp);
        let truth = simulated.scan_poses[0].between(&simulated.scan_poses[next]);
        next += 1;
        let e = state.pose.minus(&truth);
        if let Some(information) = state.covariance.try_inverse().filter(|_| next > 20) {
            asked += 1;
            beyond += usize::from(e.dot(&(information * e)) > 16.27); // 0.1 % of chi-square with 3 degrees of freedom
        }
    }
    assert!(asked > 100 && beyond * 20 < asked, "{beyond} of {asked}");
    let state = map.state().unwrap();
    assert!(state.keyframes > 50 && state.local_maps > 2 && state.closures > 0);
}

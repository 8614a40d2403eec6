//! Order of arrival: what is shuffled, what is asked on the way, how many work.

use crate::feed::{Arrival, arrivals, bytes, fed, in_turn, laps, mapped};
use groma_mapping::options::Options;
use groma_models::{LaserScan, Token};
use groma_pipeline::Message;

#[test]
fn who_waits_for_what_is_late_gets_the_map_of_what_is_in_time() {
    let (simulated, mount) = laps(4);
    let patient = Options { lateness: 0.4, ..Options::default() };
    let timely = mapped(&patient, mount, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    let late = mapped(&patient, mount, &arrivals(&simulated.scans, &simulated.odometry, 0.25));
    assert_eq!(bytes(&late), bytes(&timely));
    assert!(timely.counts.contains(&("scans_used", simulated.scans.len() as f64)), "the last included");
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

/// A second scanner sits elsewhere and looks elsewhere: its scans are not those of the first.
#[test]
fn scans_of_another_scanner_are_passed_over() {
    let (simulated, mount) = laps(8);
    let first = arrivals(&simulated.scans, &simulated.odometry, 0.0);
    let mirrored = |stamp: f64, scan: &LaserScan| {
        let ranges = scan.ranges.iter().rev().copied().collect();
        Message::Scan { scanner: 1, scan: LaserScan { stamp, ranges, ..scan.clone() } }
    };
    let second = simulated.scans.iter().map(|s| (s.stamp + 0.02, mirrored(s.stamp + 0.01, s)));
    let both = in_turn(first.iter().cloned().chain(second).collect());
    assert_eq!(bytes(&mapped(&Options::default(), mount, &both)), bytes(&mapped(&Options::default(), mount, &first)));
}

//! Drives as messages, and maps of them.

use crate::building::{around, drive, hall, mount, scenario};
use groma_geometry::Se2;
use groma_mapping::options::Options;
use groma_models::{LaserScan, Odometry, Token};
use groma_pipeline::map::Outcome;
use groma_pipeline::{Map, Message};
use groma_simulation::{Scanner, Scenario, Simulated};

/// A message, and when it comes [s].
pub type Arrival = (f64, Message);

/// A scanner whose sweep takes 50 ms.
pub fn sweeping(seed: u64) -> Scenario {
    let still = scenario(seed);
    Scenario { scanner: Scanner { time_increment: 0.05 / 270.0, ..still.scanner }, ..still }
}

/// Twice around the block of the hall.
pub fn laps(seed: u64) -> (Simulated, Se2) {
    let scenario = sweeping(seed);
    (drive(hall(), &around(2), &scenario), mount(&scenario))
}

pub fn scan(scan: &LaserScan) -> Message {
    Message::Scan { scanner: 0, scan: scan.clone() }
}

/// Messages as they come when the odometry takes `delay` seconds longer than the scans.
pub fn arrivals(scans: &[LaserScan], odometry: &[Odometry], delay: f64) -> Vec<Arrival> {
    let mut all: Vec<Arrival> = odometry.iter().map(|o| (o.stamp + delay, Message::Odometry(*o))).collect();
    all.extend(scans.iter().map(|s| (scan(s).end(), scan(s))));
    in_turn(all)
}

/// In order of arrival; the sort is stable.
pub fn in_turn(mut all: Vec<Arrival>) -> Vec<Arrival> {
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

pub fn fed(options: &Options, mount: Se2, arrivals: &[Arrival]) -> Map {
    let mut map = Map::new(options.clone(), mount).unwrap();
    arrivals.iter().for_each(|(_, message)| map.push(message.clone()));
    map
}

pub fn mapped(options: &Options, mount: Se2, arrivals: &[Arrival]) -> Outcome {
    fed(options, mount, arrivals).finish(&Token::new()).unwrap()
}

/// All that a result holds, to the last bit.
pub fn bytes(outcome: &Outcome) -> String {
    format!("{} {:?} {:?} {}", estimate(outcome), outcome.counts, outcome.findings, outcome.verdict)
}

/// All that was estimated, to the last bit.
pub fn estimate(outcome: &Outcome) -> String {
    let map = &outcome.map;
    let parts = [
        format!("{:?} {:?} {:?}", map.stamps, map.graph, map.chi_squares),
        format!("{:?} {:?} {:?}", map.covariances, map.trajectory, map.tracked),
        format!("{:?} {:?} {:?}", map.odometry, map.grid, map.landmarks),
    ];
    parts.concat()
}

pub fn codes(outcome: &Outcome) -> Vec<&'static str> {
    let mut names: Vec<_> = outcome.findings.iter().map(|f| f.code.name()).collect();
    names.dedup();
    names
}

/// Root mean square and largest distance of the poses of the scans from the truth, both seen from the first scan [m].
pub fn errors(simulated: &Simulated, outcome: &Outcome) -> (f64, f64) {
    let pose = |stamp: f64| outcome.map.trajectory.iter().find(|(t, _)| *t == stamp).unwrap().1;
    let (start, first) = (simulated.scan_poses[0], pose(simulated.scans[0].stamp));
    let error = |(scan, truth): (&LaserScan, &Se2)| {
        (start.between(truth).translation - first.between(&pose(scan.stamp)).translation).norm()
    };
    let all: Vec<f64> = simulated.scans.iter().zip(&simulated.scan_poses).map(error).collect();
    let mean_sq = all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64;
    (mean_sq.sqrt(), all.into_iter().fold(0.0, f64::max))
}

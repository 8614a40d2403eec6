//! A map from poses that are known: landmarks and occupancy of a drive whose trajectory another system gave.
//!
//! Fed with poses ([`Message::StartPose`]) and scans. A scan waits until a pose after its stamp has come, so that the
//! vehicle is known between two poses ([`groma_mapping::known_poses`]); it waits until a message more than their greatest
//! distance in time is younger than it, for then no pose can join. Scans without a pose are left out and counted. What scans
//! show is put together as in a map whose poses were estimated ([`groma_mapping::survey`]).
//!
//! Only scanner 0 is used. Poses that come later than that need an order with as much lateness.

use crate::{Message, Order};
use groma_geometry::Se2;
use groma_mapping::known_poses::{GAP, TimedPose, between};
use groma_mapping::options::Options;
use groma_mapping::survey::{KnownPose, Survey};
use groma_models::finding::Code;
use groma_models::{Cancelled, Finding, Grid, LandmarkMap, LaserScan, Token};
use std::collections::VecDeque;

/// Poses are kept for so long: the first beam of a scan may be older than poses that came before it [s].
const KEPT: f64 = 10.0 * GAP;

/// How far the machine is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    /// Scans that came.
    pub scans: usize,
    /// Scans that the map rests on.
    pub keyframes: usize,
    /// Scans that wait for a pose.
    pub waiting: usize,
}

/// The map and how it came about.
#[derive(Clone, Debug)]
pub struct Surveyed {
    /// Occupancy in the frame of the poses.
    pub grid: Grid,
    /// Landmarks in the frame of the poses.
    pub landmarks: LandmarkMap,
    /// Scans that came, were used and still wait.
    pub state: State,
    /// What was noticed.
    pub findings: Vec<Finding>,
}

/// Scans that were left out for one reason: how many, first and last stamp [s].
#[derive(Clone, Copy, Debug, Default)]
struct Span {
    count: usize,
    from: f64,
    to: f64,
}

impl Span {
    fn add(&mut self, stamp: f64) {
        (self.from, self.to) =
            if self.count == 0 { (stamp, stamp) } else { (self.from.min(stamp), self.to.max(stamp)) };
        self.count += 1;
    }

    fn finding(&self, code: Code, what: &str) -> Option<Finding> {
        let text = format!("{} {what}", self.count);
        let finding = || Finding::new(code, text).during(self.from, self.to).with("messages", self.count as f64, "1");
        (self.count > 0).then(finding)
    }
}

/// The machine.
pub struct MapAtPoses {
    order: Order,
    t_base_laser: Se2,
    survey: Survey,
    poses: VecDeque<TimedPose>,
    waiting: VecDeque<LaserScan>,
    newest: f64,
    scans: usize,
    without_pose: Span,
}

/// What is known of the vehicle at a time.
enum Known {
    Yes(KnownPose),
    No,
    /// A pose that is still to come may tell.
    Later,
}

impl MapAtPoses {
    /// A machine for a scanner at `t_base_laser`, that waits for messages up to `lateness` [s] late.
    #[must_use]
    pub fn new(options: Options, t_base_laser: Se2, lateness: f64) -> Self {
        Self {
            order: Order::new(lateness),
            t_base_laser,
            survey: Survey::new(options),
            poses: VecDeque::new(),
            waiting: VecDeque::new(),
            newest: f64::NEG_INFINITY,
            scans: 0,
            without_pose: Span::default(),
        }
    }

    /// Takes a message; kinds other than poses and scans of scanner 0 are passed over.
    pub fn push(&mut self, message: Message) {
        for message in self.order.push(message) {
            self.take(message);
        }
    }

    /// How far it is.
    #[must_use]
    pub fn state(&self) -> State {
        State { scans: self.scans, keyframes: self.survey.len(), waiting: self.waiting.len() }
    }

    /// The map of what has come so far, without the scans that wait.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn snapshot(&self, token: &Token) -> Result<Surveyed, Cancelled> {
        let (grid, landmarks) = self.survey.finish(token)?;
        Ok(Surveyed { grid, landmarks, state: self.state(), findings: self.findings() })
    }

    /// The map of all that has come.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn finish(mut self, token: &Token) -> Result<Surveyed, Cancelled> {
        for message in self.order.drain() {
            self.take(message);
        }
        self.newest = f64::INFINITY;
        self.settle();
        self.snapshot(token)
    }

    fn take(&mut self, message: Message) {
        self.newest = self.newest.max(message.stamp());
        match message {
            Message::StartPose(p) => {
                self.learn(TimedPose { stamp: p.stamp, pose: p.pose, covariance: p.covariance });
            }
            Message::Scan { scanner: 0, scan } => {
                self.scans += 1;
                self.waiting.push_back(scan);
            }
            _ => return,
        }
        self.settle();
    }

    fn learn(&mut self, pose: TimedPose) {
        self.poses.push_back(pose);
        let oldest = self.waiting.front().map_or(pose.stamp, |scan| scan.stamp.min(pose.stamp)) - KEPT;
        while self.poses.front().is_some_and(|p| p.stamp < oldest) {
            self.poses.pop_front();
        }
    }

    /// Takes in the scans whose pose is known by now, in the order of their arrival.
    fn settle(&mut self) {
        while let Some(scan) = self.waiting.front() {
            match self.known(scan.stamp) {
                Known::Later => return,
                Known::No => self.without_pose.add(scan.stamp),
                Known::Yes(known) => {
                    self.survey.push_scan(scan, &self.t_base_laser, &known);
                }
            }
            self.waiting.pop_front();
        }
    }

    fn known(&self, stamp: f64) -> Known {
        let after = self.poses.partition_point(|p| p.stamp <= stamp);
        let expired = self.newest > stamp + GAP;
        let pair = match (after, self.poses.len()) {
            (k, all) if k == all && !expired => return Known::Later,
            (k, all) if k == all && all > 1 => k - 1,
            (0, _) => return Known::No,
            (k, _) => k,
        };
        let ends = self.poses.get(pair - 1).zip(self.poses.get(pair));
        ends.and_then(|(a, b)| between(a, b, stamp)).map_or(Known::No, Known::Yes)
    }

    fn findings(&self) -> Vec<Finding> {
        let none = self.survey.is_empty();
        let text = "no scan was taken at a known pose: do the stamps of scans and poses belong together?";
        let nothing = none.then(|| Finding::new(Code::NoEstimate, text));
        let without = self.without_pose.finding(Code::ScansWithoutPose, "scans were taken where no pose is known");
        nothing.into_iter().chain(without).chain(self.order.findings()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::message::StartPose;
    use groma_models::{BeamGeometry, Cell};
    use nalgebra::{Matrix3, Vector2};
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    const BEAMS: usize = 720;
    /// Half the inner length and width of a room [m].
    const HALF: (f64, f64) = (5.02, 3.02);
    /// Duration of a sweep [s].
    const SWEEP: f64 = 0.09;

    fn mount() -> Se2 {
        Se2::new(0.3, -0.1, 0.5)
    }

    /// Driving round in the room, to the left.
    fn truth(stamp: f64) -> Se2 {
        let angle = 0.8 * (stamp - 100.0);
        Se2::new(1.2 * angle.sin() - 0.5, -1.2 * angle.cos(), angle)
    }

    /// A sweep that lasts, taken while the vehicle goes on.
    fn scan(stamp: f64) -> Message {
        let geometry = BeamGeometry {
            angle_min: -PI,
            angle_increment: TAU / BEAMS as f64,
            time_increment: SWEEP / BEAMS as f64,
            range_min: 0.05,
            range_max: 30.0,
        };
        let read = |i: usize| {
            let laser = truth(stamp + i as f64 * geometry.time_increment) * mount();
            let d = laser.rotation.act(Vector2::new(geometry.bearing(i).cos(), geometry.bearing(i).sin()));
            let wall = |p: f64, v: f64, half: f64| if v == 0.0 { f64::INFINITY } else { (half * v.signum() - p) / v };
            wall(laser.translation.x, d.x, HALF.0).min(wall(laser.translation.y, d.y, HALF.1))
        };
        let ranges = (0..BEAMS).map(read).collect();
        Message::Scan { scanner: 0, scan: LaserScan { stamp, geometry, ranges, intensities: vec![] } }
    }

    fn pose(stamp: f64) -> Message {
        Message::StartPose(StartPose { stamp, pose: truth(stamp), covariance: Matrix3::identity() * 1e-6 })
    }

    fn run(messages: impl IntoIterator<Item = Message>) -> Surveyed {
        let mut machine = MapAtPoses::new(Options::default(), mount(), 0.0);
        messages.into_iter().for_each(|m| machine.push(m));
        machine.finish(&Token::new()).unwrap()
    }

    /// Poses every 0.2 s and scans between them, by stamp.
    fn drive(scans: usize) -> Vec<Message> {
        let scans = (0..scans).map(|k| scan(100.03 + 0.25 * k as f64));
        let poses = (0..200).map(|k| pose(99.9 + 0.2 * f64::from(k)));
        let mut all: Vec<Message> = scans.chain(poses).collect();
        all.sort_by(|a, b| a.stamp().total_cmp(&b.stamp()));
        all
    }

    fn codes(result: &Surveyed) -> Vec<Code> {
        result.findings.iter().map(|f| f.code).collect()
    }

    #[test]
    fn corners_of_a_room_come_where_they_are_though_the_vehicle_turns_while_it_scans() {
        let result = run(drive(30));
        assert_eq!(result.findings, []);
        assert_eq!((result.state.scans, result.state.waiting), (30, 0));
        let corners: Vec<_> = result.landmarks.landmarks.iter().map(|l| l.position).collect();
        for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            let corner = Vector2::new(x * HALF.0, y * HALF.1);
            let nearest = corners.iter().map(|p| (p - corner).norm()).fold(f64::INFINITY, f64::min);
            assert!(nearest < 0.02, "{corner:?}: {nearest} m off");
        }
        assert!(corners.len() <= 6, "{corners:?}");
        assert!(result.grid.cells.contains(&Cell::Occupied));
    }

    #[test]
    fn scans_before_after_and_in_a_pause_of_the_poses_are_counted() {
        let poses = |from: f64, to: f64| (0..).map(move |k| from + 0.2 * f64::from(k)).take_while(move |t| *t < to);
        let known = poses(100.0, 103.9).chain(poses(110.0, 111.9)).map(pose);
        let mut all: Vec<Message> = known.chain((0..60).map(|k| scan(98.03 + 0.25 * f64::from(k)))).collect();
        all.sort_by(|a, b| a.stamp().total_cmp(&b.stamp()));
        let result = run(all);
        assert_eq!(codes(&result), [Code::ScansWithoutPose]);
        // 98.03 .. 99.78, 104.03 .. 109.78 and 112.03 .. 112.78
        let found = &result.findings[0];
        assert_eq!(found.values[0].value, f64::from(8 + 24 + 4));
        let (from, to) = found.span.unwrap();
        assert!((from - 98.03).abs() < 1e-9 && (to - 112.78).abs() < 1e-9);
    }

    #[test]
    fn a_scan_waits_for_the_pose_after_it_and_not_for_ever() {
        let mut machine = MapAtPoses::new(Options::default(), mount(), 0.0);
        machine.push(pose(100.0));
        machine.push(scan(100.1));
        machine.push(scan(100.15));
        assert_eq!(machine.state(), State { scans: 2, keyframes: 0, waiting: 2 });
        machine.push(pose(100.2));
        assert_eq!(machine.state(), State { scans: 2, keyframes: 1, waiting: 0 });
        machine.push(scan(100.3));
        machine.push(scan(102.0));
        assert_eq!(machine.state(), State { scans: 4, keyframes: 1, waiting: 1 });
    }

    #[test]
    fn a_scan_at_the_stamp_of_the_last_pose_is_used() {
        let result = run([pose(100.0), pose(100.2), scan(100.2)]);
        assert_eq!((result.state.keyframes, result.findings), (1, vec![]));
    }

    #[test]
    fn stamps_of_other_units_leave_no_map() {
        let scans = drive(8).into_iter().map(|m| match m {
            Message::StartPose(p) => Message::StartPose(StartPose { stamp: p.stamp * 1000.0, ..p }),
            other => other,
        });
        let result = run(scans);
        assert_eq!(codes(&result)[0], Code::NoEstimate);
        assert_eq!(result.state.keyframes, 0);
    }

    #[test]
    fn poses_without_number_are_counted_and_do_not_spoil_their_neighbours() {
        let broken = Message::StartPose(StartPose {
            stamp: 100.1,
            pose: Se2::new(f64::NAN, 0.0, 0.0),
            covariance: Matrix3::zeros(),
        });
        let result = run([pose(100.0), broken, scan(100.1), pose(100.2)]);
        assert_eq!((result.state.keyframes, codes(&result)), (1, vec![Code::ValuesInvalid]));
    }

    #[test]
    fn a_snapshot_is_the_map_of_what_has_come_and_finishing_goes_on_from_there() {
        let all = drive(12);
        let mut machine = MapAtPoses::new(Options::default(), mount(), 0.0);
        let half = all.len() / 2;
        all[..half].iter().cloned().for_each(|m| machine.push(m));
        let before = machine.snapshot(&Token::new()).unwrap().state;
        all[half..].iter().cloned().for_each(|m| machine.push(m));
        let after = machine.finish(&Token::new()).unwrap();
        assert!(before.keyframes < after.state.keyframes || before.scans == after.state.scans);
        assert_eq!(after.landmarks, run(all).landmarks);
        let cancelled = Token::new();
        cancelled.cancel();
        assert!(MapAtPoses::new(Options::default(), mount(), 0.0).finish(&cancelled).is_err());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        /// Live, poses come later than the scans they belong to: with as much lateness the map is the same.
        #[test]
        fn late_poses_make_the_same_map(delay in 0.0..0.4_f64) {
            let mut all = drive(6);
            let arrival = |m: &Message| m.end() + if matches!(m, Message::StartPose(_)) { delay } else { 0.0 };
            all.sort_by(|a, b| arrival(a).total_cmp(&arrival(b)));
            let mut machine = MapAtPoses::new(Options::default(), mount(), 0.5);
            all.into_iter().for_each(|m| machine.push(m));
            let late = machine.finish(&Token::new()).unwrap();
            let ordered = run(drive(6));
            prop_assert_eq!(late.state, ordered.state);
            prop_assert_eq!(late.landmarks, ordered.landmarks);
        }
    }
}

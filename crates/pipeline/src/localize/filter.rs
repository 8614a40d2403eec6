//! The localizer fed with motions and scans as they come.
//!
//! While motions are ahead of scans, each is taken when it comes. A scan that ends after the last motion is taken at a pose
//! extrapolated to its end, and the state before it is kept. When a motion comes that covers the end of the scan, the state is
//! set back, moved by what the readings say, and takes the scan again, associations included, and those after it: once its
//! motion has come, a pose is that of a drive whose motions were in time. Scans before the first reading wait for it too.
//!
//! In a pause of the readings scans may know better how the vehicle moved than a straight line between two readings: where the
//! extrapolation follows from scans that constrained the pose, and its covariance is smaller than what interpolation leaves
//! open, it stays. Motions more than `WAIT` late are not waited for; at most `MOST` scans are kept for taking again.

use super::ahead::Twist;
use super::motions::{Motions, Reading, Source, Step, position_variance, product};
use super::observe::Observer;
use super::track::{Fix, Travel};
use groma_geometry::Se2;
use groma_localization::{Error, Localizer, Observation, sees};
use groma_models::LaserScan;
use nalgebra::Matrix3;
use std::collections::VecDeque;

/// A pose that moves by more of its standard deviation counts as corrected.
const NOTABLE: f64 = 0.1;
/// Motions that are later are not waited for [s].
const WAIT: f64 = 2.0;
/// Scans kept for taking again.
const MOST: usize = 32;
/// Landmarks that hold a pose so that a twist may follow from it.
const HELD: usize = 2;

/// A localizer with its motions and what it said after each scan.
pub(super) struct Filter {
    now: Localizer,
    /// The state before the scans ahead of the motions.
    base: Option<Localizer>,
    ahead: VecDeque<Ahead>,
    motions: Motions,
    twist: Twist,
    /// The twist when the first reading that is kept came.
    entry: Twist,
    /// Time of the first message [s].
    begun: f64,
    observer: Observer,
    /// Driven since the last fix.
    travel: Travel,
    pub track: Vec<Fix>,
}

/// A fix that is new or was taken again, and its scan once nothing can change it any more.
pub(super) struct Change {
    pub index: usize,
    /// Whether it is new.
    pub new: bool,
    /// Whether it moved notably.
    pub corrected: bool,
    pub settled: Option<LaserScan>,
}

/// A scan and what is needed to take it again.
struct Ahead {
    scan: LaserScan,
    observations: Vec<Observation>,
    index: usize,
    /// When it ends [s].
    end: f64,
    /// The motion from the scan before, or from the last motion, its end by extrapolation.
    steps: Vec<Step>,
    /// Whether the twist was that of scans.
    by_scans: bool,
    /// Driven between the fix before and the begin of that motion.
    before: Travel,
}

impl Filter {
    pub fn new(localizer: Localizer, source: Source) -> Self {
        let (begun, twist) = (localizer.stamp(), Twist::unknown(localizer.stamp()));
        Self {
            now: localizer,
            base: None,
            ahead: VecDeque::new(),
            motions: Motions::new(source),
            twist,
            entry: twist,
            begun,
            observer: Observer::default(),
            travel: Travel::default(),
            track: Vec::new(),
        }
    }

    /// Begins at a time: the first message has come.
    pub fn start(&mut self, stamp: f64) {
        self.now = self.now.clone().starting_at(stamp);
        self.twist = Twist::unknown(stamp);
        self.begun = stamp;
    }

    /// The state now.
    pub fn localizer(&self) -> &Localizer {
        &self.now
    }

    /// The next reading does not hang together with those before.
    pub fn restart(&mut self) {
        self.motions.restart();
    }

    /// Takes a reading of the motions.
    pub fn read(&mut self, stamp: f64, reading: Reading) -> Vec<Change> {
        if self.motions.last().is_none() {
            self.entry = self.twist;
        }
        if !self.motions.push(stamp, reading) {
            return Vec::new();
        }
        self.twist = self.motions.twist().unwrap_or(self.twist);
        let changes = self.settle(stamp);
        if self.ahead.is_empty() {
            self.advance(stamp);
        }
        // A start pose may be told as late as a motion.
        self.motions.forget_before(self.base.as_ref().unwrap_or(&self.now).stamp() - WAIT);
        changes
    }

    /// Takes a scan.
    pub fn take(&mut self, scan: LaserScan) -> Vec<Change> {
        let observations = self.observer.observe(&scan);
        let end = end_of(&scan).max(self.now.stamp());
        let behind = end - self.motions.last().unwrap_or(self.begun);
        let mut changes = if behind > WAIT { self.release() } else { Vec::new() };
        if (behind > 0.0 && behind <= WAIT) || self.base.is_some() {
            self.base.get_or_insert_with(|| self.now.clone());
        }
        let (steps, by_scans) = (self.steps(self.now.stamp(), end), self.twist.by_scans);
        let (index, before) = (self.track.len(), std::mem::take(&mut self.travel));
        let ahead = Ahead { scan, observations, index, end, steps, by_scans, before };
        let fix = ahead.take(&mut self.now, &ahead.steps);
        self.track.push(Fix { extrapolated: behind.max(0.0), ..fix });
        self.follow(index);
        let settled = if self.base.is_some() {
            self.ahead.push_back(ahead);
            None
        } else {
            Some(ahead.scan)
        };
        changes.push(Change { index, new: true, corrected: false, settled });
        changes.extend(self.limit());
        changes
    }

    /// Puts the vehicle where it was at a time, as somebody says; scans ahead stay as they are.
    pub fn relocate(&mut self, stamp: f64, pose: Se2, covariance: &Matrix3<f64>) -> Result<Vec<Change>, Error> {
        let changes = self.release();
        let since = product(self.steps(stamp, self.now.stamp()).iter().map(|s| &s.motion));
        let back = since.motion.inverse().adjoint();
        let covariance = back * covariance * back.transpose() + since.covariance;
        self.now.relocate(pose * since.motion, &(0.5 * (covariance + covariance.transpose())))?;
        Ok(changes)
    }

    /// Takes all scans as they are.
    pub fn release(&mut self) -> Vec<Change> {
        self.base = None;
        let settled = |a: Ahead| Change { index: a.index, new: false, corrected: false, settled: Some(a.scan) };
        self.ahead.drain(..).map(settled).collect()
    }

    /// Moves on to the last reading.
    fn advance(&mut self, stamp: f64) {
        let steps = self.steps(self.now.stamp(), stamp);
        drive(&mut self.now, &steps, &mut self.travel);
    }

    /// The motion from one time to another: that of the readings as far as they reach, around them by the twists.
    fn steps(&self, from: f64, to: f64) -> Vec<Step> {
        let (first, last) = self.motions.first().zip(self.motions.last()).unwrap_or((from, from));
        let (begin, end) = (first.max(from).min(to), last.max(from).min(to));
        let mut steps = Vec::new();
        if begin > from {
            steps.push(Step { stamp: begin, motion: self.entry.motion(from, begin) });
        }
        steps.extend(self.motions.steps(begin, end));
        if to > end {
            steps.push(Step { stamp: to, motion: self.twist.motion(end, to) });
        }
        steps
    }

    /// Takes the scans ahead that the readings cover now by what the readings say, and those after them again.
    fn settle(&mut self, last: f64) -> Vec<Change> {
        let mut changes = Vec::new();
        while self.ahead.front().is_some_and(|a| a.end <= last) {
            let (Some(front), Some(mut base)) = (self.ahead.pop_front(), self.base.take()) else { break };
            let steps = self.settled(&front, base.stamp());
            let fix = front.take(&mut base, &steps);
            self.base = Some(base);
            changes.push(self.replace(front.index, fix, Some(front.scan)));
        }
        if !changes.is_empty() {
            changes.extend(self.again());
        }
        changes
    }

    /// The motion to a scan that the readings cover, from a time on.
    fn settled(&self, ahead: &Ahead, from: f64) -> Vec<Step> {
        let taken = product(ahead.steps.iter().map(|s| &s.motion)).covariance;
        let open = self.motions.open_at(from) + self.motions.open_at(ahead.end);
        let paused = ahead.by_scans && open > position_variance(&taken);
        let before = self.motions.first().is_none_or(|first| first >= ahead.end);
        if paused || before { ahead.steps.clone() } else { self.steps(from, ahead.end) }
    }

    /// Takes the scans that are still ahead from the state that was corrected.
    fn again(&mut self) -> Vec<Change> {
        let Some(base) = self.base.take() else { return Vec::new() };
        self.now = base;
        self.base = (!self.ahead.is_empty()).then(|| self.now.clone());
        let mut changes = Vec::new();
        for k in 0..self.ahead.len() {
            let (index, from, to) = (self.ahead[k].index, self.now.stamp(), self.ahead[k].end);
            (self.ahead[k].steps, self.ahead[k].by_scans) = (self.steps(from, to), self.twist.by_scans);
            let fix = self.ahead[k].take(&mut self.now, &self.ahead[k].steps);
            changes.push(self.replace(index, fix, None));
            self.follow(index);
        }
        changes
    }

    /// Puts a fix in the place of the one that represents its scan.
    fn replace(&mut self, index: usize, fix: Fix, settled: Option<LaserScan>) -> Change {
        let before = &mut self.track[index];
        let corrected = fix.is_off(before, NOTABLE);
        *before = Fix { extrapolated: before.extrapolated, corrected: before.corrected || corrected, ..fix };
        Change { index, new: false, corrected, settled }
    }

    /// Lets go of the oldest scan ahead where there are too many.
    fn limit(&mut self) -> Vec<Change> {
        if self.ahead.len() <= MOST {
            return Vec::new();
        }
        let (Some(front), Some(base)) = (self.ahead.pop_front(), &mut self.base) else { return Vec::new() };
        front.take(base, &front.steps);
        vec![Change { index: front.index, new: false, corrected: false, settled: Some(front.scan) }]
    }

    /// The twist between the last two fixes, where that is better known than the one that the motions left.
    fn follow(&mut self, index: usize) {
        let Some(pair) = index.checked_sub(1).and_then(|k| self.track.get(k..=index)) else { return };
        if pair.iter().any(|fix| !fix.is_known() || fix.quality.matched < HELD) {
            return;
        }
        let [from, to] = [&pair[0], &pair[1]].map(|fix| (fix.stamp, &fix.pose, &fix.covariance));
        let better = Twist::between(from, to).filter(|t| t.sigma(to.0) < self.twist.sigma(to.0));
        self.twist = better.unwrap_or(self.twist);
    }
}

impl Ahead {
    /// Lets a localizer drive to the scan and take it.
    fn take(&self, localizer: &mut Localizer, steps: &[Step]) -> Fix {
        let mut travel = self.before;
        drive(localizer, steps, &mut travel);
        localizer.look(&self.scan);
        let view = |polar| sees(&self.scan.geometry, &self.scan.ranges, polar);
        let update = localizer.update(&self.observations, Some(&view));
        Fix::new(localizer, &update, travel)
    }
}

/// Moves a localizer; a motion that it refuses is none.
fn drive(localizer: &mut Localizer, steps: &[Step], travel: &mut Travel) {
    for step in steps {
        if localizer.predict(step.stamp, &step.motion).is_ok() {
            travel.add(&step.motion.motion);
        }
    }
}

/// Time of the last beam [s].
fn end_of(scan: &LaserScan) -> f64 {
    scan.stamp.max(scan.beam_stamp(scan.ranges.len().saturating_sub(1)))
}

//! The localizer fed with motions and scans as they come.
//!
//! While motions are ahead of scans, each is taken when it comes. A scan that ends after the last motion is taken at a pose
//! extrapolated to its end, and the state before it is kept. When a motion comes that covers the end of the scan,
//!
//! ```text
//! d = log(E^-1 R)        E the motion by extrapolation, R that of the readings
//! d^T P^-1 d <= SHARE^2  the scan stays as it was taken; d goes into the next motion, so that nothing is lost
//! else                   the state is set back, moved by R, and takes the scan again, and those after it
//! ```
//!
//! P is the covariance of the pose after the scan: a pose that was kept is off by less than `SHARE` of its standard deviation.
//! Where R is worse known than E (a long gap in the readings, while scans held the pose), E stays. Motions more than `WAIT` late
//! are not waited for; at most `MOST` scans are kept for taking again.

use super::ahead::Twist;
use super::motions::{Motions, Reading, Source, Step, product};
use super::observe::Observer;
use super::track::{Fix, Travel};
use groma_geometry::Se2;
use groma_localization::{Error, Localizer, Motion, Observation, sees};
use groma_models::LaserScan;
use nalgebra::Matrix3;
use std::collections::VecDeque;

/// Of the standard deviation of a pose: so far off it stays.
const SHARE: f64 = 0.1;
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
    observer: Observer,
    /// Driven since the last fix.
    travel: Travel,
    /// What the readings say beside the extrapolation that was kept.
    carry: Se2,
    pub track: Vec<Fix>,
}

/// A fix that is new or was set right, and its scan once nothing can change it any more.
pub(super) struct Change {
    pub index: usize,
    pub corrected: bool,
    pub settled: Option<LaserScan>,
}

/// A scan and what is needed to take it again.
struct Ahead {
    scan: LaserScan,
    observations: Vec<Observation>,
    index: usize,
    /// The motion by extrapolation from the scan before, or from the last motion.
    step: Step,
    /// Driven between the fix before and the begin of that motion.
    before: Travel,
}

impl Filter {
    pub fn new(localizer: Localizer, source: Source) -> Self {
        Self {
            twist: Twist::unknown(localizer.stamp()),
            now: localizer,
            base: None,
            ahead: VecDeque::new(),
            motions: Motions::new(source),
            observer: Observer::default(),
            travel: Travel::default(),
            carry: Se2::IDENTITY,
            track: Vec::new(),
        }
    }

    /// Begins at a time: the first message has come.
    pub fn start(&mut self, stamp: f64) {
        self.now = self.now.clone().starting_at(stamp);
        self.twist = Twist::unknown(stamp);
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
        if !self.motions.push(stamp, reading) {
            return Vec::new();
        }
        self.twist = self.motions.twist().unwrap_or(self.twist);
        let changes = self.settle(stamp);
        if self.ahead.is_empty() {
            self.advance(stamp);
        }
        self.motions.forget_before(self.base.as_ref().unwrap_or(&self.now).stamp());
        changes
    }

    /// Takes a scan.
    pub fn take(&mut self, scan: LaserScan) -> Vec<Change> {
        let observations = self.observer.observe(&scan);
        let end = end_of(&scan).max(self.now.stamp());
        let behind = self.motions.last().map_or(f64::INFINITY, |last| end - last);
        let mut changes = if behind > WAIT { self.release() } else { Vec::new() };
        if (behind > 0.0 && behind <= WAIT) || self.base.is_some() {
            self.base.get_or_insert_with(|| self.now.clone());
        }
        let step = Step { stamp: end, motion: self.twist.motion(self.now.stamp(), end) };
        let (index, before) = (self.track.len(), std::mem::take(&mut self.travel));
        let ahead = Ahead { scan, observations, index, step, before };
        let extrapolated = if behind.is_finite() { behind.max(0.0) } else { 0.0 };
        let fix = ahead.take(&mut self.now, &[step]);
        self.track.push(Fix { extrapolated, ..fix });
        self.follow(index);
        let settled = if self.base.is_some() {
            self.ahead.push_back(ahead);
            None
        } else {
            Some(ahead.scan)
        };
        changes.push(Change { index, corrected: false, settled });
        changes.extend(self.limit());
        changes
    }

    /// Puts the vehicle where it was at a time, as somebody says; scans ahead stay as they are.
    pub fn relocate(&mut self, stamp: f64, pose: Se2, covariance: &Matrix3<f64>) -> Result<Vec<Change>, Error> {
        let changes = self.release();
        let since = product(self.motions.steps(stamp, self.now.stamp()).iter().map(|s| &s.motion));
        let back = since.motion.inverse().adjoint();
        let covariance = back * covariance * back.transpose() + since.covariance;
        self.now.relocate(pose * since.motion, &(0.5 * (covariance + covariance.transpose())))?;
        Ok(changes)
    }

    /// Takes all scans as they are.
    pub fn release(&mut self) -> Vec<Change> {
        self.base = None;
        let settled = |a: Ahead| Change { index: a.index, corrected: false, settled: Some(a.scan) };
        self.ahead.drain(..).map(settled).collect()
    }

    /// Moves on to the last reading.
    fn advance(&mut self, stamp: f64) {
        let from = self.now.stamp();
        let mut steps = self.motions.steps(from, stamp);
        if let Some(first) = self.motions.first().filter(|first| *first > from) {
            steps.insert(0, Step { stamp: first, motion: self.twist.motion(from, first) });
        }
        if let Some(step) = steps.first_mut() {
            step.motion.motion = std::mem::replace(&mut self.carry, Se2::IDENTITY) * step.motion.motion;
        }
        drive(&mut self.now, &steps, &mut self.travel);
    }

    /// Compares the scans ahead that the readings cover now with what the readings say.
    fn settle(&mut self, last: f64) -> Vec<Change> {
        let mut changes = Vec::new();
        while self.ahead.front().is_some_and(|a| a.step.stamp <= last) {
            let (Some(front), Some(mut base)) = (self.ahead.pop_front(), self.base.take()) else { break };
            let real = self.motions.steps(base.stamp(), front.step.stamp);
            let covered = self.motions.first().is_some_and(|first| first <= base.stamp());
            let mut off = Off::new(
                &front.step.motion,
                &product(real.iter().map(|s| &s.motion)),
                &self.track[front.index].covariance,
            );
            let index = front.index;
            off.worse |= !covered;
            let corrected = !off.stays();
            if !corrected && self.ahead.is_empty() {
                self.carry = off.carried();
                changes.push(Change { index, corrected, settled: Some(front.scan) });
                return changes;
            }
            let steps = if off.worse { vec![front.step] } else { real };
            let fix = front.take(&mut base, &steps);
            self.track[index] = Fix { extrapolated: self.track[index].extrapolated, corrected, ..fix };
            self.base = Some(base);
            changes.push(Change { index, corrected, settled: Some(front.scan) });
        }
        if !changes.is_empty() {
            changes.extend(self.again());
        }
        changes
    }

    /// Takes the scans that are still ahead from the state that was set right.
    fn again(&mut self) -> Vec<Change> {
        let Some(base) = self.base.take() else { return Vec::new() };
        self.now = base;
        if self.ahead.is_empty() {
            return Vec::new();
        }
        self.base = Some(self.now.clone());
        let mut changes = Vec::new();
        for k in 0..self.ahead.len() {
            let motion = self.twist.motion(self.now.stamp(), self.ahead[k].step.stamp);
            self.ahead[k].step.motion = motion;
            let (index, step) = (self.ahead[k].index, self.ahead[k].step);
            let fix = self.ahead[k].take(&mut self.now, &[step]);
            self.track[index] = Fix { extrapolated: self.track[index].extrapolated, ..fix };
            self.follow(index);
            changes.push(Change { index, corrected: true, settled: None });
        }
        changes
    }

    /// Lets go of the oldest scan ahead where there are too many.
    fn limit(&mut self) -> Vec<Change> {
        if self.ahead.len() <= MOST {
            return Vec::new();
        }
        let (Some(front), Some(base)) = (self.ahead.pop_front(), &mut self.base) else { return Vec::new() };
        front.take(base, &[front.step]);
        vec![Change { index: front.index, corrected: false, settled: Some(front.scan) }]
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

/// How far readings are from an extrapolation.
struct Off {
    difference: Se2,
    distance_sq: f64,
    /// Whether the readings say less than the extrapolation.
    worse: bool,
}

impl Off {
    fn new(extrapolated: &Motion, real: &Motion, covariance: &Matrix3<f64>) -> Self {
        let difference = extrapolated.motion.inverse() * real.motion;
        let d = difference.log();
        let distance_sq = match covariance.try_inverse() {
            Some(information) => d.dot(&(information * d)),
            None if d.norm() > 0.0 => f64::INFINITY,
            None => 0.0,
        };
        Self { difference, distance_sq, worse: real.covariance.trace() > extrapolated.covariance.trace() }
    }

    fn stays(&self) -> bool {
        self.worse || self.distance_sq <= SHARE * SHARE
    }

    /// What goes into the next motion.
    fn carried(&self) -> Se2 {
        if self.worse { Se2::IDENTITY } else { self.difference }
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

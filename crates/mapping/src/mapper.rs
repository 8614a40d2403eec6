//! The whole of mapping: scans and odometry in, a map out.
//!
//! ```text
//! scan -> tracker -> keyframes -> local maps -> closures -> pose graph of all keyframes -> trajectory, grid, landmarks
//! ```
//!
//! Scans and odometry are pushed in the order in which they came, each stream in order of time. A scan is registered at once:
//! where the odometry has not reached it yet, its last twist goes on ([`groma_tracking::extrapolation`]). When the odometry comes, the
//! next increment starts from it, and the statistics of the odometry are updated then. Not done again: the
//! registration itself, and the motion during its sweep that was taken out of its points.
//!
//! Each step looks at the past only. `Mapper::finish` may be called at any time, and again: it leaves the mapper as it is
//! (`conclude.rs`).

use crate::closer::Closer;
use crate::closure::Verdict;
use crate::finder::Finder;
use crate::keyframe::Keyframe;
use crate::local_map::LocalMap;
use crate::options::Options;
use crate::uncertainty::from_source;
use groma_geometry::Se2;
use groma_models::{LaserScan, ModelError, Odometry, OdometryTrack, Token};
use groma_registration::PolarView;
use groma_tracking::extrapolation::{self, Increment};
use groma_tracking::{Finished, Lesson, Tracker, has_enough_hits};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Scans whose odometry is awaited, at most.
const MOST_AWAITED: usize = 64;

/// Why a scan was not used.
#[derive(Clone, Debug, PartialEq)]
pub enum Skipped {
    /// Its stamp is not after that of the scan before.
    Late,
    /// It has fewer than ten hits.
    Empty,
    /// Its geometry is not possible.
    Invalid(ModelError),
}

/// A scan and the keyframe its pose depends on.
#[derive(Clone)]
pub(crate) struct Placed {
    pub stamp: f64,
    pub keyframe: usize,
    pub t_keyframe_scan: Se2,
    pub online: Se2,
    /// The laser's place against the odometry as it was known then.
    pub offset: Se2,
}

/// Where the vehicle is, by all that has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Time of the last scan [s].
    pub stamp: f64,
    /// `T_map_base` then.
    pub pose: Se2,
    /// Covariance of its right perturbation, relative to the first pose: along the best path through the local maps, which
    /// bounds that of the graph.
    pub covariance: Matrix3<f64>,
    /// Keyframes so far.
    pub keyframes: usize,
    /// Local maps finished so far.
    pub local_maps: usize,
    /// Loop closures accepted so far.
    pub closures: usize,
}

/// Builds a map from scans and odometry.
#[derive(Clone)]
pub struct Mapper {
    pub(crate) options: Options,
    pub(crate) track: OdometryTrack,
    pub(crate) tracker: Tracker,
    finder: Finder,
    pub(crate) keyframes: Vec<Keyframe>,
    pub(crate) closer: Closer,
    pub(crate) placed: Vec<Placed>,
    /// Pending statistics of the odometry between two stamps once it has come.
    awaited: VecDeque<(f64, f64, Lesson)>,
}

impl Mapper {
    /// An empty map; the options are assumed valid.
    #[must_use]
    pub fn new(options: Options) -> Self {
        Self {
            finder: Finder::new(&options),
            options,
            track: OdometryTrack::default(),
            tracker: Tracker::default(),
            keyframes: Vec::new(),
            closer: Closer::default(),
            placed: Vec::new(),
            awaited: VecDeque::new(),
        }
    }

    /// Takes an odometry reading; false if its stamp does not rise or it is not finite.
    pub fn push_odometry(&mut self, reading: Odometry) -> bool {
        let is_taken = self.track.push(reading);
        let come = self.awaited.iter().take_while(|(_, to, _)| is_taken && *to <= reading.stamp).count();
        for (from, to, lesson) in self.awaited.drain(..come) {
            if let Some(increment) = extrapolation::increment(&self.track, from, to) {
                self.tracker.learn(&lesson, &increment.motion);
            }
        }
        is_taken
    }

    /// Where the vehicle was at the last scan; none before the first.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        let last = self.placed.last()?;
        Some(State {
            stamp: last.stamp,
            pose: last.online,
            covariance: self.covariance(last),
            keyframes: self.keyframes.len(),
            local_maps: self.closer.maps.len(),
            closures: self.closer.closures.iter().filter(|c| c.verdict == Verdict::Accepted).count(),
        })
    }

    /// Where the vehicle was at a scan that was not taken yet: the last one that was, moved on by odometry, which is extrapolated
    /// where it has not come, or as the vehicle moved before. Where none was taken, `first` [s] is when the vehicle was at the
    /// origin.
    #[must_use]
    pub fn predict(&self, first: f64, stamp: f64) -> State {
        let now = self.state().unwrap_or(State {
            stamp: first,
            pose: Se2::IDENTITY,
            covariance: Matrix3::zeros(),
            keyframes: 0,
            local_maps: 0,
            closures: 0,
        });
        let increment = extrapolation::increment(&self.track, now.stamp, stamp);
        let (moved, spread) = self.tracker.foretell(stamp - now.stamp, increment.as_ref());
        let back = moved.inverse().adjoint();
        let covariance = back * now.covariance * back.transpose() + spread;
        State { stamp, pose: now.pose * moved, covariance, ..now }
    }

    fn covariance(&self, last: &Placed) -> Matrix3<f64> {
        let mut sum = Matrix3::zeros();
        let mut anchor = 0;
        if let Some(map) = self.closer.maps.last() {
            let spread = from_source(self.closer.maps.len(), &self.closer.links(), 0);
            sum = spread.last().copied().flatten().unwrap_or(sum);
            anchor = map.keyframes.start;
        }
        let mut carry = |motion: &Se2, spread: &Matrix3<f64>| {
            let ad = motion.inverse().adjoint();
            sum = ad * sum * ad.transpose() + spread;
        };
        for pair in self.keyframes[anchor..=last.keyframe].windows(2) {
            let (a, b) = (&pair[0].tracked, &pair[1].tracked);
            carry(&a.pose.between(&b.pose), &b.step);
        }
        carry(&last.t_keyframe_scan, self.tracker.since());
        sum
    }

    /// Takes a scan of a laser mounted at `t_base_laser`.
    ///
    /// # Errors
    /// [`Skipped`] when the scan cannot be used; nothing has changed then.
    pub fn push_scan(&mut self, scan: &LaserScan, t_base_laser: &Se2) -> Result<(), Skipped> {
        scan.validate().map_err(Skipped::Invalid)?;
        if let Some(value) = t_base_laser.to_vector().iter().find(|x| !x.is_finite()) {
            let rule = "must be a finite number";
            return Err(Skipped::Invalid(ModelError::Setting { name: "mount", value: *value, rule }));
        }
        if self.placed.last().is_some_and(|last| scan.stamp <= last.stamp) {
            return Err(Skipped::Late);
        }
        if !has_enough_hits(scan) {
            return Err(Skipped::Empty);
        }
        self.register(scan, t_base_laser);
        Ok(())
    }

    fn register(&mut self, scan: &LaserScan, t_base_laser: &Se2) {
        let view = PolarView::new(scan, t_base_laser, self.twist(scan));
        let increment = self.increment(scan.stamp);
        let step = self.tracker.step(scan.stamp, view, increment.as_ref());
        if let (Some(lesson), Some(before)) = (step.lesson, self.placed.last()) {
            self.awaited.push_back((before.stamp, scan.stamp, lesson));
            if self.awaited.len() > MOST_AWAITED {
                self.awaited.pop_front();
            }
        }
        self.keyframes.extend(step.keyframe.map(|tracked| self.finder.find(scan, tracked)));
        if let Some(finished) = step.finished {
            self.add_local_map(finished);
        }
        self.place(scan.stamp, &step.pose);
    }

    /// The twist of the vehicle during a sweep: from odometry, or as tracked.
    fn twist(&self, scan: &LaserScan) -> Vector3<f64> {
        let sweep = scan.geometry.time_increment * scan.ranges.len().saturating_sub(1) as f64;
        if sweep == 0.0 {
            return Vector3::zeros();
        }
        let at = |t: f64| extrapolation::pose(&self.track, t);
        match (at(scan.stamp), at(scan.stamp + sweep)) {
            (Some(a), Some(b)) => self.tracker.offset().apply(&a.between(&b)).log() / sweep,
            _ => self.tracker.velocity(),
        }
    }

    /// The odometry since the last scan, as far as it is known.
    fn increment(&self, stamp: f64) -> Option<Increment> {
        extrapolation::increment(&self.track, self.placed.last()?.stamp, stamp)
    }

    fn add_local_map(&mut self, finished: Finished) {
        self.closer.add(LocalMap::new(finished, &self.keyframes), &self.keyframes);
        // Nobody cancels this: it is part of taking a scan.
        let _ = self.closer.close(self.closer.maps.len() - 1, &self.keyframes, &Token::new());
    }

    fn place(&mut self, stamp: f64, tracked: &Se2) {
        let keyframe = self.keyframes.len() - 1;
        let t_keyframe_scan = self.keyframes[keyframe].tracked.pose.between(tracked);
        let online = match (self.closer.maps.last(), self.closer.poses.last()) {
            (Some(map), Some(pose)) => *pose * map.anchor.between(tracked),
            _ => *tracked,
        };
        self.placed.push(Placed { stamp, keyframe, t_keyframe_scan, online, offset: self.tracker.offset().pose() });
    }
}

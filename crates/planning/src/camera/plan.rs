//! Looks along a drive, and what is known at each.
//!
//! A view counts once: from where the camera saw the robot already, within 0.1 m and 0.1 rad, it would see the same again,
//! the errors of lens and print included, which no averaging takes away.

use super::knowledge::Knowledge;
use super::motion::Drive;
use super::stage::Stage;
use super::step::{STRIDE, Step};
use crate::error::Error;
use groma_geometry::{Se2, wrap};
use groma_models::Token;

/// A leg that is given, at most [m].
const LONGEST: f64 = 1e3;

/// Poses nearer than this look the same [m], [rad].
const SAME: (f64, f64) = (0.1, 0.1);

/// What is known of a camera before a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Of its intrinsics.
    pub knowledge: Knowledge,
    /// Poses from which that was seen.
    pub looked: Vec<Se2>,
}

impl From<Knowledge> for Known {
    /// Known from elsewhere.
    fn from(knowledge: Knowledge) -> Self {
        Self { knowledge, looked: vec![] }
    }
}

/// A pose at which the camera looks, and what is known then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Of the robot on the floor, the foot of the camera being the origin.
    pub pose: Se2,
    /// Number of the drive; the start has that of the first.
    pub leg: usize,
    /// Panels seen there; none where it was seen so before.
    pub views: usize,
    /// Worst standard deviation of a pixel [pixel].
    pub worst: f64,
}

/// Drives one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The start, and every view on the way.
    pub stops: Vec<Stop>,
    /// What is known at its end.
    pub knowledge: Knowledge,
    /// Poses from which the camera saw the robot, those before the drive included.
    looked: Vec<Se2>,
}

impl Plan {
    /// A drive that is given as poses to turn and drive to, with looks on the way.
    ///
    /// # Errors
    /// A leg longer than 1 km, or when the token cancels the work.
    pub fn along(stage: &Stage, known: Known, from: Se2, poses: &[Se2], token: &Token) -> Result<Self, Error> {
        let mut plan = Self::begin(stage, known, from);
        let mut here = from;
        for (leg, &to) in poses.iter().enumerate() {
            let length = (to.translation - here.translation).norm();
            Error::unless(length <= LONGEST, "length of a leg", length, "must be at most 1000 m")?;
            for stop in Step::new(here, to).stops(STRIDE) {
                token.check()?;
                plan.look(stage, stop, leg);
            }
            here = to;
        }
        Ok(plan)
    }

    pub(super) fn begin(stage: &Stage, known: Known, from: Se2) -> Self {
        let mut plan = Self { stops: vec![], knowledge: known.knowledge, looked: known.looked };
        plan.look(stage, from, 0);
        plan
    }

    pub(super) fn look(&mut self, stage: &Stage, pose: Se2, leg: usize) {
        let views = if self.is_new(&pose) { stage.views(&pose) } else { vec![] };
        self.knowledge.look(stage, &views);
        if !views.is_empty() {
            self.looked.push(pose);
        }
        self.stops.push(Stop { pose, leg, views: views.len(), worst: self.knowledge.worst() });
    }

    /// Whether the camera never saw the robot so.
    pub(super) fn is_new(&self, pose: &Se2) -> bool {
        let apart = |old: &Se2| {
            let turn = wrap(pose.theta() - old.theta()).abs();
            (pose.translation - old.translation).norm() > SAME.0 || turn > SAME.1
        };
        self.looked.iter().all(apart)
    }

    /// Worst standard deviation of a pixel at its end [pixel].
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.stops.last().map_or(f64::INFINITY, |stop| stop.worst)
    }

    /// Its poses.
    #[must_use]
    pub fn drive(&self) -> Drive {
        Drive { stops: self.stops.iter().map(|stop| stop.pose).collect() }
    }
}

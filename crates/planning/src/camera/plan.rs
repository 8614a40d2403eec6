//! Looks along a drive, and what is known at each.

use super::knowledge::Knowledge;
use super::motion::Drive;
use super::stage::Stage;
use super::step::{STRIDE, Step};
use groma_geometry::Se2;

/// A pose at which the camera looks, and what is known then.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Of the robot on the floor, the foot of the camera being the origin.
    pub pose: Se2,
    /// Number of the drive; the start has that of the first.
    pub leg: usize,
    /// Panels seen there, without those known already.
    pub views: usize,
    /// Worst standard deviation of a pixel [pixel].
    pub worst: f64,
}

/// Where a drive begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    /// Of the robot.
    pub pose: Se2,
    /// Whether what the camera sees there is in what is known already.
    pub is_seen: bool,
}

impl From<Se2> for Start {
    /// A place from which nothing was seen yet.
    fn from(pose: Se2) -> Self {
        Self { pose, is_seen: false }
    }
}

/// Drives one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The start, and every look on the way.
    pub stops: Vec<Stop>,
    /// What is known at its end.
    pub knowledge: Knowledge,
}

impl Plan {
    /// A drive that is given as poses to turn and drive to, with looks on the way.
    #[must_use]
    pub fn along(stage: &Stage, knowledge: Knowledge, from: Start, poses: &[Se2]) -> Self {
        let mut plan = Self::begin(stage, knowledge, from);
        let mut here = from.pose;
        for (leg, &to) in poses.iter().enumerate() {
            Step::new(here, to).stops(STRIDE).into_iter().for_each(|stop| plan.look(stage, stop, leg));
            here = to;
        }
        plan
    }

    pub(super) fn begin(stage: &Stage, knowledge: Knowledge, from: Start) -> Self {
        let mut plan = Self { stops: vec![], knowledge };
        if from.is_seen {
            let worst = plan.knowledge.worst();
            plan.stops.push(Stop { pose: from.pose, leg: 0, views: 0, worst });
        } else {
            plan.look(stage, from.pose, 0);
        }
        plan
    }

    pub(super) fn look(&mut self, stage: &Stage, pose: Se2, leg: usize) {
        let views = stage.views(&pose);
        self.knowledge.look(stage, &views);
        self.stops.push(Stop { pose, leg, views: views.len(), worst: self.knowledge.worst() });
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

//! The last motions of the vehicle, to know where it was, or will be, when a beam is fired.
//!
//! Between two times the vehicle moves with constant twist; beyond the last it goes on as in the last step, for
//! `AHEAD` at most: a scan whose odometry is still to come.

use groma_geometry::Se2;
use nalgebra::Vector3;
use std::collections::VecDeque;

/// Motions remembered.
const STEPS: usize = 256;
/// How far beyond the last motion it goes on [s].
const AHEAD: f64 = 0.5;

/// Times and poses in a frame of their own.
#[derive(Clone, Debug)]
pub(crate) struct History {
    /// Time [s] and pose, the time rising.
    poses: VecDeque<(f64, Se2)>,
}

impl History {
    /// A vehicle at rest at a time.
    pub fn new(stamp: f64) -> Self {
        Self { poses: VecDeque::from([(stamp, Se2::IDENTITY)]) }
    }

    /// Time of the last motion [s].
    pub fn now(&self) -> f64 {
        self.poses.back().map_or(0.0, |(t, _)| *t)
    }

    /// Where the vehicle is in the frame of the history.
    pub fn pose(&self) -> Se2 {
        self.poses.back().map_or(Se2::IDENTITY, |(_, pose)| *pose)
    }

    /// A motion that ends at `stamp`.
    pub fn push(&mut self, stamp: f64, motion: &Se2) {
        let pose = self.pose() * *motion;
        if self.poses.len() == STEPS {
            self.poses.pop_front();
        }
        self.poses.push_back((stamp, pose));
    }

    /// The vehicle at `stamp`, seen from where it is now; the first pose for any time before.
    pub fn since(&self, stamp: f64) -> Se2 {
        let after = self.poses.partition_point(|(t, _)| *t < stamp);
        let now = self.pose();
        let (Some(&(t0, from)), Some(&(t1, to))) = (self.poses.get(after.max(1) - 1), self.poses.get(after.max(1)))
        else {
            return self.ahead(stamp - self.now());
        };
        let share = ((stamp - t0) / (t1 - t0)).max(0.0);
        now.between(&from.interpolate(&to, share))
    }

    /// The twist between two times (body frame, per second); zero where they are one.
    pub fn twist(&self, from: f64, to: f64) -> Vector3<f64> {
        let moved = self.since(from).between(&self.since(to)).log();
        if to > from { moved / (to - from) } else { Vector3::zeros() }
    }

    fn ahead(&self, time: f64) -> Se2 {
        let last = self.poses.len();
        let (Some((t0, from)), Some((t1, to))) = (self.poses.get(last.wrapping_sub(2)), self.poses.back()) else {
            return Se2::IDENTITY;
        };
        Se2::exp(to.minus(from) * (time.clamp(0.0, AHEAD) / (t1 - t0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_where_the_vehicle_was_and_will_be() {
        let mut history = History::new(1.0);
        let step = Se2::new(0.1, 0.02, 0.1);
        for k in 0..4 {
            history.push(1.0 + 0.1 * f64::from(k + 1), &step);
        }
        let close = |a: Se2, b: Se2| a.minus(&b).norm() < 1e-12;
        assert!(close(history.since(1.4), Se2::IDENTITY));
        assert!(close(history.since(1.3), step.inverse()));
        assert!(close(history.since(1.25), (step * Se2::IDENTITY.interpolate(&step, 0.5)).inverse()));
        assert!(close(history.since(1.45), Se2::IDENTITY.interpolate(&step, 0.5)));
        assert!(close(history.since(0.0), history.since(1.0)));
        assert!((history.twist(1.23, 1.37) - step.log() / 0.1).norm() < 1e-9);
        assert!(history.twist(1.2, 1.2).norm() == 0.0);
        assert!(close(history.since(9.0), Se2::exp(step.log() * 5.0)));
    }

    #[test]
    fn a_vehicle_that_never_moved_stays() {
        let history = History::new(3.0);
        assert!([0.0, 3.0, 9.0].iter().all(|t| history.since(*t) == Se2::IDENTITY));
    }

    #[test]
    fn forgets_the_oldest() {
        let mut history = History::new(0.0);
        (1..1000).for_each(|k| history.push(f64::from(k), &Se2::new(1.0, 0.0, 0.0)));
        assert_eq!(history.poses.len(), STEPS);
        assert!((history.since(990.5).x() + 8.5).abs() < 1e-9);
    }
}

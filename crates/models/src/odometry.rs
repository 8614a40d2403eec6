//! Planar odometry: poses of the vehicle in a frame that drifts but never jumps on its own account.

use crate::bounds::{COORDINATE, STAMP};
use crate::error::ModelError;
use groma_geometry::Se2;
use std::f64::consts::PI;

/// One odometry reading: the vehicle in the odometry frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Odometry {
    /// Time [s].
    pub stamp: f64,
    /// `T_odom_base`.
    pub pose: Se2,
}

/// No robot drives farther between two readings [m], [rad], than this or at these speeds [m/s], [rad/s].
const LONGEST: (f64, f64) = (0.5, PI / 4.0);
const FASTEST: (f64, f64) = (5.0, 2.0 * PI);

impl Odometry {
    /// Refuses a reading that no vehicle gives.
    ///
    /// # Errors
    /// A stamp or a coordinate that is not finite or out of its bound.
    pub fn validate(&self) -> Result<(), ModelError> {
        STAMP.check("stamp", self.stamp)?;
        COORDINATE.check("x", self.pose.x())?;
        COORDINATE.check("y", self.pose.y())?;
        COORDINATE.check("theta", self.pose.theta())
    }

    /// Whether no robot drives from here to `next`: more than half a metre and 5 m/s, or turning likewise.
    #[must_use]
    pub fn jumps_to(&self, next: &Self) -> bool {
        let (seconds, step) = ((next.stamp - self.stamp).max(0.0), self.pose.between(&next.pose));
        step.translation.norm() > LONGEST.0.max(FASTEST.0 * seconds)
            || step.theta().abs() > LONGEST.1.max(FASTEST.1 * seconds)
    }
}

/// Odometry readings in strictly rising order of time.
#[derive(Clone, Debug, Default)]
pub struct OdometryTrack {
    readings: Vec<Odometry>,
}

impl OdometryTrack {
    /// Appends a reading; returns false and keeps nothing if its time does not rise or it is not valid.
    pub fn push(&mut self, reading: Odometry) -> bool {
        let late = self.readings.last().is_some_and(|last| reading.stamp <= last.stamp);
        if late || reading.validate().is_err() {
            return false;
        }
        self.readings.push(reading);
        true
    }

    /// The readings, oldest first.
    #[must_use]
    pub fn readings(&self) -> &[Odometry] {
        &self.readings
    }

    /// The pose at `stamp`, on the constant-twist path between its neighbours; the first or last pose outside the
    /// track; `None` when the track is empty.
    #[must_use]
    pub fn at(&self, stamp: f64) -> Option<Se2> {
        let after = self.readings.partition_point(|r| r.stamp < stamp);
        match (after.checked_sub(1).map(|k| self.readings[k]), self.readings.get(after)) {
            (_, Some(b)) if b.stamp == stamp => Some(b.pose),
            (Some(a), Some(b)) => Some(a.pose.interpolate(&b.pose, (stamp - a.stamp) / (b.stamp - a.stamp))),
            (Some(only), None) => Some(only.pose),
            (None, first) => first.map(|r| r.pose),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(stamp: f64, x: f64) -> Odometry {
        Odometry { stamp, pose: Se2::new(x, 0.0, 0.0) }
    }

    #[test]
    fn what_no_robot_drives_is_a_jump() {
        let pose = |stamp, x, theta| Odometry { stamp, pose: Se2::new(x, 0.0, theta) };
        let start = pose(0.0, 0.0, 0.0);
        for (next, jumps) in [
            (pose(0.1, 0.49, 0.0), false),
            (pose(0.1, -0.51, 0.0), true),
            (pose(1.0, 4.9, 3.0), false),
            (pose(1.0, 5.1, 0.0), true),
            (pose(0.05, 0.0, -0.78), false),
            (pose(0.05, 0.0, -0.79), true),
            (pose(-1.0, 0.6, 0.0), true),
        ] {
            assert_eq!(start.jumps_to(&next), jumps, "{next:?}");
        }
    }

    #[test]
    fn interpolates_and_clamps() {
        let mut track = OdometryTrack::default();
        assert!(track.at(0.0).is_none());
        assert!(track.push(reading(1.0, 0.0)) && track.push(reading(2.0, 1.0)));
        assert!(
            !track.push(reading(2.0, 5.0)) && !track.push(reading(3.0, f64::NAN)) && !track.push(reading(3.0, 1e200))
        );
        for (t, x) in [(0.0, 0.0), (1.0, 0.0), (1.25, 0.25), (2.0, 1.0), (9.0, 1.0)] {
            assert!((track.at(t).unwrap().x() - x).abs() < 1e-15);
        }
    }
}

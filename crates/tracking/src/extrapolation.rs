//! The odometry up to a moment that it has not reached yet.
//!
//! A scan may come before the odometry of its time. Nobody waits for it: from the last reading, at `t_o`, the twist `v` of the
//! last readings goes on,
//!
//! ```text
//! D(t) = D(t_o) exp(v (t - t_o)),    v = log(D(t_o - s)^-1 D(t_o)) / s,    s at least TWIST_OVER
//! ```
//!
//! What may change meanwhile widens the increment between two scans at `t_o + a` and `t_o + b`, `0 <= a < b`: a vehicle
//! accelerates by `ACCELERATION` (one standard deviation), and `v` is that of the middle of `s`, so
//!
//! ```text
//! sigma = ACCELERATION (b - a) ((a + b) / 2 + s / 2)
//! ```
//!
//! Beyond `REACH` nothing is said. Assumes that the errors of successive increments are independent, which those of one
//! manoeuvre are not; readings that come later put it right.

use groma_geometry::Se2;
use groma_models::OdometryTrack;
use nalgebra::Vector3;

/// Odometry goes on this far beyond its ends [s].
const REACH: f64 = 0.3;
/// The twist is taken over at least this long [s].
const TWIST_OVER: f64 = 0.1;
/// What a vehicle accelerates by [m/s^2], [rad/s^2].
const ACCELERATION: (f64, f64) = (1.0, 2.0);

/// The odometry between two moments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Increment {
    /// The motion.
    pub motion: Se2,
    /// Variances `(x, y, theta)` beyond those of odometry, for what was extrapolated.
    pub excess: Vector3<f64>,
    /// Whether readings cover both moments.
    pub is_complete: bool,
}

/// The odometry from one moment to a later one; none where there is none within `REACH`.
#[must_use]
pub fn increment(track: &OdometryTrack, from: f64, to: f64) -> Option<Increment> {
    let motion = pose(track, from)?.between(&pose(track, to)?);
    let last = track.readings().last()?.stamp;
    let (a, b) = ((from - last).max(0.0), (to - last).max(0.0));
    if b == 0.0 {
        return Some(Increment { motion, excess: Vector3::zeros(), is_complete: true });
    }
    let span = twist(track)?.1;
    let changed = (b - a) * (0.5 * (a + b) + 0.5 * span);
    let (xy, turn) = (ACCELERATION.0 * changed, ACCELERATION.1 * changed);
    Some(Increment { motion, excess: Vector3::new(xy * xy, xy * xy, turn * turn), is_complete: false })
}

/// The odometry at a moment, extrapolated where need be.
#[must_use]
pub fn pose(track: &OdometryTrack, stamp: f64) -> Option<Se2> {
    let (first, last) = (track.readings().first()?, track.readings().last()?);
    if !(stamp > first.stamp - REACH && stamp < last.stamp + REACH) {
        return None;
    }
    if stamp <= last.stamp {
        return track.at(stamp);
    }
    Some(last.pose.plus(twist(track)?.0 * (stamp - last.stamp)))
}

/// The twist of the last readings (body frame, per second), and the time over which it was taken [s].
fn twist(track: &OdometryTrack) -> Option<(Vector3<f64>, f64)> {
    let (last, before) = track.readings().split_last()?;
    let old = before.iter().rev().find(|r| last.stamp - r.stamp >= TWIST_OVER).or(before.first())?;
    let span = last.stamp - old.stamp;
    Some((last.pose.minus(&old.pose) / span, span))
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::Odometry;

    /// A drive on a circle at 1 m/s and 0.5 rad/s, read at 20 Hz up to two seconds.
    fn circle() -> OdometryTrack {
        let mut track = OdometryTrack::default();
        for k in 0..=40 {
            let stamp = 0.05 * f64::from(k);
            track.push(Odometry { stamp, pose: on_circle(stamp) });
        }
        track
    }

    fn on_circle(t: f64) -> Se2 {
        Se2::exp(Vector3::new(1.0, 0.0, 0.5) * t)
    }

    #[test]
    fn a_steady_motion_goes_on_as_it_was() {
        let track = circle();
        for (from, to) in [(1.9, 2.0), (1.95, 2.2), (2.1, 2.25)] {
            let found = increment(&track, from, to).unwrap();
            assert!(found.motion.minus(&on_circle(to - from)).norm() < 1e-9, "{from} {to}");
        }
    }

    #[test]
    fn what_readings_cover_has_no_excess_and_what_lies_farther_ahead_has_more() {
        let track = circle();
        let excess = |from, to| increment(&track, from, to).unwrap().excess;
        assert_eq!(excess(1.5, 2.0), Vector3::zeros());
        let ahead: Vec<Vector3<f64>> = [2.02, 2.1, 2.2].map(|t| excess(t, t + 0.05)).to_vec();
        assert!(ahead.windows(2).all(|w| w[1].x > w[0].x && w[1].z > w[0].z));
        assert!(
            ahead[0].x > 0.0 && ahead[2].x.sqrt() < 0.05 && increment(&track, 1.5, 2.1).is_some_and(|i| !i.is_complete)
        );
    }

    /// A vehicle that brakes within what the spread allows ends within three of its standard deviations.
    #[test]
    fn braking_lies_within_the_spread() {
        let track = circle();
        let found = increment(&track, 2.0, 2.25).unwrap();
        let braked = 1.0 * 0.25 - 0.5 * 1.0 * 0.25_f64.powi(2);
        assert!((found.motion.x() - braked).abs() < 3.0 * found.excess.x.sqrt());
    }

    #[test]
    fn nothing_is_said_far_beyond_the_ends_or_of_a_single_reading() {
        let track = circle();
        assert!(pose(&track, 2.31).is_none() && pose(&track, -0.31).is_none() && pose(&track, f64::NAN).is_none());
        let mut single = OdometryTrack::default();
        assert!(increment(&single, 0.0, 1.0).is_none());
        single.push(Odometry { stamp: 0.0, pose: Se2::IDENTITY });
        assert!(pose(&single, 0.0).is_some() && pose(&single, 0.1).is_none());
    }
}

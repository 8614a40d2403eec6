//! Poses of the sensor that somebody else measured, and the motions between them: a tracker, another program's laser odometry.
//!
//! At a standstill the sensor was at the mean of its poses, at a moment where the first pose from then on says. Turns are
//! counted from pose to pose. Where poses are rare and nothing else was requested, every pose is a station.

use super::gate::{Candidate, Reason};
use super::segments::{SegmentKind, Segments, moment};
use groma_egomotion::Station;
use groma_estimation::robust::quantile;
use groma_geometry::Se2;
use groma_models::Odometry;
use nalgebra::Vector3;

/// Poses farther apart than this in the median are rare [s].
const RARE: f64 = 0.3;

/// Poses in order of time.
#[derive(Clone, Debug, Default)]
pub(super) struct SensorPoses {
    stamps: Vec<f64>,
    /// x, y [m], heading with turns counted [rad].
    poses: Vec<Vector3<f64>>,
}

impl SensorPoses {
    /// Appends a pose; false where it is no number or not after the one before.
    pub(super) fn push(&mut self, reading: &Odometry) -> bool {
        let pose = reading.pose.to_vector();
        let late = self.stamps.last().is_some_and(|last| reading.stamp <= *last);
        if late || !reading.stamp.is_finite() || pose.iter().any(|v| !v.is_finite()) {
            return false;
        }
        let heading = self.poses.last().map_or(pose.z, |last| last.z + groma_geometry::wrap(pose.z - last.z));
        self.stamps.push(reading.stamp);
        self.poses.push(Vector3::new(pose.x, pose.y, heading));
        true
    }

    pub(super) fn len(&self) -> usize {
        self.stamps.len()
    }

    pub(super) fn span(&self) -> Option<(f64, f64)> {
        Some((*self.stamps.first()?, *self.stamps.last()?))
    }

    /// The stations to use instead, where the poses are rare.
    pub(super) fn as_stations(&self, cut: Segments, window: Option<f64>) -> Segments {
        let is_rare = self.median_interval().is_some_and(|interval| interval > RARE);
        if cut.kind == SegmentKind::Windows && window.is_none() && is_rare {
            let stations = self.stamps.iter().map(|t| moment(*t)).collect();
            return Segments { kind: SegmentKind::Windows, stations };
        }
        cut
    }

    /// The motions from each station to the next.
    pub(super) fn motions(&self, stations: &[Station]) -> Vec<Candidate> {
        let at: Vec<Option<(f64, Vector3<f64>)>> = stations.iter().map(|s| self.at(s)).collect();
        let between = |k: usize| match (at[k - 1], at[k]) {
            (Some((start, a)), Some((end, b))) if end > start => {
                let pose = |v: Vector3<f64>| Se2::new(v.x, v.y, v.z);
                let motion = pose(a).between(&pose(b));
                Candidate { start, end, motion, turn: b.z - a.z, covariance: None, reason: None }
            }
            _ => {
                let (start, end) = (stations[k - 1].from, stations[k].from);
                let reason = Some(Reason::NoPose);
                Candidate { start, end, motion: Se2::IDENTITY, turn: 0.0, covariance: None, reason }
            }
        };
        (1..stations.len()).map(between).collect()
    }

    /// Time and pose at a station.
    fn at(&self, station: &Station) -> Option<(f64, Vector3<f64>)> {
        let from = self.stamps.partition_point(|t| *t < station.from);
        if !station.is_standstill() {
            return self.stamps.get(from).map(|t| (*t, self.poses[from]));
        }
        let to = self.stamps.partition_point(|t| *t <= station.to);
        let mean = || self.poses[from..to].iter().sum::<Vector3<f64>>() / (to - from) as f64;
        (to > from).then(|| (f64::midpoint(station.from, station.to), mean()))
    }

    fn median_interval(&self) -> Option<f64> {
        quantile(&mut self.stamps.windows(2).map(|w| w[1] - w[0]).collect::<Vec<f64>>(), 0.5)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turning(period: f64, count: usize) -> SensorPoses {
        let mut poses = SensorPoses::default();
        for k in 0..count {
            let t = period * k as f64;
            assert!(poses.push(&Odometry { stamp: t, pose: Se2::new(t, 0.0, 0.5 * t) }));
        }
        poses
    }

    #[test]
    fn motions_count_whole_turns_and_are_seen_from_their_start() {
        let poses = turning(0.1, 400);
        let found = poses.motions(&[moment(2.0), moment(16.0)]);
        assert!((found[0].turn - 7.0).abs() < 1e-9 && found[0].reason.is_none());
        let (ahead, left) = (14.0 * 1.0_f64.cos(), -14.0 * 1.0_f64.sin());
        assert!((found[0].motion.x() - ahead).abs() < 1e-9 && (found[0].motion.y() - left).abs() < 1e-9);
    }

    #[test]
    fn a_standstill_is_the_mean_of_its_poses() {
        let poses = turning(0.1, 100);
        let stop = |from: f64, to: f64| Station { from, to };
        let found = poses.motions(&[stop(0.95, 2.05), stop(3.95, 4.65), stop(20.0, 21.0)]);
        assert!((found[0].start - 1.5).abs() < 1e-12 && (found[0].end - 4.3).abs() < 1e-12);
        assert!((found[0].turn - 0.5 * 2.8).abs() < 1e-9);
        assert_eq!(found[1].reason, Some(Reason::NoPose));
    }

    #[test]
    fn rare_poses_are_stations_of_their_own() {
        let cut = || Segments { kind: SegmentKind::Windows, stations: vec![moment(0.2), moment(0.7)] };
        assert_eq!(turning(0.1, 100).as_stations(cut(), None).stations.len(), 2);
        assert_eq!(turning(0.4, 100).as_stations(cut(), None).stations.len(), 100);
        assert_eq!(turning(0.4, 100).as_stations(cut(), Some(0.5)).stations.len(), 2);
    }

    #[test]
    fn what_is_no_pose_or_late_is_refused() {
        let mut poses = turning(0.1, 10);
        assert!(!poses.push(&Odometry { stamp: 0.9, pose: Se2::IDENTITY }));
        assert!(!poses.push(&Odometry { stamp: f64::NAN, pose: Se2::IDENTITY }));
        assert!(!poses.push(&Odometry { stamp: 5.0, pose: Se2::new(f64::NAN, 0.0, 0.0) }));
        assert_eq!(poses.len(), 10);
    }
}

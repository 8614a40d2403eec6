//! The result of localizing a drive: values only.

use super::halts::{Halt, halts};
use super::track::Fix;
use super::weak::{Weak, weak_stretches};
use groma_models::{Finding, LandmarkMap};

/// How many messages there were, by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Scans taken.
    pub scans_read: usize,
    /// Readings of odometry taken.
    pub odometry_read: usize,
    /// Readings of wheels taken.
    pub wheels_read: usize,
    /// Messages that localization does not use.
    pub passed_over: usize,
}

/// A drive in the frame of the map.
#[derive(Clone, Debug)]
pub struct Localized {
    /// One per scan, in order.
    pub track: Vec<Fix>,
    /// How often each landmark of the map was paired.
    pub used: Vec<usize>,
    /// Times at which the vehicle stood.
    pub halts: Vec<Halt>,
    /// Stretches where the pose is poorly held.
    pub weak: Vec<Weak>,
    /// Landmarks seen on the way, at the poses found; none where no pose was known for long enough.
    pub seen: Option<LandmarkMap>,
    /// Messages by kind.
    pub counts: Counts,
    /// What was noticed; the verdict follows from them.
    pub findings: Vec<Finding>,
}

impl Localized {
    pub(super) fn new(track: Vec<Fix>, landmarks: usize, seen: Option<LandmarkMap>, counts: Counts) -> Self {
        let mut used = vec![0; landmarks];
        for landmark in track.iter().flat_map(|fix| &fix.paired) {
            if let Some(count) = used.get_mut(*landmark) {
                *count += 1;
            }
        }
        let (halts, weak) = (halts(&track), weak_stretches(&track));
        Self { track, used, halts, weak, seen, counts, findings: Vec::new() }
    }

    /// Driven until the pose was known [m]; none when it never was.
    #[must_use]
    pub fn found_after(&self) -> Option<f64> {
        let first = self.track.iter().position(Fix::is_known)?;
        Some(self.track[..=first].iter().map(|fix| fix.distance).sum())
    }

    /// How often the pose was known and then was not.
    #[must_use]
    pub fn times_lost(&self) -> usize {
        self.track.windows(2).filter(|pair| pair[0].is_known() && !pair[1].is_known()).count()
    }

    /// Poses that later motions corrected.
    #[must_use]
    pub fn corrected(&self) -> usize {
        self.track.iter().filter(|fix| fix.corrected).count()
    }
}

#[cfg(test)]
mod tests {
    use super::super::track::test_track::{moving, timed};
    use super::*;
    use groma_localization::Status;

    fn localized(track: Vec<Fix>) -> Localized {
        Localized::new(track, 3, None, Counts::default())
    }

    #[test]
    fn losses_are_counted_where_a_known_pose_ends() {
        let mut track = timed(moving(5.0), 0.1);
        for k in [0, 1, 2, 20, 21, 30, 48, 49] {
            track[k].quality.status = Status::Lost;
        }
        let result = localized(track);
        assert_eq!(result.times_lost(), 3);
        let mut never_again = timed(moving(5.0), 0.1);
        never_again[40..].iter_mut().for_each(|fix| fix.quality.status = Status::Lost);
        assert_eq!(localized(never_again).times_lost(), 1);
        assert!((result.found_after().unwrap() - 4.0 * 0.05).abs() < 1e-12, "up to the first known pose");
        assert!(
            localized(vec![Fix { quality: Default::default(), ..timed(moving(0.1), 0.1).remove(0) }])
                .found_after()
                .is_none()
        );
    }

    #[test]
    fn landmarks_found_during_the_drive_are_none_of_the_map() {
        let mut track = timed(moving(1.0), 0.1);
        track.iter_mut().for_each(|fix| fix.paired = vec![0, 2, 7]);
        track[4].paired = vec![2, 3];
        assert_eq!(localized(track).used, [9, 0, 10]);
    }
}

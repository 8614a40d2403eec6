//! What was seen on the way, at the poses found: landmarks in the frame of the map.
//!
//! Where the vehicle was when a scan began lies between two of the last fixes ([`groma_mapping::known_poses`]); scans at
//! which the pose was not known, or for which there is no such pair, show nothing. Of those that bring something new the
//! readings are kept in single precision (a micrometre at ten metres), and are put together when they are requested: taking a
//! scan must not wait for that.

use super::track::Fix;
use groma_geometry::Se2;
use groma_mapping::known_poses::{TimedPose, between};
use groma_mapping::options::Options;
use groma_mapping::survey::{KnownPose, Survey, has_moved};
use groma_models::{BeamGeometry, LandmarkMap, LaserScan, Token};
use std::collections::VecDeque;

/// Fixes kept: sweeps overlap by one at most.
const KEPT: usize = 3;

/// Scans at the poses found.
pub(super) struct Seen {
    mount: Se2,
    scans: Vec<Kept>,
    /// The last known fixes.
    fixes: VecDeque<TimedPose>,
}

/// A scan as it is kept.
struct Kept {
    stamp: f64,
    geometry: BeamGeometry,
    ranges: Vec<f32>,
    intensities: Vec<f32>,
    known: KnownPose,
}

impl Kept {
    fn new(scan: &LaserScan, known: KnownPose) -> Self {
        let single = |values: &[f64]| values.iter().map(|v| *v as f32).collect();
        let (ranges, intensities) = (single(&scan.ranges), single(&scan.intensities));
        Self { stamp: scan.stamp, geometry: scan.geometry, ranges, intensities, known }
    }

    fn scan(&self) -> LaserScan {
        let double = |values: &[f32]| values.iter().map(|v| f64::from(*v)).collect();
        let (ranges, intensities) = (double(&self.ranges), double(&self.intensities));
        LaserScan { stamp: self.stamp, geometry: self.geometry, ranges, intensities }
    }
}

impl Seen {
    pub fn new(mount: Se2) -> Self {
        Self { mount, scans: Vec::new(), fixes: VecDeque::new() }
    }

    /// Takes a scan and the fix at its end.
    pub fn push(&mut self, scan: &LaserScan, fix: &Fix) {
        if !fix.is_known() {
            return;
        }
        if self.fixes.len() == KEPT {
            self.fixes.pop_front();
        }
        self.fixes.push_back(TimedPose { stamp: fix.stamp, pose: fix.pose, covariance: fix.covariance });
        let pairs = self.fixes.iter().zip(self.fixes.iter().skip(1));
        let Some(known) = pairs.rev().find_map(|(a, b)| between(a, b, scan.stamp)) else { return };
        if self.scans.last().is_none_or(|last| has_moved(&last.known.pose, &known.pose)) {
            self.scans.push(Kept::new(scan, known));
        }
    }

    /// The landmarks; none where nothing was seen at a known pose.
    pub fn landmarks(&self) -> Option<LandmarkMap> {
        let mut survey = Survey::new(Options::default());
        for kept in &self.scans {
            survey.push_scan(&kept.scan(), &self.mount, &kept.known);
        }
        if survey.is_empty() { None } else { survey.landmarks(&Token::new()).ok() }
    }
}

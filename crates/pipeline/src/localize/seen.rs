//! What was seen on the way, at the poses found: landmarks in the frame of the map, from keyframes taken as scans are settled.
//!
//! Where the vehicle was when a scan began lies between two of the last fixes ([`groma_mapping::known_poses`]); scans at
//! which the pose was not known, or for which there is no such pair, show nothing.

use super::track::Fix;
use groma_geometry::Se2;
use groma_mapping::known_poses::{TimedPose, between};
use groma_mapping::options::Options;
use groma_mapping::survey::Survey;
use groma_models::{LandmarkMap, LaserScan, Token};
use std::collections::VecDeque;

/// Fixes kept: sweeps overlap by one at most.
const KEPT: usize = 3;

/// Keyframes at the poses found.
pub(super) struct Seen {
    survey: Survey,
    mount: Se2,
    /// The last known fixes.
    fixes: VecDeque<TimedPose>,
}

impl Seen {
    pub fn new(mount: Se2) -> Self {
        Self { survey: Survey::new(Options::default()), mount, fixes: VecDeque::new() }
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
        if let Some(known) = pairs.rev().find_map(|(a, b)| between(a, b, scan.stamp)) {
            self.survey.push_scan(scan, &self.mount, &known);
        }
    }

    /// The landmarks; none where nothing was seen at a known pose.
    pub fn landmarks(&self) -> Option<LandmarkMap> {
        if self.survey.is_empty() { None } else { self.survey.landmarks(&Token::new()).ok() }
    }
}

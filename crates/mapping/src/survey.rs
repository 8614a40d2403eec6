//! A map from poses that are known: from a tracking system, from navigation by reflectors, from another map.
//!
//! Scans become keyframes where the vehicle has moved on by `STEP` or `TURN`; what they show is put together at the poses
//! given, by the same rules as in a map whose poses were estimated ([`crate::landmarks`], [`crate::occupancy`]).
//! Assumes that the poses are as good as their covariances say; nothing is corrected.

use crate::finder::Finder;
use crate::keyframe::Keyframe;
use crate::landmarks::landmarks;
use crate::occupancy::occupancy;
use crate::options::Options;
use groma_geometry::Se2;
use groma_models::{Cancelled, Grid, LandmarkMap, LaserScan, Token};
use groma_registration::PolarView;
use groma_tracking::Tracked;
use nalgebra::{Matrix3, Vector3};

/// Way between keyframes [m].
const STEP: f64 = 0.2;
/// Turn between keyframes [rad].
const TURN: f64 = 0.1;

/// Where the vehicle was when a scan began, and how it moved while it lasted.
#[derive(Clone, Copy, Debug)]
pub struct KnownPose {
    /// `T_map_base` at the stamp of the scan.
    pub pose: Se2,
    /// Covariance of the pose, perturbed on the right.
    pub covariance: Matrix3<f64>,
    /// Twist of the body [m/s, m/s, rad/s].
    pub twist: Vector3<f64>,
}

/// Scans at known poses.
pub struct Survey {
    options: Options,
    finder: Finder,
    keyframes: Vec<Keyframe>,
    covariances: Vec<Matrix3<f64>>,
}

impl Survey {
    /// Nothing yet.
    #[must_use]
    pub fn new(options: Options) -> Self {
        Self { finder: Finder::new(&options), options, keyframes: Vec::new(), covariances: Vec::new() }
    }

    /// Takes a scan of a laser mounted at `t_base_laser`; false if it brings nothing new or a number of it is not finite.
    pub fn push_scan(&mut self, scan: &LaserScan, t_base_laser: &Se2, known: &KnownPose) -> bool {
        if scan.validate().is_err() || t_base_laser.to_vector().iter().any(|x| !x.is_finite()) {
            return false;
        }
        let finite = (known.pose.to_vector().sum() + known.covariance.sum() + known.twist.sum()).is_finite();
        if !finite || self.keyframes.last().is_some_and(|last| !has_moved(&last.tracked.pose, &known.pose)) {
            return false;
        }
        let view = PolarView::new(scan, t_base_laser, known.twist);
        self.keyframes.push(self.finder.find(scan, Tracked::at(scan.stamp, known.pose, view)));
        self.covariances.push(known.covariance);
        true
    }

    /// Scans that were used.
    #[must_use]
    pub fn len(&self) -> usize {
        self.keyframes.len()
    }

    /// Whether no scan was used.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.keyframes.is_empty()
    }

    /// What was seen.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn finish(&self, token: &Token) -> Result<(Grid, LandmarkMap), Cancelled> {
        let grid = occupancy(&self.keyframes, &self.poses(), self.options.resolution, token)?;
        Ok((grid, self.landmarks(token)?))
    }

    /// The landmarks seen.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn landmarks(&self, token: &Token) -> Result<LandmarkMap, Cancelled> {
        landmarks(&self.keyframes, &self.poses(), &self.covariances, token)
    }

    fn poses(&self) -> Vec<Se2> {
        self.keyframes.iter().map(|k| k.tracked.pose).collect()
    }
}

/// Whether a scan at a pose brings something new after one at another.
#[must_use]
pub fn has_moved(from: &Se2, to: &Se2) -> bool {
    let step = from.between(to);
    step.translation.norm() >= STEP || step.theta().abs() >= TURN
}

//! A scan that the map is built of.

use groma_features::Keypoint;
use groma_features::reflector::Reflector;
use groma_geometry::Se2;
use groma_registration::PolarView;
use nalgebra::Matrix3;

/// A scan, where the tracker saw it, and how sure it is of the step that led there.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// Time of the scan [s].
    pub stamp: f64,
    /// Pose in the tracked frame: registration to local maps, no loop closed.
    pub tracked: Se2,
    /// The scan.
    pub view: PolarView,
    /// Corners, in the vehicle frame.
    pub corners: Vec<Keypoint>,
    /// Reflectors, in the vehicle frame.
    pub reflectors: Vec<Reflector>,
    /// Covariance of the step from the keyframe before (body frame of this one); zero for the first.
    pub step: Matrix3<f64>,
    /// Covariance of the registration alone along its weakest direction [m] and that direction in the vehicle frame [rad].
    pub weakest: (f64, f64),
    /// Share of the scan found on the local map.
    pub share: f64,
    /// Whether odometry and scan disagreed beyond their covariances.
    pub surprised: bool,
    /// Whether the track was lost on the way here with no odometry to bridge the gap.
    pub torn: bool,
}

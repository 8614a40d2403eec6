//! A scan that became a keyframe, as the tracker sees it.

use groma_geometry::Se2;
use groma_models::LaserScan;
use groma_registration::PolarView;
use nalgebra::Matrix3;
use std::sync::Arc;

/// A scan with fewer hits does not determine where it was taken.
const LEAST_HITS: usize = 10;

/// A scan, where the tracker saw it, and how sure it is of the step that led there.
#[derive(Clone, Debug)]
pub struct Tracked {
    /// Time of the scan [s].
    pub stamp: f64,
    /// Pose in the tracked frame: registration to local maps, no loop closed.
    pub pose: Se2,
    /// The scan; shared with the tracker, which looks at the last few again.
    pub view: Arc<PolarView>,
    /// Covariance of the step from the keyframe before (body frame of this one); zero for the first.
    pub step: Matrix3<f64>,
    /// Covariance of the registration alone along its weakest direction [m] and that direction in the vehicle frame [rad].
    pub weakest: (f64, f64),
    /// Share of the scan found on the local map.
    pub share: f64,
    /// Whether odometry and scan disagreed beyond their covariances.
    pub surprised: bool,
    /// Whether the track was lost before this scan with no odometry to bridge the gap.
    pub torn: bool,
}

impl Tracked {
    /// A scan at a pose that is known.
    #[must_use]
    pub fn at(stamp: f64, pose: Se2, view: PolarView) -> Self {
        Self {
            stamp,
            pose,
            view: Arc::new(view),
            step: Matrix3::zeros(),
            weakest: (0.0, 0.0),
            share: 1.0,
            surprised: false,
            torn: false,
        }
    }
}

/// Whether a scan has enough hits to determine where it was taken: ten.
#[must_use]
pub fn has_enough_hits(scan: &LaserScan) -> bool {
    scan.hits().take(LEAST_HITS).count() == LEAST_HITS
}

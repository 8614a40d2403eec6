//! How a camera is calibrated.

use groma_models::Lens;
use serde::{Deserialize, Serialize};

/// Settings of [`super::calibrate`].
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// The lens model.
    pub lens: Lens,
    /// Most views that are refined together; of more, those that tell most are taken and the others held out.
    pub most_views: usize,
    /// Corners farther from the median residual than this many median deviations are left out (5.2 is the X84 rule).
    pub rejection: f64,
    /// Largest standard deviation of the focal length that is given out, as a share of it.
    pub focal_tolerance: f64,
    /// How often the images are split into halves.
    pub splits: usize,
    /// Seed of the splits.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { lens: Lens::Radtan, most_views: 200, rejection: 5.2, focal_tolerance: 0.02, splits: 20, seed: 1 }
    }
}

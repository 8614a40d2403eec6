//! How a camera is calibrated.

use super::refusal::Refusal;
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
    /// Largest standard deviation of the focal length that is reported, as a share of it.
    pub focal_tolerance: f64,
    /// How often the images are split into halves.
    pub splits: usize,
    /// Seed of the splits.
    pub seed: u64,
}

impl Options {
    /// Refuses settings that make no sense.
    ///
    /// # Errors
    /// [`Refusal::Setting`], which names it and its value.
    pub fn validate(&self) -> Result<(), Refusal> {
        let require = |holds: bool, name, value: f64, rule| {
            if holds { Ok(()) } else { Err(Refusal::Setting { name, value, rule }) }
        };
        let views = (1..=100_000).contains(&self.most_views);
        require(views, "most_views", self.most_views as f64, "must be from 1 to 100 000")?;
        let rejection = self.rejection > 0.0 && self.rejection <= 1e6;
        require(rejection, "rejection", self.rejection, "must be above 0 and at most 1e6")?;
        require(self.focal_tolerance > 0.0, "focal_tolerance", self.focal_tolerance, "must be above 0")?;
        require(self.splits <= 10_000, "splits", self.splits as f64, "must be at most 10 000")
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { lens: Lens::Radtan, most_views: 200, rejection: 5.2, focal_tolerance: 0.02, splits: 20, seed: 1 }
    }
}

//! Settings of the reflector detector.

use crate::options::{InvalidOption, require};
use serde::{Deserialize, Serialize};

/// Settings of the reflector detector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// A reflector is at least so many times brighter than diffuse surfaces at its range.
    pub contrast: f64,
    /// And by so many times the upward spread of their logarithms.
    pub spread_factor: f64,
    /// The logarithm of its contrast is at least this share of that of the brightest mark of the scan.
    pub peer_share: f64,
    /// Narrowest mark [m].
    pub width_min: f64,
    /// Widest mark [m].
    pub width_max: f64,
    /// Radius of the posts that carry tape [m]; 0 where all marks are flat.
    pub post_radius: f64,
    /// Nearer beams are no reflectors [m].
    pub range_min: f64,
    /// Farther beams are no reflectors [m].
    pub range_max: f64,
    /// Least standard deviation of a range [m].
    pub range_noise: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            contrast: 2.0,
            spread_factor: 4.0,
            peer_share: 0.5,
            width_min: 0.03,
            width_max: 1.0,
            post_radius: 0.04,
            range_min: 0.3,
            range_max: 30.0,
            range_noise: 0.01,
        }
    }
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let finite = |x: f64, least: f64| x.is_finite() && x >= least;
        let positive = |x: f64| x.is_finite() && x > 0.0;
        require(self.contrast > 1.0 && self.contrast.is_finite(), "contrast", self.contrast, "above 1")?;
        require(finite(self.spread_factor, 0.0), "spread_factor", self.spread_factor, "0 or more")?;
        require((0.0..=1.0).contains(&self.peer_share), "peer_share", self.peer_share, "0 to 1")?;
        require(positive(self.width_min), "width_min", self.width_min, "above 0 m")?;
        require(finite(self.width_max, self.width_min), "width_max", self.width_max, "width_min or more")?;
        require(finite(self.post_radius, 0.0), "post_radius", self.post_radius, "0 m or more")?;
        require(positive(self.range_min), "range_min", self.range_min, "above 0 m")?;
        require(finite(self.range_max, self.range_min), "range_max", self.range_max, "range_min or more")?;
        require(positive(self.range_noise), "range_noise", self.range_noise, "above 0 m")
    }
}

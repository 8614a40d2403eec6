//! Settings of the detector.

use crate::options::{InvalidOption, require};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_4;

/// Settings of OC.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Radius of the neighbourhood at range zero [m].
    pub a: f64,
    /// Growth of its logarithm with range [1/m].
    pub b: f64,
    /// Nearer beams are no corners [m].
    pub range_min: f64,
    /// Farther beams are no corners [m].
    pub range_max: f64,
    /// Points a corner needs on each side.
    pub min_side_points: usize,
    /// Half the width of an arm [m].
    pub tolerance: f64,
    /// Step of the directions that are tried [rad].
    pub angle_step: f64,
    /// Width of the bins of the distance of a line from the scanner [m].
    pub rho_step: f64,
    /// Points farther than this do not vote for the direction [m].
    pub rho_max: f64,
    /// Radius within which only the best corner stays [m].
    pub suppression_radius: f64,
    /// Least standard deviation of a range, for the covariance of the corner [m].
    pub range_noise: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            a: 0.3,
            b: 0.07,
            range_min: 0.05,
            range_max: 30.0,
            min_side_points: 2,
            tolerance: 0.05,
            angle_step: 0.5_f64.to_radians(),
            rho_step: 0.02,
            rho_max: 10.0,
            suppression_radius: 0.3,
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
        let positive = |name, x: f64, rule| require(x.is_finite() && x > 0.0, name, x, rule);
        positive("a", self.a, "above 0 m")?;
        require(self.b.is_finite() && self.b >= 0.0, "b", self.b, "0 /m or more")?;
        positive("range_min", self.range_min, "above 0 m")?;
        require(self.range_max > self.range_min, "range_max", self.range_max, "above range_min")?;
        let points = self.min_side_points;
        require(points >= 1, "min_side_points", points as f64, "1 or more")?;
        positive("tolerance", self.tolerance, "above 0 m")?;
        let step = self.angle_step;
        require((1e-3..=FRAC_PI_4).contains(&step), "angle_step", step, "0.001 to pi / 4 rad")?;
        positive("rho_step", self.rho_step, "above 0 m")?;
        let bins = self.rho_max / self.rho_step;
        require((1.0..=15000.0).contains(&bins), "rho_max", self.rho_max, "1 to 15000 times rho_step")?;
        let radius = self.suppression_radius;
        require(radius.is_finite() && radius >= 0.0, "suppression_radius", radius, "0 m or more")?;
        positive("range_noise", self.range_noise, "above 0 m")
    }

    /// Radius of the neighbourhood of a beam of range `rho` [m].
    pub(super) fn radius(&self, rho: f64) -> f64 {
        let radius = self.a * (self.b * rho).exp();
        if radius >= rho { 0.8 * rho } else { radius }
    }
}

//! Settings of the signature.

use crate::options::{InvalidOption, require};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Most bins over the half turn.
pub(super) const MOST_DIRECTIONS: usize = 180;

/// Settings of GLAROT; the default suits local maps of tens of landmarks over some tens of metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Bins over the half turn of directions.
    pub n_theta: usize,
    /// Bins over the lengths.
    pub n_rho: usize,
    /// Longest pair that counts [m].
    pub rho_max: f64,
    /// Standard deviation of the kernel in direction [rad].
    pub sigma_theta: f64,
    /// Standard deviation of the kernel in length [m].
    pub sigma_rho: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { n_theta: 12, n_rho: 64, rho_max: 25.6, sigma_theta: PI / 16.0, sigma_rho: 0.3 }
    }
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        require((2..=MOST_DIRECTIONS).contains(&self.n_theta), "n_theta", self.n_theta as f64, "2 to 180")?;
        let cells = self.n_rho.saturating_mul(self.n_theta);
        require((1..=16384).contains(&cells), "n_rho", self.n_rho as f64, "1 or more, with n_theta * n_rho <= 16384")?;
        require(positive(self.rho_max), "rho_max", self.rho_max, "above 0 m")?;
        require(positive(self.sigma_theta), "sigma_theta", self.sigma_theta, "above 0 rad")?;
        require(positive(self.sigma_rho), "sigma_rho", self.sigma_rho, "above 0 m")
    }
}

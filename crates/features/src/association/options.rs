//! Settings of the association.

use crate::options::{InvalidOption, require};
use serde::{Deserialize, Serialize};

/// Settings of the association of two sets of landmarks.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Farthest that paired landmarks may lie apart, and lengths of pairs may differ [m].
    pub tolerance: f64,
    /// Least standard deviation of a landmark's coordinate, for the covariance [m].
    pub point_noise: f64,
    /// Shortest pair from which a motion is taken [m].
    pub min_length: f64,
    /// Longest such pair [m].
    pub max_length: f64,
    /// Fewest pairs of a hypothesis.
    pub min_pairs: usize,
    /// Most hypotheses returned.
    pub max_hypotheses: usize,
    /// Two hypotheses differ where they move the middle of b this far apart [m] ...
    pub distinct_translation: f64,
    /// ... or turn it this differently [rad].
    pub distinct_rotation: f64,
    /// Most motions looked at; above it the pairs of a are thinned out evenly.
    pub max_motions: usize,
    /// Most motions for which inliers are counted; above it votes decide which.
    pub max_verified: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 0.2,
            point_noise: 0.03,
            min_length: 1.0,
            max_length: 20.0,
            min_pairs: 4,
            max_hypotheses: 5,
            distinct_translation: 0.5,
            distinct_rotation: 10.0_f64.to_radians(),
            max_motions: 100_000,
            max_verified: 3_000,
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
        positive("tolerance", self.tolerance, "above 0 m")?;
        positive("point_noise", self.point_noise, "above 0 m")?;
        positive("min_length", self.min_length, "above 0 m")?;
        require(self.max_length > self.min_length, "max_length", self.max_length, "above min_length")?;
        require(self.min_pairs >= 2, "min_pairs", self.min_pairs as f64, "2 or more")?;
        positive("distinct_translation", self.distinct_translation, "above 0 m")?;
        positive("distinct_rotation", self.distinct_rotation, "above 0 rad")?;
        let counts = [
            ("max_hypotheses", self.max_hypotheses),
            ("max_motions", self.max_motions),
            ("max_verified", self.max_verified),
        ];
        counts.into_iter().try_for_each(|(name, n)| require(n >= 1, name, n as f64, "1 or more"))
    }
}

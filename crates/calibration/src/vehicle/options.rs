//! Settings of a calibration.

use super::Error;
use groma_estimation::Student;
use groma_models::WheelNoise;
use serde::{Deserialize, Serialize};

/// Numbers in a residual.
pub const RESIDUAL: f64 = 3.0;
/// A delay beyond this is a clock of its own [s].
const LONGEST_DELAY: f64 = 10.0;

/// Settings; the default suits an industrial vehicle with a safety scanner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Whether outliers are expected: Student's distribution instead of the normal one.
    pub robust: bool,
    /// Degrees of freedom of Student's distribution.
    pub tail: f64,
    /// Whether the stated noise is taken as it is; otherwise the residuals scale it.
    pub noise_known: bool,
    /// What the wheels do beside what they read.
    #[serde(flatten)]
    pub noise: WheelNoise,
    /// Parts of the motions that are held out in turn; 0 leaves this out.
    pub folds: usize,
    /// Level at which an asymmetry of the steering is accepted.
    pub asymmetry_level: f64,
    /// An asymmetry less certain than this is not believed whatever its size [rad].
    pub asymmetry_sigma_max: f64,
    /// Largest delay that is looked for [s].
    pub delay_max: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            robust: true,
            tail: 4.0,
            noise_known: false,
            noise: WheelNoise::default(),
            folds: 2,
            asymmetry_level: 0.01,
            asymmetry_sigma_max: 1_f64.to_radians(),
            delay_max: 0.2,
        }
    }
}

impl Options {
    /// How residuals with outliers scatter.
    #[must_use]
    pub fn student(&self) -> Student {
        Student { dof: self.tail, dimension: RESIDUAL }
    }

    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is not.
    pub fn validate(&self) -> Result<(), Error> {
        self.noise.validate().map_err(|e| Error::Parameter(e.to_string()))?;
        let checks = [
            (self.tail.is_finite() && self.tail > 0.0, "tail", "above 0"),
            (self.folds != 1, "folds", "0, or 2 or more"),
            (self.asymmetry_level > 0.0 && self.asymmetry_level < 1.0, "asymmetry_level", "between 0 and 1"),
            (self.asymmetry_sigma_max > 0.0, "asymmetry_sigma_max", "above 0 rad"),
            ((0.0..=LONGEST_DELAY).contains(&self.delay_max), "delay_max", "between 0 and 10 s"),
        ];
        match checks.iter().find(|(fits, ..)| !fits) {
            None => Ok(()),
            Some((_, name, bounds)) => Err(Error::Parameter(format!("setting {name} must be {bounds}"))),
        }
    }
}

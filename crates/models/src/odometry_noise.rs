//! How far odometry is to be trusted: a random walk along, across and in heading.
//!
//! For a step of length ds that turns by dtheta, with the error w on the right of the motion:
//!
//! ```text
//! Q = diag(k_l^2 ds, k_t^2 ds, k_r^2 ds + k_rr^2 |dtheta|)
//! ```
//!
//! Variances grow with the path, so steps may be cut at will, but a step must be short against the turns of the path:
//! feed the odometry as it comes. Systematic errors (a wrong wheel radius) are beyond it: calibrate the vehicle.

use crate::error::{ModelError, require};
use groma_geometry::Se2;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Strengths of the random walk.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct OdometryNoise {
    /// k_l: along the path, per root of a metre [m/sqrt(m)].
    pub along: f64,
    /// k_t: across the path, per root of a metre [m/sqrt(m)].
    pub across: f64,
    /// k_r: heading, per root of a metre [rad/sqrt(m)].
    pub heading: f64,
    /// k_rr: heading, per root of a radian turned [rad/sqrt(rad)].
    pub turning: f64,
}

impl Default for OdometryNoise {
    /// Wheels on a hard floor: 2 cm and 1 cm after a metre, 0.5 degrees after a metre, 1 degree after a right angle.
    fn default() -> Self {
        let degree = 1f64.to_radians();
        Self { along: 0.02, across: 0.01, heading: 0.5 * degree, turning: degree / 90f64.to_radians().sqrt() }
    }
}

impl OdometryNoise {
    /// Odometry that does not say how good it is: good wheels that nobody calibrated.
    #[must_use]
    pub fn uncalibrated() -> Self {
        Self { along: 0.03, across: 0.03, heading: 0.03, turning: 0.05 }
    }

    /// Whether every number is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), ModelError> {
        let rule = "must be between 0 and 1000";
        let parts = [
            ("odometry.along", self.along),
            ("odometry.across", self.across),
            ("odometry.heading", self.heading),
            ("odometry.turning", self.turning),
        ];
        parts.into_iter().try_for_each(|(name, v)| require(name, v, (0.0..=1e3).contains(&v), rule))
    }

    /// The variances of w for one step: along [m^2], across [m^2], heading [rad^2].
    #[must_use]
    pub fn variances(&self, step: &Se2) -> Vector3<f64> {
        let (ds, turn) = (step.translation.norm(), step.theta().abs());
        let heading = self.heading.powi(2) * ds + self.turning.powi(2) * turn;
        Vector3::new(self.along.powi(2) * ds, self.across.powi(2) * ds, heading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_times_the_way_is_twice_the_error_and_a_turn_bends_the_heading_alone() {
        let noise = OdometryNoise { along: 0.02, across: 0.01, heading: 0.03, turning: 0.05 };
        let one = Vector3::new(0.02, 0.01, 0.03);
        let sigma = |x: f64, turn: f64| noise.variances(&Se2::new(x, 0.0, turn)).map(f64::sqrt);
        assert!((sigma(1.0, 0.0) - one).norm() < 1e-12);
        assert!((sigma(-4.0, 0.0) - one * 2.0).norm() < 1e-12);
        assert!((sigma(0.0, -1.0) - Vector3::new(0.0, 0.0, 0.05)).norm() < 1e-12);
    }

    #[test]
    fn noise_out_of_range_is_refused_by_name() {
        for bad in [f64::NAN, f64::INFINITY, -1e-9, 1e300] {
            let noise = OdometryNoise { across: bad, ..OdometryNoise::default() };
            assert!(noise.validate().unwrap_err().to_string().starts_with("odometry.across"));
        }
        assert!(OdometryNoise::uncalibrated().validate().is_ok());
    }
}

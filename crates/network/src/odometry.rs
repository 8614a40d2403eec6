//! How far odometry is to be trusted: a random walk along, across and in heading.
//!
//! For a step `u = (dx, dy, 0, 0, 0, dtheta)` of length ds in the body frame, `T' = T Exp(u) Exp(w)`:
//!
//! ```text
//! Q = diag(k_l^2 ds, k_t^2 ds, 0, 0, 0, k_r^2 ds + k_rr^2 |dtheta|)
//! ```
//!
//! Variances grow with the path, so steps may be cut at will, but a step must be short against the turns of the path:
//! feed the odometry as it comes. Systematic errors (a wrong wheel radius) are beyond it: calibrate the vehicle.

use groma_geometry::{LieGroup, Se2, Se3};
use nalgebra::{Matrix6, Vector6};
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
    /// The variances of w for one step, in the order of the tangent of SE(3).
    #[must_use]
    pub fn variances(&self, step: &Se2) -> Vector6<f64> {
        let (ds, turn) = (step.translation.norm(), step.theta().abs());
        let heading = self.heading.powi(2) * ds + self.turning.powi(2) * turn;
        Vector6::new(self.along.powi(2) * ds, self.across.powi(2) * ds, 0.0, 0.0, 0.0, heading)
    }
}

/// A motion of the plane as one of space.
#[must_use]
pub fn lifted(step: &Se2) -> Se3 {
    let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, step.theta());
    Se3 { translation: [step.x(), step.y(), 0.0].into(), ..Se3::exp(&turn) }
}

/// A motion that is the product of steps, and the covariance of its error on the right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// The product.
    pub pose: Se3,
    /// Covariance of w in `pose Exp(w)`.
    pub covariance: Matrix6<f64>,
    /// Length of the path [m].
    pub length: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self { pose: Se3::identity(), covariance: Matrix6::zeros(), length: 0.0 }
    }
}

impl Motion {
    /// The motion followed by one more step.
    #[must_use]
    pub fn then(&self, step: &Se2, noise: &OdometryNoise) -> Self {
        let u = lifted(step);
        let back = u.inverse().adjoint();
        let covariance = back * self.covariance * back.transpose() + Matrix6::from_diagonal(&noise.variances(step));
        Self { pose: self.pose * u, covariance, length: self.length + step.translation.norm() }
    }
}

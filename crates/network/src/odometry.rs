//! The motions of odometry in space, with the covariance that its noise gives them: `T' = T Exp(u) Exp(w)` for a step
//! `u = (dx, dy, 0, 0, 0, dtheta)` in the body frame, w with the variances of [`OdometryNoise`], which knows no height, roll
//! and pitch.

use groma_geometry::{LieGroup, Se2, Se3};
pub use groma_models::OdometryNoise;
use nalgebra::{Matrix6, Vector6};

/// The variances of w for one step, in the order of the tangent of SE(3).
#[must_use]
pub fn variances(noise: &OdometryNoise, step: &Se2) -> Vector6<f64> {
    let v = noise.variances(step);
    Vector6::new(v.x, v.y, 0.0, 0.0, 0.0, v.z)
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
        let covariance = back * self.covariance * back.transpose() + Matrix6::from_diagonal(&variances(noise, step));
        Self { pose: self.pose * u, covariance, length: self.length + step.translation.norm() }
    }
}

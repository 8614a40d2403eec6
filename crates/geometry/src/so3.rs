//! SO(3): rotations of space, stored as unit quaternions.
//!
//! Tangent `w = theta u` (axis times angle); `W = [w]_x`:
//!
//! ```text
//! exp(w)    = (cos theta/2, sin theta/2 u)
//! log(q)    = 2 atan2(|v|, w) v/|v|   with the sign of q such that w >= 0
//! Ad_R      = R
//! Jr(w)     = I - (1 - cos)/theta^2 W + (theta - sin)/theta^3 W^2
//! Jr^-1(w)  = I + W/2 + (1/theta^2 - cot(theta/2)/(2 theta)) W^2
//! ```
//!
//! Source: Sola et al., equations (132)-(146).

use crate::lie_group::LieGroup;
use crate::series::tail;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use std::ops::Mul;

/// A rotation of space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct So3 {
    /// The unit quaternion; it and its negative are the same rotation.
    pub quaternion: UnitQuaternion<f64>,
}

impl So3 {
    /// The 3x3 rotation matrix.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        *self.quaternion.to_rotation_matrix().matrix()
    }
}

impl LieGroup<3> for So3 {
    type Point = Vector3<f64>;

    fn identity() -> Self {
        Self { quaternion: UnitQuaternion::identity() }
    }

    fn inverse(&self) -> Self {
        Self { quaternion: self.quaternion.inverse() }
    }

    fn exp(w: &Vector3<f64>) -> Self {
        let half = w.norm() / 2.0;
        let v = w * (tail(1, half) / 2.0);
        Self { quaternion: UnitQuaternion::new_normalize(Quaternion::from_parts(half.cos(), v)) }
    }

    fn log(&self) -> Vector3<f64> {
        let (w, v) = (self.quaternion.w, self.quaternion.imag());
        let sign = if w < 0.0 { -1.0 } else { 1.0 };
        let (w, n) = (w * sign, v.norm());
        // atan2(n, w)/n is 1/w - n^2/(3 w^3) + ...; below 1e-8 the first term is exact.
        let scale = if n < 1e-8 { 2.0 / w } else { 2.0 * n.atan2(w) / n };
        v * (sign * scale)
    }

    fn adjoint(&self) -> Matrix3<f64> {
        self.matrix()
    }

    fn act(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.quaternion * point
    }

    fn right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
        let (theta, hat) = (w.norm(), w.cross_matrix());
        Matrix3::identity() - hat * tail(2, theta) + hat * hat * tail(3, theta)
    }

    fn right_jacobian_inverse(w: &Vector3<f64>) -> Matrix3<f64> {
        let (theta, hat) = (w.norm(), w.cross_matrix());
        Matrix3::identity() + hat / 2.0 + hat * hat * inverse_coefficient(theta)
    }
}

/// `1/t^2 - cot(t/2)/(2t)`, by series near zero.
fn inverse_coefficient(t: f64) -> f64 {
    if t < 0.05 {
        let t2 = t * t;
        return 1.0 / 12.0 + t2 / 720.0 * (1.0 + t2 / 42.0);
    }
    (1.0 - t / 2.0 / (t / 2.0).tan()) / (t * t)
}

impl Mul for So3 {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self { quaternion: UnitQuaternion::new_normalize((self.quaternion * b.quaternion).into_inner()) }
    }
}

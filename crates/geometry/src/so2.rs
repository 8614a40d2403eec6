//! SO(2): rotations of the plane, stored as the unit complex number `(cos, sin)`.
//!
//! `exp(w) = (cos w, sin w)`, `log(R) = atan2(sin, cos)`, adjoint and Jacobians are 1 (Sola et al., appendix A).

use crate::lie_group::LieGroup;
use nalgebra::{Matrix1, Matrix2, Vector1, Vector2};
use std::ops::Mul;

/// A rotation of the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct So2 {
    /// Cosine of the angle.
    pub cos: f64,
    /// Sine of the angle.
    pub sin: f64,
}

impl So2 {
    /// The rotation that moves nothing.
    pub const IDENTITY: Self = Self { cos: 1.0, sin: 0.0 };

    /// The rotation by `angle` radians, counter-clockwise.
    #[must_use]
    pub fn exp(angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Self { cos, sin }
    }

    /// The angle in `(-pi, pi]`.
    #[must_use]
    pub fn log(self) -> f64 {
        self.sin.atan2(self.cos)
    }

    /// The opposite rotation.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { cos: self.cos, sin: -self.sin }
    }

    /// The rotated vector.
    #[must_use]
    pub fn act(self, v: Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.cos * v.x - self.sin * v.y, self.sin * v.x + self.cos * v.y)
    }

    /// The 2x2 rotation matrix.
    #[must_use]
    pub fn matrix(self) -> Matrix2<f64> {
        Matrix2::new(self.cos, -self.sin, self.sin, self.cos)
    }

    /// The same rotation with its complex number scaled back to length one (products drift by an ulp each).
    #[must_use]
    pub fn normalized(self) -> Self {
        let n = (self.cos * self.cos + self.sin * self.sin).sqrt();
        Self { cos: self.cos / n, sin: self.sin / n }
    }
}

impl Mul for So2 {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self { cos: self.cos * b.cos - self.sin * b.sin, sin: self.sin * b.cos + self.cos * b.sin }
    }
}

impl LieGroup<1> for So2 {
    type Point = Vector2<f64>;

    fn identity() -> Self {
        Self::IDENTITY
    }

    fn inverse(&self) -> Self {
        Self::inverse(*self)
    }

    fn exp(xi: &Vector1<f64>) -> Self {
        Self::exp(xi.x)
    }

    fn log(&self) -> Vector1<f64> {
        Vector1::new(Self::log(*self))
    }

    fn adjoint(&self) -> Matrix1<f64> {
        Matrix1::identity()
    }

    fn act(&self, point: &Vector2<f64>) -> Vector2<f64> {
        Self::act(*self, *point)
    }

    fn right_jacobian(_: &Vector1<f64>) -> Matrix1<f64> {
        Matrix1::identity()
    }

    fn right_jacobian_inverse(_: &Vector1<f64>) -> Matrix1<f64> {
        Matrix1::identity()
    }
}

//! SE(2): rigid motions of the plane.
//!
//! Tangent `xi = (rho_x, rho_y, theta)`. With `s = sin(theta)/theta`, `c = (1 - cos(theta))/theta`:
//!
//! ```text
//! exp(xi) = ( V(theta) rho, theta ),   V = [[s, -c], [c, s]]
//! Ad_T    = [[R, (t_y, -t_x)^T], [0, 1]]
//! Jr(xi)  = [[s, c, (theta rho_x - rho_y + rho_y cos - rho_x sin)/theta^2],
//!            [-c, s, (rho_x + theta rho_y - rho_x cos - rho_y sin)/theta^2],
//!            [0, 0, 1]]
//! Jl(xi)  = Jr(-xi)
//! ```
//!
//! Source: Sola et al., equations (153)-(164).

use crate::lie_group::LieGroup;
use crate::series::tail;
use crate::so2::So2;
use nalgebra::{Matrix3, Vector2, Vector3};
use std::ops::Mul;

/// A rigid motion of the plane, `p_a = R p_b + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Se2 {
    /// The rotation R.
    pub rotation: So2,
    /// The translation t: the origin of b seen from a [m].
    pub translation: Vector2<f64>,
}

impl Se2 {
    /// The motion that moves nothing.
    pub const IDENTITY: Self = Self { rotation: So2::IDENTITY, translation: Vector2::new(0.0, 0.0) };

    /// From position [m] and heading [rad].
    #[must_use]
    pub fn new(x: f64, y: f64, theta: f64) -> Self {
        Self { rotation: So2::exp(theta), translation: Vector2::new(x, y) }
    }

    /// Position x [m].
    #[must_use]
    pub fn x(&self) -> f64 {
        self.translation.x
    }

    /// Position y [m].
    #[must_use]
    pub fn y(&self) -> f64 {
        self.translation.y
    }

    /// Heading in `(-pi, pi]` [rad].
    #[must_use]
    pub fn theta(&self) -> f64 {
        self.rotation.log()
    }

    /// `(x, y, theta)`.
    #[must_use]
    pub fn to_vector(&self) -> Vector3<f64> {
        Vector3::new(self.x(), self.y(), self.theta())
    }

    /// The inverse motion.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: -rotation.act(self.translation) }
    }

    /// The point `p` (coordinates in b) in coordinates of a.
    #[must_use]
    pub fn act(&self, p: Vector2<f64>) -> Vector2<f64> {
        self.rotation.act(p) + self.translation
    }

    /// `self^-1 * other`: `other` seen from `self`.
    #[must_use]
    pub fn between(&self, other: &Self) -> Self {
        let inverse = self.rotation.inverse();
        Self {
            rotation: (inverse * other.rotation).normalized(),
            translation: inverse.act(other.translation - self.translation),
        }
    }

    /// The exponential map.
    #[must_use]
    pub fn exp(xi: Vector3<f64>) -> Self {
        let (s, c) = arc(xi.z);
        Self { rotation: So2::exp(xi.z), translation: Vector2::new(s * xi.x - c * xi.y, c * xi.x + s * xi.y) }
    }

    /// The logarithm, heading part in `(-pi, pi]`.
    #[must_use]
    pub fn log(&self) -> Vector3<f64> {
        let theta = self.theta();
        let (s, c) = arc(theta);
        let det = s * s + c * c;
        let t = self.translation;
        Vector3::new((s * t.x + c * t.y) / det, (s * t.y - c * t.x) / det, theta)
    }

    /// `self * exp(xi)`.
    #[must_use]
    pub fn plus(&self, xi: Vector3<f64>) -> Self {
        *self * Self::exp(xi)
    }

    /// `log(other^-1 * self)`: the tangent at `other` that leads to `self`.
    #[must_use]
    pub fn minus(&self, other: &Self) -> Vector3<f64> {
        other.between(self).log()
    }

    /// The adjoint: `T * exp(xi) = exp(Ad_T xi) * T`.
    #[must_use]
    pub fn adjoint(&self) -> Matrix3<f64> {
        let (c, s, t) = (self.rotation.cos, self.rotation.sin, self.translation);
        Matrix3::new(c, -s, t.y, s, c, -t.x, 0.0, 0.0, 1.0)
    }

    /// The right Jacobian of the exponential: `exp(xi + d) ~ exp(xi) * exp(Jr(xi) d)`.
    #[must_use]
    pub fn right_jacobian(xi: Vector3<f64>) -> Matrix3<f64> {
        let (s, c) = arc(xi.z);
        let (a, b) = (xi.z * tail(3, xi.z), tail(2, xi.z));
        Matrix3::new(s, c, a * xi.x - b * xi.y, -c, s, b * xi.x + a * xi.y, 0.0, 0.0, 1.0)
    }

    /// The left Jacobian of the exponential: `exp(xi + d) ~ exp(Jl(xi) d) * exp(xi)`.
    #[must_use]
    pub fn left_jacobian(xi: Vector3<f64>) -> Matrix3<f64> {
        Self::right_jacobian(-xi)
    }

    /// The inverse of the right Jacobian, for less than a whole turn.
    #[must_use]
    pub fn right_jacobian_inverse(xi: Vector3<f64>) -> Matrix3<f64> {
        let j = Self::right_jacobian(xi);
        let (s, c, det) = (j.m11, j.m12, j.m11 * j.m11 + j.m12 * j.m12);
        let (x, y) = ((s * j.m13 - c * j.m23) / det, (c * j.m13 + s * j.m23) / det);
        Matrix3::new(s / det, -c / det, -x, c / det, s / det, -y, 0.0, 0.0, 1.0)
    }

    /// The point a share `u` of the way from `self` to `other` along the constant-twist path; `u` in `[0, 1]`.
    #[must_use]
    pub fn interpolate(&self, other: &Self, u: f64) -> Self {
        self.plus(other.minus(self) * u)
    }
}

impl Mul for Se2 {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self { rotation: (self.rotation * b.rotation).normalized(), translation: self.act(b.translation) }
    }
}

impl LieGroup<3> for Se2 {
    type Point = Vector2<f64>;

    fn identity() -> Self {
        Self::IDENTITY
    }

    fn inverse(&self) -> Self {
        self.inverse()
    }

    fn exp(xi: &Vector3<f64>) -> Self {
        Self::exp(*xi)
    }

    fn log(&self) -> Vector3<f64> {
        self.log()
    }

    fn adjoint(&self) -> Matrix3<f64> {
        self.adjoint()
    }

    fn act(&self, point: &Vector2<f64>) -> Vector2<f64> {
        self.act(*point)
    }

    fn right_jacobian(xi: &Vector3<f64>) -> Matrix3<f64> {
        Self::right_jacobian(*xi)
    }

    fn right_jacobian_inverse(xi: &Vector3<f64>) -> Matrix3<f64> {
        Self::right_jacobian_inverse(*xi)
    }
}

/// `(sin t / t, (1 - cos t) / t)`, by series near zero and by the half angle elsewhere, which does not cancel.
fn arc(t: f64) -> (f64, f64) {
    if t.abs() < 1e-4 {
        let t2 = t * t;
        return (1.0 - t2 / 6.0 * (1.0 - t2 / 20.0), t / 2.0 * (1.0 - t2 / 12.0));
    }
    let (sin, cos) = (t / 2.0).sin_cos();
    (2.0 * sin * cos / t, 2.0 * sin * sin / t)
}

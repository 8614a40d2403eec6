//! What the four groups have in common.
//!
//! Tangents are D numbers; `exp` takes them to the group, and a neighbour of x is `x * exp(xi)` (a right, body-frame
//! perturbation). Notation and identities: Sola et al., sections II and III.

use nalgebra::{SMatrix, SVector};
use std::ops::Mul;

/// A Lie group with D-dimensional tangents.
pub trait LieGroup<const D: usize>: Copy + Mul<Output = Self> {
    /// What the group moves.
    type Point;

    /// The element that moves nothing.
    fn identity() -> Self;

    /// The element that undoes this one.
    #[must_use]
    fn inverse(&self) -> Self;

    /// The exponential map.
    #[must_use]
    fn exp(xi: &SVector<f64, D>) -> Self;

    /// The logarithm of least length: `exp(log(x)) = x`.
    #[must_use]
    fn log(&self) -> SVector<f64, D>;

    /// The adjoint: `x * exp(xi) = exp(Ad_x xi) * x`.
    #[must_use]
    fn adjoint(&self) -> SMatrix<f64, D, D>;

    /// The point in coordinates of frame a, for an element `T_a_b` and coordinates in frame b.
    #[must_use]
    fn act(&self, point: &Self::Point) -> Self::Point;

    /// `exp(xi + d) ~ exp(xi) * exp(Jr(xi) d)`.
    #[must_use]
    fn right_jacobian(xi: &SVector<f64, D>) -> SMatrix<f64, D, D>;

    /// `log(exp(xi) * exp(d)) ~ xi + Jr^-1(xi) d`; for a rotation by less than a whole turn.
    #[must_use]
    fn right_jacobian_inverse(xi: &SVector<f64, D>) -> SMatrix<f64, D, D>;

    /// `exp(xi + d) ~ exp(Jl(xi) d) * exp(xi)`.
    #[must_use]
    fn left_jacobian(xi: &SVector<f64, D>) -> SMatrix<f64, D, D> {
        Self::right_jacobian(&-xi)
    }

    /// `log(exp(d) * exp(xi)) ~ xi + Jl^-1(xi) d`; for a rotation by less than a whole turn.
    #[must_use]
    fn left_jacobian_inverse(xi: &SVector<f64, D>) -> SMatrix<f64, D, D> {
        Self::right_jacobian_inverse(&-xi)
    }

    /// `self^-1 * other`.
    #[must_use]
    fn between(&self, other: &Self) -> Self {
        self.inverse() * *other
    }

    /// `self * exp(xi)`.
    #[must_use]
    fn plus(&self, xi: &SVector<f64, D>) -> Self {
        *self * Self::exp(xi)
    }

    /// `log(other^-1 * self)`: the tangent at `other` that leads to `self`.
    #[must_use]
    fn minus(&self, other: &Self) -> SVector<f64, D> {
        other.between(self).log()
    }

    /// The element a share `u` of the way from `self` to `other` along the path of constant twist.
    #[must_use]
    fn interpolate(&self, other: &Self, u: f64) -> Self {
        self.plus(&(other.minus(self) * u))
    }
}

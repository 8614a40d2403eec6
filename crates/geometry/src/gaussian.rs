//! A Gaussian on a Lie group: `x = mean * exp(xi)`, `xi ~ N(0, covariance)`, a right (body-frame) perturbation.
//!
//! For independent a and b, to first order:
//!
//! ```text
//! a * b      mean a b,      covariance  Ad_(b^-1) A Ad_(b^-1)^T + B
//! a^-1       mean a^-1,     covariance  Ad_a A Ad_a^T
//! a^-1 * b   mean a^-1 b,   covariance  Ad_(b^-1 a) A Ad_(b^-1 a)^T + B
//! ```
//!
//! Good while the rotation part spreads by less than about 0.3 rad. Source: Barfoot, Furgale, T-RO 30 (2014) 679;
//! Sola et al., section III-C. Correlated elements are beyond it: their joint covariance is needed.

use crate::lie_group::LieGroup;
use nalgebra::{Matrix2, SMatrix, SVector};

/// A mean and the covariance of its right perturbation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian<G, const D: usize> {
    /// The mean.
    pub mean: G,
    /// The covariance of xi.
    pub covariance: SMatrix<f64, D, D>,
}

impl<G: LieGroup<D>, const D: usize> Gaussian<G, D> {
    /// The product of two independent elements.
    #[must_use]
    pub fn compose(&self, other: &Self) -> Self {
        let moved = transport(&other.mean.inverse(), &self.covariance);
        Self { mean: self.mean * other.mean, covariance: moved + other.covariance }
    }

    /// The inverse.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self { mean: self.mean.inverse(), covariance: transport(&self.mean, &self.covariance) }
    }

    /// `self^-1 * other`, of independent elements.
    #[must_use]
    pub fn between(&self, other: &Self) -> Self {
        self.inverse().compose(other)
    }

    /// The squared Mahalanobis distance of `x` from the mean; nothing when the covariance is not positive definite.
    #[must_use]
    pub fn mahalanobis_sq(&self, x: &G) -> Option<f64> {
        let xi: SVector<f64, D> = x.minus(&self.mean);
        let cholesky = nalgebra::linalg::Cholesky::new(self.covariance)?;
        Some(xi.dot(&cholesky.solve(&xi)))
    }
}

/// Standard deviation along the worst direction of the plane: root of the larger eigenvalue.
#[must_use]
pub fn largest_sigma(covariance: &Matrix2<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}

/// `Ad_x C Ad_x^T`.
fn transport<G: LieGroup<D>, const D: usize>(x: &G, covariance: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let adjoint = x.adjoint();
    adjoint * covariance * adjoint.transpose()
}

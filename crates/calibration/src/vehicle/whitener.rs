//! Residuals with what they share taken out: white, one after the other.
//!
//! Residual k of three numbers is `r_k = G_k e_k + n_k` with the steering error e at the start of its motion, which goes on as
//! `e_(k+1) = keep e_k + fresh`, and n of covariance S_k, of which neighbours share C_k. Of each, what those before tell is
//! taken out. With m, P mean and variance of e, v the mean of n, X the covariance of e and n, all given those before:
//!
//! ```text
//! V = S_k - M M^T                                        M = C_(k-1)^T L^-T of the residual before
//! L L^T = V + P G G^T + G X^T + X G^T,    y = L^-1 (r - G m - v)
//! h = L^-1 (keep (P G + X) + with_next)
//! m <- keep m + h^T y,   P <- keep^2 P + fresh - h^T h,   v <- M y,   X <- -M h
//! ```
//!
//! This is the Cholesky factor of the covariance of all residuals, in time linear in their number. Source: the innovations
//! form of the Kalman filter, Anderson, Moore, "Optimal filtering" (1979), section 9.3.

use super::likelihood::Row;
use super::noise::{Scatter, SharedSteering, SteeringLink};
use nalgebra::{Matrix3, RowSVector, SMatrix, Vector3};

/// The Cholesky factor of the covariance of all residuals, undone.
#[derive(Clone, Debug)]
pub struct Whitener(Vec<Link>);

/// How a residual is whitened, and its effect on the next.
#[derive(Clone, Copy, Debug)]
struct Link {
    inverse: Matrix3<f64>,
    /// The mean of n of the next residual by this one.
    coupling: Matrix3<f64>,
    by_start: Vector3<f64>,
    keep: f64,
    /// The steering error at the start of the next motion by this residual.
    steering: Vector3<f64>,
}

/// What is known before a residual.
struct Known {
    steering: f64,
    with_steering: Vector3<f64>,
    coupling: Matrix3<f64>,
}

impl Whitener {
    /// Nothing when the covariance is not positive definite.
    #[must_use]
    pub fn new(scatter: &Scatter) -> Option<Self> {
        let variance = scatter.steering.as_ref().map_or(0.0, |s| s.variance);
        let mut known = Known { steering: variance, with_steering: Vector3::zeros(), coupling: Matrix3::zeros() };
        let mut links: Vec<Link> = Vec::with_capacity(scatter.blocks.len());
        for (k, block) in scatter.blocks.iter().enumerate() {
            let shared = scatter.couplings.as_ref().and_then(|all| all.get(k));
            let link = match (links.last(), scatter.common) {
                (Some(same), true) => *same,
                _ => known.link(block, shared, steering_link(scatter.steering.as_ref(), k))?,
            };
            links.push(link);
        }
        Some(Self(links))
    }

    /// White columns of any number.
    #[must_use]
    pub fn columns<const N: usize>(&self, columns: &[SMatrix<f64, 3, N>]) -> Vec<SMatrix<f64, 3, N>> {
        let (mut steering, mut mean) = (RowSVector::<f64, N>::zeros(), SMatrix::<f64, 3, N>::zeros());
        let white = |(link, column): (&Link, &SMatrix<f64, 3, N>)| {
            let white = link.inverse * (column - link.by_start * steering - mean);
            steering = steering * link.keep + link.steering.transpose() * white;
            mean = link.coupling * white;
            white
        };
        self.0.iter().zip(columns).map(white).collect()
    }

    /// White rows.
    #[must_use]
    pub fn rows(&self, rows: &[Row]) -> Vec<Row> {
        let residuals: Vec<Vector3<f64>> = rows.iter().map(|row| row.residual).collect();
        let designs: Vec<_> = rows.iter().map(|row| row.design).collect();
        let white = self.columns(&residuals).into_iter().zip(self.columns(&designs));
        white.map(|(residual, design)| Row { residual, design }).collect()
    }
}

fn steering_link(steering: Option<&SharedSteering>, k: usize) -> SteeringLink {
    let none = SteeringLink { by_start: Vector3::zeros(), keep: 0.0, fresh: 0.0, with_next: Vector3::zeros() };
    steering.and_then(|s| s.links.get(k)).copied().unwrap_or(none)
}

impl Known {
    /// The link of a residual of covariance `block` that shares `shared` with the next; goes on to that.
    fn link(&mut self, block: &Matrix3<f64>, shared: Option<&Matrix3<f64>>, steering: SteeringLink) -> Option<Link> {
        let SteeringLink { by_start, keep, fresh, with_next } = steering;
        let across = by_start * self.with_steering.transpose();
        let own = block - self.coupling * self.coupling.transpose();
        let covariance = own + by_start * by_start.transpose() * self.steering + across + across.transpose();
        let inverse = covariance.cholesky()?.l().try_inverse()?;
        let tells = inverse * ((by_start * self.steering + self.with_steering) * keep + with_next);
        let coupling = shared.map_or_else(Matrix3::zeros, |c| c.transpose() * inverse.transpose());
        self.steering = (keep * keep * self.steering + fresh - tells.norm_squared()).max(0.0);
        self.with_steering = -(coupling * tells);
        self.coupling = coupling;
        Some(Link { inverse, coupling, by_start, keep, steering: tells })
    }
}

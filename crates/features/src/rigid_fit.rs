//! The rigid motion that takes paired points onto each other, in closed form, with its covariance.
//!
//! ```text
//! minimise sum |a_i - (R b_i + t)|^2;   a~, b~ = points less their means
//! theta = atan2( sum b~ x a~ , sum b~ . a~ ),   t = mean(a) - R mean(b)
//! ```
//!
//! A rotation by construction: the mirrored solution of the general orthogonal problem cannot come out.
//! The covariance is that of xi in `T exp(xi)`, for independent errors of one variance s^2 in every coordinate of a pair:
//!
//! ```text
//! var(angle) = s^2 / S,   S = sum |b~|^2,   m = (-mean(b)_y, mean(b)_x)
//! cov(position) = s^2 (I / n + m m^T / S),   cov(position, angle) = -s^2 m / S
//! s^2 = max( least_sigma^2 , residual sum / (2 n - 3) )
//! ```
//!
//! Source: Umeyama, PAMI 13(4), 1991, for the plane; the covariance is the inverse normal matrix, written out.

use groma_geometry::{Se2, So2};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// A fitted motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidFit {
    /// `T_a_b`.
    pub transform: Se2,
    /// Covariance of the perturbation `T_a_b * exp(xi)`.
    pub covariance: Matrix3<f64>,
    /// Root mean square distance of the pairs after the fit [m].
    pub rms: f64,
}

/// Fit `T_a_b` to pairs `(a, b)` of points; the errors are assumed to be at least `least_sigma` [m] a coordinate.
///
/// None for fewer than two pairs, points b that coincide, or values that are not finite.
#[must_use]
pub fn rigid_fit(pairs: &[(Vector2<f64>, Vector2<f64>)], least_sigma: f64) -> Option<RigidFit> {
    let n = pairs.len() as f64;
    let (mean_a, mean_b) = pairs.iter().fold((Vector2::zeros(), Vector2::zeros()), |(a, b), p| (a + p.0, b + p.1));
    let (mean_a, mean_b) = (mean_a / n, mean_b / n);
    let centred = || pairs.iter().map(|p| (p.0 - mean_a, p.1 - mean_b));
    let (along, across) = centred().fold((0.0, 0.0), |(dot, cross), (a, b)| (dot + b.dot(&a), cross + b.perp(&a)));
    let spread: f64 = centred().map(|(_, b)| b.norm_squared()).sum();
    let length = f64::hypot(along, across);
    if pairs.len() < 2 || !(spread > 0.0 && length > 0.0 && length.is_finite()) {
        return None;
    }
    let rotation = So2 { cos: along / length, sin: across / length };
    let transform = Se2 { rotation, translation: mean_a - rotation.act(mean_b) };
    let residual: f64 = pairs.iter().map(|&(a, b)| (a - transform.act(b)).norm_squared()).sum();
    let variance = (least_sigma * least_sigma).max(residual / (2.0 * n - 3.0));
    let covariance = covariance(n, mean_b, spread) * variance;
    Some(RigidFit { transform, covariance, rms: (residual / n).sqrt() })
}

/// The inverse of the normal matrix of `n` points with the given mean and spread.
fn covariance(n: f64, mean: Vector2<f64>, spread: f64) -> Matrix3<f64> {
    let m = Vector2::new(-mean.y, mean.x);
    let position = Matrix2::identity() / n + m * m.transpose() / spread;
    let coupling = -m / spread;
    let mut full = Matrix3::zeros();
    full.fixed_view_mut::<2, 2>(0, 0).copy_from(&position);
    full.fixed_view_mut::<2, 1>(0, 2).copy_from(&coupling);
    full.fixed_view_mut::<1, 2>(2, 0).copy_from(&coupling.transpose());
    full.m33 = 1.0 / spread;
    full
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn points() -> impl Strategy<Value = Vec<Vector2<f64>>> {
        prop::collection::vec((-20.0..20.0, -20.0..20.0).prop_map(|(x, y)| Vector2::new(x, y)), 3..30)
    }

    proptest! {
        #[test]
        fn recovers_an_exact_motion(b in points(), x in -9.0..9.0_f64, y in -9.0..9.0_f64, theta in -4.0..4.0_f64) {
            let truth = Se2::new(x, y, theta);
            let pairs: Vec<_> = b.iter().map(|&p| (truth.act(p), p)).collect();
            let fit = rigid_fit(&pairs, 0.01).unwrap();
            prop_assert!(fit.transform.minus(&truth).norm() < 1e-9);
            prop_assert!(fit.rms < 1e-9);
        }

        #[test]
        fn covariance_inverts_the_normal_matrix(b in points()) {
            let pairs: Vec<_> = b.iter().map(|&p| (p, p)).collect();
            let jacobian = |p: &Vector2<f64>| nalgebra::Matrix2x3::new(1.0, 0.0, -p.y, 0.0, 1.0, p.x);
            let normal: Matrix3<f64> = b.iter().map(|p| jacobian(p).transpose() * jacobian(p)).sum();
            let fit = rigid_fit(&pairs, 0.1).unwrap();
            let product = normal * fit.covariance / 0.01;
            prop_assert!((product - Matrix3::identity()).norm() < 1e-6, "{product}");
        }
    }

    #[test]
    fn refuses_what_has_no_answer() {
        let p = Vector2::new(1.0, 2.0);
        assert_eq!(rigid_fit(&[], 0.1), None);
        assert_eq!(rigid_fit(&[(p, p)], 0.1), None);
        assert_eq!(rigid_fit(&[(p, p), (2.0 * p, p)], 0.1), None);
        assert_eq!(rigid_fit(&[(p, p), (p * f64::NAN, 2.0 * p)], 0.1), None);
    }

    /// NEES of the fit over many noisy draws: its mean must be 3.
    #[test]
    fn covariance_covers() {
        let b: Vec<_> = (0..12).map(|i| Vector2::new(f64::from(i * i % 7), f64::from(i % 5) + 4.0)).collect();
        let (truth, sigma) = (Se2::new(1.0, -2.0, 0.7), 0.05);
        let mut noise = groma_estimation::random::SplitMix64::new(7);
        let nees = (0..4000).map(|_| {
            let pairs: Vec<_> =
                b.iter().map(|&p| (truth.act(p) + Vector2::new(noise.normal(), noise.normal()) * sigma, p)).collect();
            // The noise is known, and not below the draw's own scatter: take out the maximum by a large floor.
            let fit = rigid_fit(&pairs, 1.0).unwrap();
            let error: Vector3<f64> = fit.transform.minus(&truth);
            error.dot(&((fit.covariance * sigma * sigma).try_inverse().unwrap() * error))
        });
        let mean = nees.sum::<f64>() / 4000.0;
        assert!((mean - 3.0).abs() < 0.2, "{mean}");
    }
}

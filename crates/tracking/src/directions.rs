//! What a registration holds of a pose: its weakest direction, and the information that is more than noise.

use nalgebra::{Matrix3, Vector3};

/// Information on a direction of the position below this share of that on the other is but a trace of noise.
const TRACE: f64 = 0.01;

/// The information without what it seems to know of a direction of the position that it hardly knows.
pub(crate) fn without_traces(information: &Matrix3<f64>) -> Matrix3<f64> {
    let position = information.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigen();
    let weak = usize::from(position.eigenvalues[0] > position.eigenvalues[1]);
    if position.eigenvalues[weak] > TRACE * position.eigenvalues[1 - weak] {
        return *information;
    }
    let along = position.eigenvectors.column(weak);
    let keep =
        Matrix3::identity() - Vector3::new(along[0], along[1], 0.0) * Vector3::new(along[0], along[1], 0.0).transpose();
    keep * information * keep
}

/// Standard deviation along the weakest direction of the position [m] and that direction [rad].
pub(crate) fn weakest(information: &Matrix3<f64>) -> (f64, f64) {
    let covariance = (information + Matrix3::identity() * 1e-2).try_inverse().unwrap_or_else(Matrix3::zeros);
    let (a, b, c) = (covariance[(0, 0)], covariance[(0, 1)], covariance[(1, 1)]);
    let largest = 0.5 * (a + c) + (0.5 * (a - c)).hypot(b);
    (largest.max(0.0).sqrt(), 0.5 * (2.0 * b).atan2(a - c))
}

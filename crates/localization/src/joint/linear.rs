//! What sightings, as linear functions of the joint state, say of it: innovations and their covariances.
//!
//! ```text
//! v = residual - H shift,   S = H P H^T + R,   H_a P H_b^T between two sightings
//! ```
//!
//! A sighting sees the pose, the mount where the calibration is considered, and one landmark: three blocks of H.

use super::{DRIVE, Joint};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

/// A sighting as a linear function of the state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linear {
    /// Measured less predicted.
    pub residual: Vector2<f64>,
    pub by_pose: Matrix2x3<f64>,
    pub by_mount: Matrix2x3<f64>,
    /// Slot of the landmark and the Jacobian by its position.
    pub landmark: Option<(usize, Matrix2<f64>)>,
    /// Of the sighting, and of the landmark where that has no slot.
    pub noise: Matrix2<f64>,
}

impl Joint {
    /// The blocks of a sighting's Jacobian: first row of the state, and the rows of H there.
    pub(super) fn blocks(&self, m: &Linear) -> ([(usize, Matrix2x3<f64>); 2], usize) {
        let count = if self.calibration > 0 { 2 } else { 1 };
        ([(0, m.by_pose), (3 + DRIVE, m.by_mount)], count)
    }

    /// `H P` between two sets of columns: the covariance of what two sightings predict.
    pub(crate) fn cross(&self, a: &Linear, b: &Linear) -> Matrix2<f64> {
        let mut sum = Matrix2::zeros();
        let ((of_a, n_a), (of_b, n_b)) = (self.blocks(a), self.blocks(b));
        let to = |row: usize, column: usize| Matrix3::from_fn(|i, j| self.covariance.at(row + i, column + j));
        let half =
            |row: usize, column: usize| SMatrix::<f64, 3, 2>::from_fn(|i, j| self.covariance.at(row + i, column + j));
        for (row, h_a) in &of_a[..n_a] {
            for (column, h_b) in &of_b[..n_b] {
                sum += h_a * to(*row, *column) * h_b.transpose();
            }
            if let Some((slot, h_b)) = &b.landmark {
                sum += h_a * half(*row, self.row_of(*slot)) * h_b.transpose();
            }
        }
        let Some((slot, h_a)) = &a.landmark else { return sum };
        let row = self.row_of(*slot);
        for (column, h_b) in &of_b[..n_b] {
            sum += h_a * half(*column, row).transpose() * h_b.transpose();
        }
        if let Some((other, h_b)) = &b.landmark {
            let column = self.row_of(*other);
            sum += h_a * Matrix2::from_fn(|i, j| self.covariance.at(row + i, column + j)) * h_b.transpose();
        }
        sum
    }

    /// Covariance of a sighting's innovation.
    pub(crate) fn innovation_covariance(&self, m: &Linear) -> Matrix2<f64> {
        let s = self.cross(m, m) + m.noise;
        0.5 * (s + s.transpose())
    }

    /// The innovation that is left after what this scan has taught so far.
    pub(crate) fn innovation(&self, m: &Linear) -> Vector2<f64> {
        let at = |k: usize| Vector3::new(self.shift[k], self.shift[k + 1], self.shift[k + 2]);
        let (blocks, count) = self.blocks(m);
        let mut v = m.residual;
        for (row, h) in &blocks[..count] {
            v -= h * at(*row);
        }
        if let Some((slot, h)) = &m.landmark {
            let row = self.row_of(*slot);
            v -= h * Vector2::new(self.shift[row], self.shift[row + 1]);
        }
        v
    }

    /// Squared Mahalanobis distance of a sighting's innovation, with its covariance's inverse; none where that is not
    /// positive definite.
    pub(crate) fn distance_sq(&self, m: &Linear) -> Option<f64> {
        let v = self.innovation(m);
        let inverse = inverse(&self.innovation_covariance(m))?;
        Some(v.dot(&(inverse * v)))
    }
}

/// The inverse of a symmetric matrix, if it is positive definite.
pub(crate) fn inverse(s: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let det = s.m11 * s.m22 - s.m12 * s.m12;
    (s.m11 > 0.0 && det > 0.0 && det.is_finite()).then(|| Matrix2::new(s.m22, -s.m12, -s.m12, s.m11) / det)
}

//! What sightings, as linear functions of the joint state, say of it: innovations and their covariances.
//!
//! ```text
//! v = residual - H shift,   S = H P H^T + R,   H_a P H_b^T between two sightings
//! ```
//!
//! A sighting sees the pose, the mount where the calibration is considered, and one landmark: three blocks of H.

use super::{DRIVE, Joint};
use nalgebra::{Matrix2, Matrix2x3, SMatrix, Vector2};

/// Rows of the state that a sighting sees, at most: pose, mount, landmark.
pub(super) const MOST_SEEN: usize = 8;

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

/// The rows of the state that a sighting sees, each with its column of H; the first three are those of the pose.
pub(super) struct Seen {
    rows: [(usize, f64, f64); MOST_SEEN],
    count: usize,
}

impl Seen {
    /// Row of the state, and what range and bearing change with it.
    pub fn rows(&self) -> &[(usize, f64, f64)] {
        &self.rows[..self.count]
    }

    fn push<const N: usize>(&mut self, first: usize, h: &SMatrix<f64, 2, N>) {
        for k in 0..N {
            self.rows[self.count] = (first + k, h[(0, k)], h[(1, k)]);
            self.count += 1;
        }
    }
}

impl Joint {
    /// What a sighting sees.
    pub(super) fn seen(&self, m: &Linear) -> Seen {
        let mut seen = Seen { rows: [(0, 0.0, 0.0); MOST_SEEN], count: 0 };
        seen.push(0, &m.by_pose);
        if self.calibration > 0 {
            seen.push(3 + DRIVE, &m.by_mount);
        }
        if let Some((slot, h)) = &m.landmark {
            seen.push(self.row_of(*slot), h);
        }
        seen
    }

    /// `H_a P H_b^T`: the covariance of what two sightings predict.
    pub(crate) fn cross(&self, a: &Linear, b: &Linear) -> Matrix2<f64> {
        let (of_a, of_b) = (self.seen(a), self.seen(b));
        let mut sum = Matrix2::zeros();
        for &(i, range_i, bearing_i) in of_a.rows() {
            let (mut by_range, mut by_bearing) = (0.0, 0.0);
            for &(j, range_j, bearing_j) in of_b.rows() {
                let p = self.covariance.at(i, j);
                by_range += p * range_j;
                by_bearing += p * bearing_j;
            }
            sum.m11 += range_i * by_range;
            sum.m12 += range_i * by_bearing;
            sum.m21 += bearing_i * by_range;
            sum.m22 += bearing_i * by_bearing;
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
        let mut v = m.residual;
        for &(row, range, bearing) in self.seen(m).rows() {
            v.x -= range * self.shift[row];
            v.y -= bearing * self.shift[row];
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

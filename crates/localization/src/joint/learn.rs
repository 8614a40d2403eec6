//! The update of the joint Gaussian by a sighting.
//!
//! ```text
//! K = P H^T S^-1 on the rows that may move, 0 elsewhere
//! P_i. <- P_i. - K_i H P    for those rows and, mirrored, columns
//! P_xx <- (A P A^T)_xx + K R K^T,   A = I - K H    (Joseph, on what the pose is seen by)
//! ```

use super::Joint;
use super::linear::{Linear, MOST_SEEN, inverse};
use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2};
use std::ops::Range;

/// What moves in an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gain {
    /// The pose.
    Pose,
    /// A landmark.
    Landmark,
    /// The pose and the landmark that was seen.
    PoseAndLandmark,
    /// The pose and every landmark.
    All,
}

impl Joint {
    /// Learns from a sighting, if its innovation passes the gate; its squared Mahalanobis distance then.
    pub(crate) fn update(&mut self, m: &Linear, gain: Gain, gate: f64) -> Option<f64> {
        let v = self.innovation(m);
        let s_inverse = inverse(&self.project(m))?;
        let distance_sq = v.dot(&(s_inverse * v));
        if distance_sq > gate {
            return None;
        }
        let [first, second] = std::mem::take(&mut self.projected);
        let (pose, moved) = self.movable(m, gain);
        let joseph = (!pose.is_empty()).then(|| self.joseph(m, &s_inverse, &first, &second));
        for i in pose.chain(moved.clone()) {
            let k = s_inverse * Vector2::new(first[i], second[i]);
            let row = self.covariance.row_mut(i);
            row.iter_mut().zip(&first).zip(&second).for_each(|((p, a), b)| *p -= k.x * a + k.y * b);
            self.shift[i] += k.dot(&v);
        }
        // The mirror image after all rows: where both move, each row has the whole change.
        for i in moved {
            self.covariance.mirror(i);
            let row = s_inverse * Vector2::new(first[i], second[i]);
            if gain == Gain::Landmark {
                (0..3).for_each(|j| self.covariance.row_mut(j)[i] -= row.x * first[j] + row.y * second[j]);
            }
        }
        if let Some(covariance) = joseph {
            self.set_pose_covariance(&covariance);
        }
        self.projected = [first, second];
        Some(distance_sq)
    }

    /// Rows of the pose and of landmarks that move.
    fn movable(&self, m: &Linear, gain: Gain) -> (Range<usize>, Range<usize>) {
        let landmark = || m.landmark.map_or(0..0, |(slot, _)| self.row_of(slot)..self.row_of(slot) + 2);
        match gain {
            Gain::Pose => (0..3, 0..0),
            Gain::Landmark => (0..0, landmark()),
            Gain::PoseAndLandmark => (0..3, landmark()),
            Gain::All => (0..3, self.row_of(0)..self.covariance.size()),
        }
    }

    /// The pose's block of `A P A^T + K R K^T`, `A = I - K H`, over the rows that are seen; those of the pose are the first.
    fn joseph(&self, m: &Linear, s_inverse: &Matrix2<f64>, first: &[f64], second: &[f64]) -> Matrix3<f64> {
        let k = Matrix3x2::from_fn(|i, j| Vector2::new(first[i], second[i]).dot(&s_inverse.column(j)));
        let seen = self.seen(m);
        let rows = seen.rows();
        let mut a = [[0.0; MOST_SEEN]; 3];
        for (i, a) in a.iter_mut().enumerate() {
            for (a, (_, range, bearing)) in a.iter_mut().zip(rows) {
                *a = -(k[(i, 0)] * range + k[(i, 1)] * bearing);
            }
            a[i] += 1.0;
        }
        let mut sum = k * m.noise * k.transpose();
        for (s, (row, ..)) in rows.iter().enumerate() {
            let mut projected = [0.0; 3];
            for (r, (other, ..)) in rows.iter().enumerate() {
                let p = self.covariance.at(*other, *row);
                (0..3).for_each(|i| projected[i] += a[i][r] * p);
            }
            (0..3).for_each(|i| (0..3).for_each(|j| sum[(i, j)] += projected[i] * a[j][s]));
        }
        sum
    }

    /// `H P` into `projected`; the covariance of the innovation, `H P H^T + R`.
    fn project(&mut self, m: &Linear) -> Matrix2<f64> {
        let seen = self.seen(m);
        let [mut first, mut second] = std::mem::take(&mut self.projected);
        for out in [&mut first, &mut second] {
            out.clear();
            out.resize(self.covariance.size(), 0.0);
        }
        for &(row, a, b) in seen.rows() {
            for j in 0..3 {
                let p = self.covariance.at(row, j);
                first[j] += a * p;
                second[j] += b * p;
            }
            let tail = self.covariance.row(row)[3..].iter();
            for ((p, f), s) in tail.zip(&mut first[3..]).zip(&mut second[3..]) {
                *f += a * p;
                *s += b * p;
            }
        }
        let mut s = m.noise;
        for &(row, a, b) in seen.rows() {
            s += Matrix2::new(a * first[row], 0.5 * (b * first[row] + a * second[row]), 0.0, b * second[row]);
        }
        s.m21 = s.m12;
        self.projected = [first, second];
        s
    }
}

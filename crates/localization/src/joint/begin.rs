//! Landmarks that a sighting begins.
//!
//! ```text
//! m = T D L q:   P_m. = J_pose P_x. + J_mount P_l.,   P_mm = P_m. J^T + J_polar R J_polar^T
//! ```

use super::{DRIVE, Joint};
use crate::measurement::Begun;
use nalgebra::{Matrix2, Matrix2x3};

impl Joint {
    /// Adds a landmark that a sighting with covariance `noise` begins; its slot.
    pub(crate) fn begin(&mut self, begun: &Begun, noise: &Matrix2<f64>) -> usize {
        let row = self.covariance.size();
        let mut rows = [self.combine(0, &begun.by_pose, 0), self.combine(0, &begun.by_pose, 1)];
        if self.calibration > 0 {
            let mount = 3 + DRIVE;
            for (k, values) in rows.iter_mut().enumerate() {
                values.iter_mut().zip(self.combine(mount, &begun.by_mount, k)).for_each(|(v, m)| *v += m);
            }
        }
        let own = begun.by_polar * noise * begun.by_polar.transpose() + self.between(&rows, begun);
        self.covariance.grow(2);
        for (i, values) in rows.iter().enumerate() {
            values.iter().enumerate().for_each(|(j, v)| self.covariance.set(row + i, j, *v));
            (0..=i).for_each(|j| self.covariance.set(row + i, row + j, 0.5 * (own[(i, j)] + own[(j, i)])));
        }
        self.push_point(begun.position)
    }

    /// Row `k` of `J P_start..start+3`.
    fn combine(&self, start: usize, j: &Matrix2x3<f64>, k: usize) -> Vec<f64> {
        let entry = |c: usize| (0..3).map(|r| j[(k, r)] * self.covariance.at(start + r, c)).sum();
        (0..self.covariance.size()).map(entry).collect()
    }

    /// Covariance of a landmark from its rows with all that it depends on.
    fn between(&self, rows: &[Vec<f64>; 2], begun: &Begun) -> Matrix2<f64> {
        Matrix2::from_fn(|i, k| {
            let pose: f64 = (0..3).map(|c| rows[i][c] * begun.by_pose[(k, c)]).sum();
            let mount = 3 + DRIVE;
            let from_mount = |c: usize| rows[i][mount + c] * begun.by_mount[(k, c)];
            pose + if self.calibration > 0 { (0..3).map(from_mount).sum::<f64>() } else { 0.0 }
        })
    }
}

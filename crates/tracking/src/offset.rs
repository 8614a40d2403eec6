//! Where the odometry believes the vehicle, against where the scans are assumed to be taken from.
//!
//! Many recordings do not tell where the laser sits. If the frame the scans are given in differs from that of the odometry by a fixed
//! `C = (c, gamma)`, an odometry increment `(t, R)` shows in the scans as `C^-1 (t, R) C`, to first order in gamma
//!
//! ```text
//! t_scan - t = (R - I) c - gamma J t,    J = [[0, -1], [1, 0]]
//! ```
//!
//! linear in `(c_x, c_y, gamma)`: turns show the offset, straight drives the angle. Recursive least squares over the steps that
//! the scans confirm, started at zero. It serves the prediction of the next scan only; a calibration it is not.

use groma_geometry::Se2;
use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};

/// Standard deviations at the start [m], [rad].
const START: (f64, f64) = (0.5, 0.05);
/// Noise of a step beyond what the registration knows: [m], and share of the distance.
const NOISE: (f64, f64) = (0.02, 0.05);
/// Steps that turn and move less are not used [rad], [m].
const LEAST: (f64, f64) = (0.02, 0.05);
/// Steps whose residual is beyond this many standard deviations are left out.
const GATE: f64 = 4.0;

/// The offset between the frame of the odometry and that of the scans, as learned so far.
#[derive(Clone, Debug)]
pub struct Offset {
    information: Matrix3<f64>,
    weighted: Vector3<f64>,
    estimate: Vector3<f64>,
}

impl Default for Offset {
    fn default() -> Self {
        let (xy, turn) = (START.0.powi(-2), START.1.powi(-2));
        Self {
            information: Matrix3::from_diagonal(&Vector3::new(xy, xy, turn)),
            weighted: Vector3::zeros(),
            estimate: Vector3::zeros(),
        }
    }
}

impl Offset {
    /// An odometry increment as the scans will show it.
    #[must_use]
    pub fn apply(&self, increment: &Se2) -> Se2 {
        let c = self.pose();
        c.inverse() * *increment * c
    }

    /// The offset: the frame of the scans in that of the odometry.
    #[must_use]
    pub fn pose(&self) -> Se2 {
        Se2::new(self.estimate.x, self.estimate.y, self.estimate.z)
    }

    /// Its standard deviations `(x, y, angle)` [m, m, rad].
    #[must_use]
    pub fn sigmas(&self) -> Vector3<f64> {
        self.information.try_inverse().map_or_else(Vector3::zeros, |p| p.diagonal().map(|v| v.max(0.0).sqrt()))
    }

    /// Learns from a step that the scans confirmed, `sigma` metres sure.
    pub fn learn(&mut self, increment: &Se2, seen: &Se2, sigma: f64) {
        let (t, r) = (increment.translation, increment.rotation);
        if increment.theta().abs() < LEAST.0 && t.norm() < LEAST.1 {
            return;
        }
        let turned = r.matrix() - nalgebra::Matrix2::identity();
        let h = Matrix2x3::from_columns(&[turned.column(0).into(), turned.column(1).into(), Vector2::new(t.y, -t.x)]);
        let z = seen.translation - t;
        let noise = sigma + NOISE.0 + NOISE.1 * t.norm();
        let expected = h * self.estimate;
        let spread = self.information.try_inverse().map_or(0.0, |p| (h * p * h.transpose()).trace());
        if (z - expected).norm_squared() > GATE * GATE * (spread + 2.0 * noise * noise) {
            return;
        }
        self.information += h.transpose() * h / (noise * noise);
        self.weighted += h.transpose() * z / (noise * noise);
        if let Some(p) = self.information.try_inverse() {
            self.estimate = p * self.weighted;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_a_laser_that_sits_ahead() {
        let truth = Se2::new(0.4, -0.1, 0.03);
        let mut offset = Offset::default();
        for k in 0..200 {
            let step = Se2::new(0.1, 0.0, 0.15 * (f64::from(k) * 0.3).sin());
            offset.learn(&step, &(truth.inverse() * step * truth), 0.005);
        }
        let error = truth.between(&offset.pose());
        assert!(error.translation.norm() < 0.02 && error.theta().abs() < 0.01, "{:?}", offset.pose());
    }

    #[test]
    fn a_straight_drive_does_not_determine_the_offset() {
        let mut offset = Offset::default();
        for _ in 0..200 {
            offset.learn(&Se2::new(0.1, 0.0, 0.0), &Se2::new(0.1, 0.0, 0.0), 0.005);
        }
        assert!(offset.pose().translation.norm() < 1e-9 && offset.sigmas().x > 0.4);
    }
}

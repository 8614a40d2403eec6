//! What neighbouring motions share: the scan at which one ends and the next begins.
//!
//! ```text
//! error of motion k, at its end:      e_k = s_k + ...            s_k of the scan at its end
//! error of motion k + 1, at its end:  e_(k+1) = -Ad(T_(k+1)^-1) s_k + ...
//! Cov(e_k, e_(k+1)) = -C Ad(T_(k+1)^-1)^T,    C = Cov(s_k)
//! ```
//!
//! How much of its covariance a motion owes to its end is not known: half of it, and of the halves of two neighbours, both
//! seen at the shared scan, C is the lesser: the greatest covariance that exceeds neither in the directions in which both are
//! diagonal. The errors of the whole stay positive definite.

use groma_calibration::vehicle::Motion;
use groma_geometry::Se2;
use nalgebra::{Matrix3, SymmetricEigen};

/// Part of a motion's covariance that one of its ends brings: a half, less a little that keeps the whole positive.
const SHARE: f64 = 0.49;
/// Motions share a scan when one begins so soon after the other ends [s].
const SAME: f64 = 1e-6;

/// The covariance of each motion and the next, zero where they share no scan.
pub(super) fn couplings(motions: &[Motion], covariances: &[Matrix3<f64>]) -> Vec<Matrix3<f64>> {
    let coupling = |k: usize| {
        let (before, after) = (&motions[k], &motions[k + 1]);
        if !is_shared(before, after) {
            return Matrix3::zeros();
        }
        coupling(&covariances[k], &after.motion, &covariances[k + 1]).unwrap_or_else(Matrix3::zeros)
    };
    (1..motions.len()).map(|k| coupling(k - 1)).collect()
}

/// Whether a motion begins at the scan at which the one before ends.
pub(super) fn is_shared(before: &Motion, after: &Motion) -> bool {
    (after.start - before.end).abs() < SAME
}

fn coupling(before: &Matrix3<f64>, motion: &Se2, after: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let forth = motion.adjoint();
    let at_shared_scan = forth * after * forth.transpose();
    let shared = lesser(&(before * SHARE), &(at_shared_scan * SHARE))?;
    Some(-shared * motion.inverse().adjoint().transpose())
}

/// The greatest covariance that exceeds neither of two in the directions in which both are diagonal.
fn lesser(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let root = a.cholesky()?.l();
    let inverse = root.try_inverse()?;
    let eigen = SymmetricEigen::new(inverse * b * inverse.transpose());
    let directions = root * eigen.eigenvectors;
    Some(directions * Matrix3::from_diagonal(&eigen.eigenvalues.map(|v| v.min(1.0))) * directions.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{SMatrix, Vector3};

    fn motion(start: f64, end: f64, pose: Se2) -> Motion {
        Motion { start, end, motion: pose, turn: pose.theta() }
    }

    fn diagonal(x: f64, y: f64, turn: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(x * x, y * y, turn * turn))
    }

    /// Motions between scans of equal, independent errors: the covariance of neighbours is known exactly.
    #[test]
    fn motions_between_equal_scans_share_what_the_middle_one_brings() {
        let scan = Matrix3::identity() * 1e-6;
        let (a, b) = (Se2::new(0.0, 0.0, 0.8), Se2::new(0.0, 0.0, -1.1));
        let of = |m: &Se2| scan + m.inverse().adjoint() * scan * m.inverse().adjoint().transpose();
        let motions = [motion(0.0, 1.0, a), motion(1.0, 2.0, b)];
        let found = couplings(&motions, &[of(&a), of(&b)])[0];
        let exact = -scan * b.inverse().adjoint().transpose();
        assert!((found - exact).amax() < 0.03 * exact.amax(), "{found} {exact}");
        let reversed = -scan * b.adjoint().transpose();
        assert!((found - reversed).amax() > exact.amax(), "the sense of the turn matters");
    }

    /// Drawn scan errors: the sign, and the frame of the lever arm.
    #[test]
    fn a_long_motion_after_a_short_one_carries_the_shared_heading_error_to_its_end() {
        let (a, b) = (Se2::new(0.1, 0.0, 0.0), Se2::new(5.0, 2.0, 0.4));
        let heading = diagonal(1e-9, 1e-9, 1e-3);
        let of = |m: &Se2| heading + m.inverse().adjoint() * heading * m.inverse().adjoint().transpose();
        let found = couplings(&[motion(0.0, 1.0, a), motion(1.0, 2.0, b)], &[of(&a), of(&b)])[0];
        // A heading error e of the shared scan turns the second motion by -e about its start: a start at (x, y), seen from
        // the end, moves the end by -e (-(0 - y), 0 - x).
        let start = b.inverse().act(nalgebra::Vector2::zeros());
        let expected = Vector3::new(-start.y, start.x, -1.0);
        assert!(found[(2, 2)] < -0.3e-6 && found[(2, 2)] > -1.05e-6, "{found}");
        for k in 0..3 {
            assert!((found[(2, k)] / found[(2, 2)] + expected[k]).abs() < 0.05 * expected.amax(), "{found} {expected}");
        }
    }

    #[test]
    fn the_whole_stays_positive_definite() {
        let motions: Vec<Motion> =
            (0..5).map(|k| motion(f64::from(k), f64::from(k + 1), Se2::new(1.0, 0.3 * f64::from(k), 0.9))).collect();
        let covariances: Vec<_> = (0..5).map(|k| diagonal(1e-3 * 10_f64.powi(k % 3), 2e-3, 1e-3)).collect();
        let shared = couplings(&motions, &covariances);
        let mut whole = SMatrix::<f64, 15, 15>::zeros();
        for k in 0..5 {
            whole.fixed_view_mut::<3, 3>(3 * k, 3 * k).copy_from(&covariances[k]);
            if k < 4 {
                whole.fixed_view_mut::<3, 3>(3 * k, 3 * k + 3).copy_from(&shared[k]);
                whole.fixed_view_mut::<3, 3>(3 * k + 3, 3 * k).copy_from(&shared[k].transpose());
            }
        }
        assert!(whole.cholesky().is_some());
    }

    #[test]
    fn motions_apart_share_nothing() {
        let c = diagonal(1e-3, 1e-3, 1e-3);
        let pose = Se2::new(1.0, 0.0, 0.2);
        assert_eq!(couplings(&[motion(0.0, 1.0, pose), motion(1.5, 2.0, pose)], &[c, c]), [Matrix3::zeros()]);
        assert!(couplings(&[], &[]).is_empty());
    }
}

//! Poses of the vehicle that another system gave, and what is known between two of them.
//!
//! Between two poses `T_a`, `T_b` the body is taken to move with constant twist, u = (t - t_a) / (t_b - t_a):
//!
//! ```text
//! T(t)  = T_a exp(u log(T_a^-1 T_b)),    twist = log(T_a^-1 T_b) / (t_b - t_a)
//! P(t)  = (1 - u) A P_a A^T + u B P_b B^T,   A = Ad(T(t)^-1 T_a),  B = Ad(T(t)^-1 T_b)
//! ```
//!
//! To first order the error at t is `(1 - u) A e_a + u B e_b`. How `e_a` and `e_b` hang together is not known; P(t) bounds
//! the covariance of that sum for every correlation, and is exact where the two errors are the same, as those of poses a
//! fraction of a second apart nearly are. Poses more than `GAP` apart are not joined.

use crate::survey::KnownPose;
use groma_geometry::Se2;
use nalgebra::Matrix3;

/// Poses farther apart in time are not joined [s].
pub const GAP: f64 = 1.0;

/// A pose of the vehicle at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedPose {
    /// Time [s].
    pub stamp: f64,
    /// `T_map_base`.
    pub pose: Se2,
    /// Covariance of its perturbation on the right.
    pub covariance: Matrix3<f64>,
}

/// What is known at `stamp` between two poses in the order of time; none outside them or in a gap.
#[must_use]
pub fn between(a: &TimedPose, b: &TimedPose, stamp: f64) -> Option<KnownPose> {
    let time = b.stamp - a.stamp;
    if !(time > 0.0 && time <= GAP && a.stamp <= stamp && stamp <= b.stamp) {
        return None;
    }
    let u = (stamp - a.stamp) / time;
    let motion = a.pose.between(&b.pose).log();
    let pose = a.pose.plus(motion * u);
    let moved = |from: &TimedPose| {
        let adjoint = pose.between(&from.pose).adjoint();
        adjoint * from.covariance * adjoint.transpose()
    };
    Some(KnownPose { pose, covariance: moved(a) * (1.0 - u) + moved(b) * u, twist: motion / time })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector3};
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn timed(stamp: f64, pose: Se2, covariance: Matrix3<f64>) -> TimedPose {
        TimedPose { stamp, pose, covariance }
    }

    fn exact(stamp: f64, pose: Se2) -> TimedPose {
        timed(stamp, pose, Matrix3::zeros())
    }

    #[test]
    fn a_quarter_of_a_circle_to_the_left_is_halved_on_the_circle() {
        let (a, b) = (exact(10.0, Se2::IDENTITY), exact(10.5, Se2::new(2.0, 2.0, FRAC_PI_2)));
        let known = between(&a, &b, 10.25).unwrap();
        let eighth = FRAC_PI_2 / 2.0;
        assert!((known.pose.x() - 2.0 * eighth.sin()).abs() < 1e-12);
        assert!((known.pose.y() - 2.0 * (1.0 - eighth.cos())).abs() < 1e-12);
        assert!((known.pose.theta() - eighth).abs() < 1e-12);
        // Half a second for a quarter of a circle of radius 2 m.
        assert!((known.twist - Vector3::new(2.0 * PI, 0.0, PI)).norm() < 1e-12);
    }

    #[test]
    fn a_vehicle_that_faces_backwards_moves_backwards_in_its_own_frame() {
        let (a, b) = (exact(0.0, Se2::new(1.0, 1.0, PI)), exact(0.5, Se2::new(2.0, 1.0, -PI)));
        let known = between(&a, &b, 0.1).unwrap();
        assert!((known.twist - Vector3::new(-2.0, 0.0, 0.0)).norm() < 1e-9);
        assert!((known.pose.x() - 1.2).abs() < 1e-9);
    }

    #[test]
    fn ends_belong_to_the_stretch_and_nothing_beyond_or_in_a_pause_does() {
        let (a, b) = (exact(5.0, Se2::IDENTITY), exact(5.5, Se2::new(1.0, 0.0, 0.0)));
        assert_eq!(between(&a, &b, 5.0).unwrap().pose, a.pose);
        assert!((between(&a, &b, 5.5).unwrap().pose.x() - 1.0).abs() < 1e-12);
        assert!(between(&a, &b, 4.999).is_none() && between(&a, &b, 5.501).is_none());
        assert!(between(&b, &a, 5.2).is_none() && between(&a, &a, 5.0).is_none());
        assert!(between(&a, &exact(7.0, b.pose), 6.0).is_none(), "two seconds without a pose");
        assert!(between(&a, &b, f64::NAN).is_none());
    }

    #[test]
    fn a_common_error_of_the_heading_moves_with_the_lever() {
        // Both poses are turned about the origin of the map by the same angle: so is the pose between them.
        let (a, b) = (Se2::new(10.0, 0.0, 0.3), Se2::new(11.0, 0.5, 0.7));
        let about_origin = |pose: &Se2| {
            let row = pose.inverse().adjoint() * Vector3::new(0.0, 0.0, 0.01);
            row * row.transpose()
        };
        let known = between(&timed(0.0, a, about_origin(&a)), &timed(0.4, b, about_origin(&b)), 0.1).unwrap();
        assert!((known.covariance - about_origin(&known.pose)).amax() < 1e-12);
    }

    #[test]
    fn the_covariance_is_that_of_the_pose_that_is_near() {
        let sigma = |s: f64| Matrix3::identity() * s * s;
        let (a, b) = (timed(0.0, Se2::IDENTITY, sigma(0.1)), timed(0.5, Se2::IDENTITY, sigma(0.3)));
        let at = |stamp| between(&a, &b, stamp).unwrap().covariance[(0, 0)];
        assert!((at(0.0) - 0.01).abs() < 1e-12 && (at(0.5) - 0.09).abs() < 1e-12);
        assert!((at(0.125) - 0.03).abs() < 1e-12);
    }

    proptest! {
        /// P(t) is no smaller than the covariance of the interpolated error, however both ends hang together.
        #[test]
        fn the_covariance_bounds_every_correlation(
            entries in prop::collection::vec(-0.1..0.1_f64, 36), u in 0.0..1.0_f64, x in -1.0..1.0_f64, turn in -0.5..0.5_f64,
        ) {
            let root = Matrix6::from_row_slice(&entries);
            let joint = root * root.transpose();
            let (a, b) = (Se2::new(3.0, -2.0, 1.0), Se2::new(3.0 + x, -2.2, 1.0 + turn));
            let block = |i: usize, j: usize| joint.fixed_view::<3, 3>(3 * i, 3 * j).into_owned();
            let known = between(&timed(0.0, a, block(0, 0)), &timed(1.0, b, block(1, 1)), u).unwrap();
            let (to_a, to_b) = (known.pose.between(&a).adjoint() * (1.0 - u), known.pose.between(&b).adjoint() * u);
            let cross = to_a * block(0, 1) * to_b.transpose();
            let sum = to_a * block(0, 0) * to_a.transpose() + to_b * block(1, 1) * to_b.transpose() + cross + cross.transpose();
            let left = known.covariance - sum;
            prop_assert!(((left + left.transpose()) / 2.0).symmetric_eigenvalues().min() > -1e-9);
        }
    }
}

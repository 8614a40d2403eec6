//! What a camera's view of the target says of robot, mount and camera, with errors in the world frame.
//!
//! Frames: W world, R robot, B target body (the panels are rigid in it), C camera. With the errors
//!
//! ```text
//! T_W_R = Exp(xi) T^_W_R,   T_W_C = Exp(zeta) T^_W_C,   T_R_B = Exp(mu) T^_R_B,   theta = theta^ + E b
//! ```
//!
//! a view measures `Z = H Exp(S b + v)`, `H = T_W_C^-1 T_W_R T_R_B`, where S is how the pose of the target moves with the
//! calibration that it was computed with, `v ~ N(0, N)`. To first order, with `y = Log(H^^-1 Z)`:
//!
//! ```text
//! y = B (xi + Ad(T_W_R) mu - zeta) + S b + v,     B = Ad((T_W_R T_R_B)^-1)
//! zeta = xi + Ad(T_W_R) mu + B^-1 (S b + v)       for a camera that is placed by this view, T^_W_C = T_W_R T_R_B Z^-1
//! ```
//!
//! *Why the world frame.* What no measurement can tell, moving robot and all cameras together, is `xi = zeta = c`, for
//! every estimate the same: B is multiplied with `c - c = 0`. With body-frame errors that direction is another one after
//! each correction, and the filter believes to have learned something. In the notes' simulations: NEES per degree of
//! freedom 0.98..1.05 against 1.3..78.
//!
//! With b = theta_true - theta_used, `S = (J^T J)^-1 J^T J_theta E` of the pose fit. Source: derived here; compare
//! Barrau, Bonnabel, IEEE TAC 62 (2017) 1797 on invariant errors.

use groma_geometry::{LieGroup, Se3};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// The target's pose in a camera, as one stop of the robot shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// `Z = T_C_B`.
    pub pose: Se3,
    /// Covariance N of v, the error of Z on the right: what differs from view to view.
    pub covariance: Matrix6<f64>,
    /// S, 6 x m: what is the same in all views of this camera.
    pub sensitivity: DMatrix<f64>,
    /// The calibration states (m) with which Z was computed.
    pub calibration: DVector<f64>,
}

/// How the innovation depends on the robot's and on the mount's error: `(B, B Ad(T_W_R))`; on the camera's it is `-B`.
#[must_use]
pub fn jacobians(robot: &Se3, mount: &Se3) -> (Matrix6<f64>, Matrix6<f64>) {
    let b = (*robot * *mount).inverse().adjoint();
    (b, b * robot.adjoint())
}

/// `y = Log(Exp(-S (b - b_used)) H^-1 Z)`, zero when the view is as foretold.
#[must_use]
pub fn innovation(robot: &Se3, mount: &Se3, camera: &Se3, calibration: &DVector<f64>, view: &View) -> Vector6<f64> {
    let foretold = camera.between(&(*robot * *mount)) * shift(calibration, view);
    view.pose.minus(&foretold)
}

/// The pose of a camera that sees the target as in `view`.
#[must_use]
pub fn placed(robot: &Se3, mount: &Se3, calibration: &DVector<f64>, view: &View) -> Se3 {
    *robot * *mount * shift(calibration, view) * view.pose.inverse()
}

/// `Exp(S (b - b_used))`: how far the view's pose lies off for being computed with another calibration.
fn shift(calibration: &DVector<f64>, view: &View) -> Se3 {
    let moved = &view.sensitivity * (calibration - &view.calibration);
    Se3::exp(&Vector6::from_iterator(moved.iter().copied()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix6xX;

    const STEP: f64 = 1e-5;

    fn pose(k: f64) -> Se3 {
        Se3::exp(&Vector6::new(3.0 * k, -2.0 + k, 0.5, 0.3 * k, -0.2, 0.9 - 0.5 * k))
    }

    /// Central differences of the innovation along each direction of one argument.
    fn differences(y: impl Fn(&Vector6<f64>) -> Vector6<f64>) -> Matrix6<f64> {
        let column = |k: usize| {
            let d = Vector6::from_fn(|i, _| if i == k { STEP } else { 0.0 });
            (y(&d) - y(&-d)) / (2.0 * STEP)
        };
        Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(column))
    }

    #[test]
    fn jacobians_equal_differences() {
        let (robot, mount, camera) = (pose(1.0), pose(0.3), pose(-0.7));
        let sensitivity = Matrix6xX::from_fn(2, |i, j| 0.1 * (i as f64 - 2.0) + j as f64);
        let none = DVector::zeros(2);
        let view = View {
            pose: camera.between(&(robot * mount)),
            covariance: Matrix6::identity(),
            sensitivity: DMatrix::from_iterator(6, 2, sensitivity.iter().copied()),
            calibration: none.clone(),
        };
        // The innovation of a true state that differs from the estimate by d is minus that of an estimate that does.
        let (b, b_mount) = jacobians(&robot, &mount);
        let by_robot = differences(|d| -innovation(&(Se3::exp(d) * robot), &mount, &camera, &none, &view));
        let by_mount = differences(|d| -innovation(&robot, &(Se3::exp(d) * mount), &camera, &none, &view));
        let by_camera = differences(|d| -innovation(&robot, &mount, &(Se3::exp(d) * camera), &none, &view));
        for (analytic, numeric) in [(b, by_robot), (b_mount, by_mount), (-b, by_camera)] {
            assert!((analytic - numeric).amax() < 1e-7, "{:e}", (analytic - numeric).amax());
        }
        let b_at = |k: usize, h: f64| DVector::from_fn(2, |i, _| if i == k { h } else { 0.0 });
        for k in 0..2 {
            let y = |h| -innovation(&robot, &mount, &camera, &b_at(k, h), &view);
            let numeric = (y(STEP) - y(-STEP)) / (2.0 * STEP);
            assert!((numeric - sensitivity.column(k)).amax() < 1e-7);
        }
    }

    #[test]
    fn a_placed_camera_sees_what_it_was_placed_by() {
        let (robot, mount) = (pose(1.0), pose(0.3));
        let view = View {
            pose: pose(2.0),
            covariance: Matrix6::identity(),
            sensitivity: DMatrix::from_element(6, 1, 0.2),
            calibration: DVector::from_element(1, 0.1),
        };
        let calibration = DVector::from_element(1, -0.3);
        let camera = placed(&robot, &mount, &calibration, &view);
        assert!(innovation(&robot, &mount, &camera, &calibration, &view).amax() < 1e-12);
    }
}

//! The motion of the laser that wheels predict, with its derivatives.
//!
//! With the base moving by `T_o = prod T_j` over the steps of a motion and the laser at M on it:
//!
//! ```text
//! T = M^-1 T_o M
//! T_o exp(d):     d = sum Ad(T_(j+1..n)^-1) d_j      d_j by input and parameters of step j
//! T exp(e):       e = Ad(M^-1) d + (1 - Ad(T^-1)) m   for M exp(m)
//! ```
//!
//! What wheels do beside is in [`super::wheel_process`]. Source: the adjoint, as in `groma-geometry`.

use super::parameters::{DELAY, FULL, LASER, Vehicle};
use groma_geometry::Se2;
use groma_models::wheel_log::Step;
use groma_models::{Drive, Increment, increment};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Derivatives of a motion by all parameters of a vehicle.
pub type Matrix3x9 = SMatrix<f64, 3, FULL>;

/// A predicted motion of the laser.
#[derive(Clone, Copy, Debug)]
pub struct Prediction {
    /// `T_first_second`.
    pub motion: Se2,
    /// Derivative of the perturbation `T exp(e)` by all parameters.
    pub jacobian: Matrix3x9,
}

const DRIVE: usize = increment::PARAMETERS;

/// The motion of the base over some steps.
#[must_use]
pub fn base_motion(drive: &Drive, steps: &[Step]) -> Se2 {
    steps.iter().fold(Se2::IDENTITY, |pose, step| pose * drive.motion(step.input))
}

/// The motion of the laser over some steps.
#[must_use]
pub fn motion(vehicle: &Vehicle, steps: &[Step]) -> Se2 {
    vehicle.laser.inverse() * base_motion(&vehicle.drive, steps) * vehicle.laser
}

/// The motion of the laser with derivatives.
#[must_use]
pub fn predict(vehicle: &Vehicle, steps: &[Step]) -> Prediction {
    let (mut base, mut by_drive) = (Se2::IDENTITY, SMatrix::<f64, 3, { DRIVE + 1 }>::zeros());
    for (j, step) in steps.iter().enumerate() {
        let Increment { motion, by_input, by_parameter } = vehicle.drive.increment(step.input);
        if j == 0 {
            base = motion;
        } else {
            by_drive = motion.inverse().adjoint() * by_drive;
            base = base * motion;
        }
        let mut own = by_drive.fixed_columns_mut::<DRIVE>(0);
        own += by_parameter;
        let mut shift = by_drive.column_mut(DRIVE);
        shift += by_input * step.rate;
    }
    let to_laser = vehicle.laser.inverse();
    let (motion, by_drive) = (to_laser * base * vehicle.laser, to_laser.adjoint() * by_drive);
    let mut jacobian = Matrix3x9::zeros();
    jacobian.fixed_columns_mut::<DRIVE>(0).copy_from(&by_drive.fixed_columns::<DRIVE>(0));
    jacobian.fixed_columns_mut::<3>(LASER).copy_from(&by_laser(&vehicle.laser, &motion));
    jacobian.set_column(DELAY, &by_drive.column(DRIVE));
    Prediction { motion, jacobian }
}

/// Derivative of `M^-1 T_o M` by x, y and yaw of M.
fn by_laser(laser: &Se2, motion: &Se2) -> Matrix3<f64> {
    let (c, s) = (laser.rotation.cos, laser.rotation.sin);
    let in_own_frame = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
    in_own_frame - motion.inverse().adjoint() * in_own_frame
}

/// What a measured motion has beyond a predicted one, in the frame at its end: `(R^T (t_m - t), theta_m - theta)`.
#[must_use]
pub fn residual(measured: &Se2, predicted: &Se2) -> Vector3<f64> {
    let over = predicted.between(measured);
    over.to_vector()
}

/// Minus the derivative of the residual by the parameters, exactly.
#[must_use]
pub fn design(prediction: &Prediction, residual: &Vector3<f64>) -> Matrix3x9 {
    let mut design = prediction.jacobian;
    let turn = prediction.jacobian.row(2);
    let (x, y) = (design.row(0) - turn * residual.y, design.row(1) + turn * residual.x);
    design.set_row(0, &x);
    design.set_row(1, &y);
    design
}

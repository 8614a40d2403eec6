//! The normal equations of one view: whitened reprojection residuals, in the pose and in the camera's parameters.
//!
//! `r_i = (pi(theta, T P_i) - u_i) / sigma_i`; with `J_theta`, `J_T` its derivatives, a [`Block`] holds `J_T^T J_T`,
//! `J_theta^T J_T`, `J_theta^T J_theta`, the gradients and `|r|^2`. Perturbations of the pose are `T exp(d)`.

use super::view::Sighting;
use groma_geometry::{LieGroup, Se3};
use groma_models::Camera;
use nalgebra::{Matrix3x6, Matrix6, SMatrix, SVector, Vector3, Vector6};

/// Room for the parameters of any camera.
pub(super) const MAX: usize = groma_models::camera::MAX_PARAMETERS;

/// Sums over the corners of a view.
#[derive(Clone, Debug)]
pub(super) struct Block {
    pub pose: Matrix6<f64>,
    pub cross: SMatrix<f64, MAX, 6>,
    pub camera: SMatrix<f64, MAX, MAX>,
    pub pose_gradient: Vector6<f64>,
    pub camera_gradient: SVector<f64, MAX>,
    pub error: f64,
}

/// The block of a view; nothing when a corner is not seen from there.
pub(super) fn block(camera: &Camera, pose: &Se3, corners: &[Sighting]) -> Option<Block> {
    let mut sums = Block {
        pose: Matrix6::zeros(),
        cross: SMatrix::zeros(),
        camera: SMatrix::zeros(),
        pose_gradient: Vector6::zeros(),
        camera_gradient: SVector::zeros(),
        error: 0.0,
    };
    let rotation = pose.rotation.matrix();
    for corner in corners {
        let seen = camera.project_with_jacobians(&pose.act(&corner.point))?;
        let (residual, weight) = (seen.pixel - corner.pixel, corner.weight());
        let by_pose = seen.by_point * point_by_pose(&rotation, &corner.point);
        let (weighted_pose, weighted_camera) = (by_pose.transpose() * weight, seen.by_parameters.transpose() * weight);
        sums.pose += weighted_pose * by_pose;
        sums.cross += weighted_camera * by_pose;
        sums.camera += weighted_camera * seen.by_parameters;
        sums.pose_gradient += weighted_pose * residual;
        sums.camera_gradient += weighted_camera * residual;
        sums.error += weight * residual.norm_squared();
    }
    sums.error.is_finite().then_some(sums)
}

/// `dp/dd = R [I, -[P]_x]`.
fn point_by_pose(rotation: &nalgebra::Matrix3<f64>, point: &Vector3<f64>) -> Matrix3x6<f64> {
    let mut by = Matrix3x6::zeros();
    by.fixed_view_mut::<3, 3>(0, 0).copy_from(rotation);
    by.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-rotation * point.cross_matrix()));
    by
}

/// `|r|^2` of a view; nothing when a corner is not seen from there.
pub(super) fn squared_error(camera: &Camera, pose: &Se3, corners: &[Sighting]) -> Option<f64> {
    let mut error = 0.0;
    for corner in corners {
        let pixel = camera.project(&pose.act(&corner.point))?;
        error += corner.weight() * (pixel - corner.pixel).norm_squared();
    }
    error.is_finite().then_some(error)
}

//! What views tell of the intrinsics, and what that means in pixels.
//!
//! With residuals of a view in standard deviations, `J = [J_theta | J_pose]`, each view adds
//!
//! ```text
//! A += Jt' Jt - Jt' Jp (Jp' Jp)^-1 Jp' Jt,        Cov(theta) = A^-1
//! ```
//!
//! (the pose of every panel is unknown). The unit to judge by is the pixel, the projection map of the calibration. Source: camera calibration as by Zhang, PAMI 2000; mrcal, "projection
//! uncertainty". Before any view a wide prior holds what nominal intrinsics hold: focal length to 10 %, centre to 5 % of
//! the image, distortion to 0.5.

use super::stage::{PanelView, Stage};
use groma_calibration::camera::ProjectionMap;
use groma_geometry::LieGroup;
use groma_models::Camera;
use nalgebra::{DMatrix, DVector, OMatrix, U2, U6};

/// Information on the intrinsics.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    information: DMatrix<f64>,
    map: ProjectionMap,
    views: usize,
}

impl Knowledge {
    /// Before the first view.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        let n = camera.count();
        let wide = |k: usize| match k {
            0 | 1 => 0.1 * camera.parameters()[k],
            2 => 0.05 * f64::from(camera.width()),
            3 => 0.05 * f64::from(camera.height()),
            _ => 0.5,
        };
        let information = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| wide(k).powi(-2)));
        Self { information, map: ProjectionMap::new(camera), views: 0 }
    }

    /// With the views at one pose of the robot.
    pub fn look(&mut self, stage: &Stage, views: &[PanelView]) {
        for view in views {
            if let Some(added) = told(stage, view) {
                self.information += added;
                self.views += 1;
            }
        }
    }

    /// What the views of another told, added.
    #[must_use]
    pub fn with(&self, added: &DMatrix<f64>) -> Self {
        Self { information: &self.information + added, ..self.clone() }
    }

    /// Panels seen so far.
    #[must_use]
    pub fn views(&self) -> usize {
        self.views
    }

    /// Covariance of the intrinsics.
    #[must_use]
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        self.information.clone().cholesky().map(|factor| factor.inverse())
    }

    /// Largest standard deviation of a pixel over the image [pixel].
    #[must_use]
    pub fn worst(&self) -> f64 {
        let Some(covariance) = self.covariance() else { return f64::INFINITY };
        self.map.sigmas(&covariance).into_iter().fold(0.0, f64::max)
    }
}

/// Information of one panel in one image, its pose eliminated; None where the pose itself is not held.
pub(super) fn told(stage: &Stage, view: &PanelView) -> Option<DMatrix<f64>> {
    let n = stage.camera.count();
    let (mut tt, mut tp) = (DMatrix::zeros(n, n), DMatrix::zeros(n, 6));
    let mut pp = OMatrix::<f64, U6, U6>::zeros();
    let rotation = view.pose.rotation.matrix();
    for corner in &view.corners {
        let seen = stage.camera.project_with_jacobians(&view.pose.act(corner))?;
        let by_theta = seen.by_parameters.columns(0, n) / stage.sigma;
        let mut by_pose = OMatrix::<f64, U2, U6>::zeros();
        let moved = seen.by_point * rotation / stage.sigma;
        by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&moved);
        by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&(-moved * corner.cross_matrix()));
        tt += by_theta.transpose() * &by_theta;
        tp += by_theta.transpose() * by_pose;
        pp += by_pose.transpose() * by_pose;
    }
    Some(tt - &tp * pp.try_inverse()? * tp.transpose())
}

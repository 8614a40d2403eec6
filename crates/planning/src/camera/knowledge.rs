//! Information of the views about the intrinsics, and what that means in pixels.
//!
//! With residuals of a view in standard deviations, `J = [J_theta | J_pose]`, each view adds
//!
//! ```text
//! A += Jt' Jt - Jt' Jp (Jp' Jp)^-1 Jp' Jt,        Cov(theta) = A^-1
//! ```
//!
//! (the pose of every panel is unknown). The unit to judge by is the pixel, the projection map of the calibration.
//! Source: camera calibration as by Zhang, PAMI 2000; mrcal, "projection uncertainty". What is known before any view is
//! the covariance of a calibration, or a wide prior that holds what nominal intrinsics hold: focal length to 10 %, centre
//! to 5 % of the image, distortion to 0.5.

use super::stage::{PanelView, Stage};
use crate::error::Error;
use groma_calibration::camera::{ProjectionMap, Sighting, panel_pose};
use groma_geometry::{LieGroup, Se3};
use groma_models::Camera;
use groma_models::camera::MAX_PARAMETERS;
use nalgebra::{DMatrix, DVector, OMatrix, SMatrix, U2, U6, Vector3};

/// Information on the intrinsics; rows beyond those of the lens are zero.
pub(super) type Told = SMatrix<f64, MAX_PARAMETERS, MAX_PARAMETERS>;

/// Variance of a parameter that is called exact, far below what any view tells.
const EXACT_SQ: f64 = 1e-12;

/// Information on the intrinsics.
#[derive(Clone, Debug, PartialEq)]
pub struct Knowledge {
    prior: DMatrix<f64>,
    told: Told,
    map: ProjectionMap,
    views: usize,
}

impl Knowledge {
    /// Of a camera whose intrinsics are nominal.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        let n = camera.count();
        let wide = |k: usize| match k {
            0 | 1 => 0.1 * camera.parameters()[k],
            2 => 0.05 * f64::from(camera.width()),
            3 => 0.05 * f64::from(camera.height()),
            _ => 0.5,
        };
        let prior = DMatrix::from_diagonal(&DVector::from_fn(n, |k, _| wide(k).powi(-2)));
        Self { prior, told: Told::zeros(), map: ProjectionMap::new(camera), views: 0 }
    }

    /// Of a calibrated camera, with the covariance of its parameters (n, n); a parameter without variance is exact.
    ///
    /// # Errors
    /// When that is no covariance of this camera.
    pub fn calibrated(camera: &Camera, covariance: &DMatrix<f64>) -> Result<Self, Error> {
        let n = camera.count();
        let fits = covariance.shape() == (n, n) && covariance.iter().all(|c| c.is_finite());
        let factor = fits.then(|| (covariance + DMatrix::identity(n, n) * EXACT_SQ).cholesky()).flatten();
        let wrong = || Error::Graph(format!("the covariance of the camera must be {n} by {n} and positive definite"));
        Ok(Self { prior: factor.ok_or_else(wrong)?.inverse(), ..Self::new(camera) })
    }

    /// With the views at one pose of the robot.
    pub fn look(&mut self, stage: &Stage, views: &[PanelView]) {
        for view in views {
            let corners = view.corners.iter().map(|&corner| (corner, stage.sigma));
            self.add(told(&stage.camera, &view.pose, corners));
        }
    }

    /// With a panel that was really seen; one whose pose it does not tell is left out.
    pub fn sighted(&mut self, camera: &Camera, corners: &[Sighting]) {
        if let Some(found) = panel_pose(camera, corners) {
            let seen = corners.iter().map(|c| (c.point, c.weight().sqrt().recip()));
            self.add(told(camera, &found.pose, seen));
        }
    }

    fn add(&mut self, told: Option<Told>) {
        if let Some(told) = told {
            self.told += told;
            self.views += 1;
        }
    }

    /// What the views of another told, added.
    pub(super) fn with(&self, added: &Told) -> Self {
        Self { told: self.told + added, ..self.clone() }
    }

    /// Panels seen so far.
    #[must_use]
    pub fn views(&self) -> usize {
        self.views
    }

    /// Covariance of the intrinsics.
    #[must_use]
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        (&self.prior + self.of_views()).cholesky().map(|factor| factor.inverse())
    }

    /// Covariance of the intrinsics from the views alone, nothing known before; None when these do not determine a direction.
    #[must_use]
    pub fn covariance_of_views(&self) -> Option<DMatrix<f64>> {
        self.of_views().cholesky().map(|factor| factor.inverse())
    }

    fn of_views(&self) -> DMatrix<f64> {
        let n = self.prior.nrows();
        self.told.view((0, 0), (n, n)).into_owned()
    }

    /// Largest standard deviation of a pixel over the image [pixel].
    #[must_use]
    pub fn worst(&self) -> f64 {
        self.covariance().map_or(f64::INFINITY, |covariance| worst_pixel(&self.map, &covariance))
    }

    /// The same from the views alone, nothing known before; None when these do not determine a direction.
    #[must_use]
    pub fn worst_of_views(&self) -> Option<f64> {
        self.covariance_of_views().map(|covariance| worst_pixel(&self.map, &covariance))
    }
}

/// The largest standard deviation of a pixel for a covariance of the parameters [pixel].
pub(super) fn worst_pixel(map: &ProjectionMap, covariance: &DMatrix<f64>) -> f64 {
    map.sigmas(covariance).into_iter().fold(0.0, f64::max)
}

/// Information of one panel in one image, its pose eliminated; None where the pose itself is not determined.
pub(super) fn told(camera: &Camera, pose: &Se3, corners: impl Iterator<Item = (Vector3<f64>, f64)>) -> Option<Told> {
    let (mut tt, mut tp) = (Told::zeros(), SMatrix::<f64, MAX_PARAMETERS, 6>::zeros());
    let mut pp = OMatrix::<f64, U6, U6>::zeros();
    let rotation = pose.rotation.matrix();
    for (corner, sigma) in corners {
        let seen = camera.project_with_jacobians(&pose.act(&corner))?;
        let by_theta = seen.by_parameters / sigma;
        let mut by_pose = OMatrix::<f64, U2, U6>::zeros();
        let moved = seen.by_point * rotation / sigma;
        by_pose.fixed_view_mut::<2, 3>(0, 0).copy_from(&moved);
        by_pose.fixed_view_mut::<2, 3>(0, 3).copy_from(&(-moved * corner.cross_matrix()));
        tt += by_theta.transpose() * by_theta;
        tp += by_theta.transpose() * by_pose;
        pp += by_pose.transpose() * by_pose;
    }
    Some(tt - tp * pp.try_inverse()? * tp.transpose())
}

#[cfg(test)]
mod tests {
    use super::super::Motion;
    use super::super::stage::{FAN, SIGMA, mount, nominal_camera, upright_panels};
    use super::*;

    fn stage() -> Stage {
        let target = upright_panels(&FAN);
        Stage::new(nominal_camera().unwrap(), mount(2.0, 0.43).unwrap(), target, SIGMA).unwrap()
    }

    #[test]
    fn what_a_calibration_knows_is_where_the_next_drive_goes_on() {
        let (stage, drive) = (stage(), Motion::Star.drive(2.6, 27));
        let once = drive.knowledge(&stage);
        let mut twice = Knowledge::calibrated(&stage.camera, &once.covariance().unwrap()).unwrap();
        assert!((twice.worst() - once.worst()).abs() < 1e-6 * once.worst());
        drive.stops.iter().for_each(|stop| twice.look(&stage, &stage.views(stop)));
        assert!((twice.worst() * 2_f64.sqrt() / once.worst() - 1.0).abs() < 0.01, "all seen twice");
    }

    #[test]
    fn corners_that_were_seen_tell_what_was_foreseen() {
        let (stage, stop) = (stage(), Motion::Star.drive(2.6, 27).stops[4]);
        let (mut foreseen, mut seen) = (Knowledge::new(&stage.camera), Knowledge::new(&stage.camera));
        foreseen.look(&stage, &stage.views(&stop));
        for view in stage.views(&stop) {
            // The calibration adds 0.1 pixel to every corner for print and lens.
            let sigma = (stage.sigma * stage.sigma - 0.01).sqrt();
            let one = |p: &Vector3<f64>| {
                let pixel = stage.camera.project(&view.pose.act(p)).unwrap();
                Sighting { point: *p, pixel, sigma }
            };
            seen.sighted(&stage.camera, &view.corners.iter().map(one).collect::<Vec<_>>());
        }
        assert_eq!(foreseen.views(), seen.views());
        assert!((foreseen.worst() - seen.worst()).abs() < 1e-6 * seen.worst());
    }

    #[test]
    fn a_matrix_that_is_no_covariance_is_refused() {
        let camera = nominal_camera().unwrap();
        assert!(Knowledge::calibrated(&camera, &-DMatrix::identity(8, 8)).is_err());
        assert!(Knowledge::calibrated(&camera, &DMatrix::identity(5, 5)).is_err());
    }
}

//! What a calibration amounts to in single numbers: residuals by view, tilt of the panels, the weakest combination.
//!
//! ```text
//! rms             root of the mean squared length of residuals [pixel]
//! tilt spread     largest angle between the normals of two views that took part
//! tilt            angle between the normal of a panel and the line of sight to its origin
//! depth sigma     of that origin along the optical axis: root of (R C R^T)_zz, C of `T exp(xi)`
//! weak direction  eigenvector of the largest eigenvalue of the correlation matrix: each parameter in units of its own
//!                 standard deviation; its share is that eigenvalue over the sum of all
//! ```

use super::{CameraCalibration, ViewResult};
use nalgebra::DMatrix;

/// Parameters with less than this share of the largest entry of a weak direction are not named.
const NAMED: f64 = 0.4;

impl ViewResult {
    /// Root mean square length of the residuals of the corners used [pixel]; none without any.
    #[must_use]
    pub fn rms(&self) -> Option<f64> {
        rms(self.used_squares())
    }

    /// Distance of the panel's origin [m], its tilt [rad], and the standard deviation of its depth [m].
    #[must_use]
    pub fn place(&self) -> [f64; 3] {
        let (at, rotation) = (self.pose.translation, self.pose.rotation.matrix());
        let facing = (rotation.column(2).dot(&at) / at.norm()).abs().min(1.0);
        let spread = rotation * self.covariance.fixed_view::<3, 3>(0, 0) * rotation.transpose();
        [at.norm(), facing.acos(), spread.m33.max(0.0).sqrt()]
    }

    fn used_squares(&self) -> impl Iterator<Item = f64> + '_ {
        let used = self.residuals.iter().zip(&self.used).filter(|(_, used)| **used);
        used.map(|([u, v], _)| u * u + v * v)
    }
}

impl CameraCalibration {
    /// Root mean square residual of the views that took no part [pixel]; none without any.
    #[must_use]
    pub fn held_out_rms(&self) -> Option<f64> {
        rms(self.views.iter().flatten().filter(|view| !view.taken).flat_map(ViewResult::used_squares))
    }

    /// The largest angle between the panels of two views that took part [rad].
    #[must_use]
    pub fn tilt_spread(&self) -> f64 {
        let taken = self.views.iter().flatten().filter(|view| view.taken);
        let normals: Vec<_> = taken.map(|view| view.pose.rotation.matrix().column(2).into_owned()).collect();
        let turned = |(k, a): (usize, &nalgebra::Vector3<f64>)| {
            normals[k + 1..].iter().map(|b| a.cross(b).norm().atan2(a.dot(b))).fold(0.0, f64::max)
        };
        normals.iter().enumerate().map(turned).fold(0.0, f64::max)
    }

    /// The most strongly correlated parameters, and the share of that combination of their common scatter.
    #[must_use]
    pub fn weak_direction(&self) -> (Vec<usize>, f64) {
        weak_direction(&self.covariance)
    }
}

fn rms(squares: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = squares.fold((0.0, 0), |(sum, count), sq| (sum + sq, count + 1));
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}

fn weak_direction(covariance: &DMatrix<f64>) -> (Vec<usize>, f64) {
    let n = covariance.nrows();
    if n == 0 {
        return (vec![], 0.0);
    }
    let sigma = |k: usize| covariance[(k, k)].sqrt();
    let eigen = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (sigma(i) * sigma(j))).symmetric_eigen();
    let last = eigen.eigenvalues.imax();
    let worst = eigen.eigenvectors.column(last);
    let named = (0..n).filter(|k| worst[*k].abs() > NAMED * worst.amax()).collect();
    (named, eigen.eigenvalues[last] / eigen.eigenvalues.sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Honesty;
    use groma_geometry::{LieGroup, Se3};
    use groma_models::{Camera, Lens};
    use nalgebra::{Matrix6, Vector6};

    fn view(turn: f64, residuals: &[[f64; 2]], used: &[bool], taken: bool) -> ViewResult {
        ViewResult {
            pose: Se3::exp(&Vector6::new(0.0, 0.0, 1.0, turn, 0.0, 0.5)),
            white: Matrix6::identity(),
            covariance: Matrix6::identity(),
            decided: true,
            residuals: residuals.to_vec(),
            used: used.to_vec(),
            taken,
        }
    }

    fn calibration(views: Vec<ViewResult>) -> CameraCalibration {
        CameraCalibration {
            camera: Camera::centred(640, 480, Lens::Radtan, 600.0).unwrap(),
            covariance: DMatrix::identity(8, 8),
            residual_factor: 1.0,
            rms: 0.0,
            rms_all: 0.0,
            dof: 10,
            honesty: Honesty { factor: None, z_rms: vec![], projection_rms: 0.0, splits: 0 },
            views: views.into_iter().map(Some).collect(),
        }
    }

    #[test]
    fn residuals_of_corners_left_out_do_not_count() {
        let residuals = [[3.0, 4.0], [0.0, 1.0], [100.0, 0.0]];
        let of = |used: &[bool]| view(0.0, &residuals, used, true).rms();
        assert!((of(&[true, true, false]).unwrap() - 13f64.sqrt()).abs() < 1e-12);
        assert_eq!(of(&[false, false, false]), None);
    }

    /// A panel half a turn about x and tilted by 0.5: what is its own y is depth by the sine of its turn.
    #[test]
    fn a_view_is_placed_by_its_line_of_sight() {
        let mut view = view(0.0, &[], &[], true);
        let rotation = groma_geometry::So3::exp(&nalgebra::Vector3::new(0.5, 0.0, 0.0));
        view.pose = Se3 { rotation, translation: nalgebra::Vector3::new(0.0, 0.0, 2.0) };
        view.covariance = Matrix6::from_diagonal(&Vector6::new(9.0, 4.0, 0.0, 1.0, 1.0, 1.0));
        let [distance, tilt, sigma] = view.place();
        assert!((distance - 2.0).abs() < 1e-12 && (tilt - 0.5).abs() < 1e-12);
        assert!((sigma - 2.0 * 0.5f64.sin()).abs() < 1e-12);
    }

    #[test]
    fn views_held_out_are_judged_by_themselves() {
        let (good, bad) = (view(0.0, &[[0.1, 0.0]], &[true], true), view(0.0, &[[0.0, 2.0]], &[true], false));
        assert_eq!(calibration(vec![good.clone(), bad]).held_out_rms(), Some(2.0));
        assert_eq!(calibration(vec![good]).held_out_rms(), None);
    }

    #[test]
    fn panels_are_spread_by_the_largest_angle_between_those_that_took_part() {
        let at = |turn, taken| view(turn, &[], &[], taken);
        let spread = calibration(vec![at(0.1, true), at(-0.4, true), at(0.2, true), at(1.2, false)]).tilt_spread();
        let axis = |turn: f64| at(turn, true).pose.rotation.matrix().column(2).into_owned();
        assert!((spread - axis(-0.4).dot(&axis(0.2)).acos()).abs() < 1e-9 && spread > 0.5 && spread < 0.6, "{spread}");
        assert_eq!(calibration(vec![at(0.1, true)]).tilt_spread(), 0.0);
    }

    #[test]
    fn parameters_that_hang_together_are_named_whatever_their_units() {
        let mut covariance = DMatrix::from_diagonal(&nalgebra::dvector![4.0, 9e-8, 1.0, 25.0]);
        covariance[(0, 1)] = 0.99 * 2.0 * 3e-4;
        covariance[(1, 0)] = covariance[(0, 1)];
        let (named, share) = weak_direction(&covariance);
        assert_eq!(named, [0, 1]);
        assert!((share - 1.99 / 4.0).abs() < 1e-12);
    }
}

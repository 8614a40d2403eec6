//! Where a panel is, seen by a calibrated camera: `T_camera_panel` from the corners of one view.
//!
//! Start: the directions of the pixels, as points of the plane z = 1, and the corners are tied by a homography
//! `H ~ [r_1 r_2 t]`. Then Levenberg-Marquardt on the reprojection error, `T exp(d)`, `dp/dd = R [I, -[P]_x]`.
//!
//! A flat panel seen from afar has two poses of nearly equal error, mirrored at the plane across the line of sight:
//! with A the rotation that turns the line of sight to the panel's middle into the z axis and `D = diag(1, 1, -1)`,
//!
//! ```text
//! R' = A^T D A R D
//! ```
//!
//! (the second solution of infinitesimal plane-based pose estimation, to first order). Both are refined, both are
//! returned; the pose is `decided` when the other one has at least twice its squared error, or is the same.
//!
//! Covariance: `s^2 (J^T J)^-1` of d with the variance of the residuals, at least 1. It is the share of the corners
//! alone. What an error b of the camera's parameters does to the pose is `d = S b`, `S = -(J^T J)^-1 J^T J_theta`; it is
//! common to all views of the camera and no noise. Source: Collins, Bartoli, IJCV 109 (2014) 252; Schweighofer, Pinz,
//! PAMI 28 (2006) 2024.

use super::homography::homography;
use super::normal::{block, squared_error};
use super::view::Sighting;
use groma_estimation::levenberg_marquardt::{Normal, Options, Problem, minimize};
use groma_geometry::{LieGroup, Se3, So3};
use groma_models::Camera;
use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, UnitQuaternion, Vector2, Vector3, Vector6};
use std::convert::Infallible;

/// Ratio of squared errors from which the better of two poses is accepted.
pub const DECIDED: f64 = 2.0;
/// Rotations closer than this are the same [rad].
const SAME: f64 = 1e-3;
/// Directions that far from the axis have no place in the plane z = 1 (cosine).
const LEAST_COSINE: f64 = 0.1;
const MOST_STEPS: usize = 50;

/// Derivative of a pose in the parameters of the camera; columns beyond their number are zero.
pub type Sensitivity = SMatrix<f64, 6, 12>;

/// The pose of a panel and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PanelPose {
    /// `T_camera_panel`.
    pub pose: Se3,
    /// Covariance of d, `T exp(d)`: metres and radians; from the corners alone.
    pub covariance: Matrix6<f64>,
    /// `d = S b` for an error b of the parameters (true less assumed).
    pub sensitivity: Sensitivity,
    /// Squared residuals in units of their standard deviations.
    pub chi_square: f64,
    /// Number of residuals less 6.
    pub dof: usize,
    /// The mirrored pose and its squared residuals, when it is another one.
    pub other: Option<(Se3, f64)>,
    /// Whether the other pose can be left aside.
    pub decided: bool,
}

/// The pose of a panel; nothing when its corners are too few, on a line, or not seen by such a camera.
#[must_use]
pub fn panel_pose(camera: &Camera, corners: &[Sighting]) -> Option<PanelPose> {
    let [best, other] = both_poses(camera, corners)?;
    let block = block(camera, &best.0, corners)?;
    let inverse = block.pose.try_inverse()?;
    let dof = (2 * corners.len()).saturating_sub(6);
    let variance = if dof > 0 { (best.1 / dof as f64).max(1.0) } else { 1.0 };
    let same = best.0.rotation.between(&other.0.rotation).log().norm() < SAME;
    Some(PanelPose {
        pose: best.0,
        covariance: inverse * variance,
        sensitivity: -inverse * block.cross.transpose(),
        chi_square: best.1,
        dof,
        other: (!same).then_some(other),
        decided: same || other.1 >= DECIDED * best.1,
    })
}

/// The two poses with their squared residuals, the better one first.
pub(super) fn both_poses(camera: &Camera, corners: &[Sighting]) -> Option<[(Se3, f64); 2]> {
    let first = refined(camera, start(camera, corners)?, corners)?;
    let second = refined(camera, mirrored(&first.0, corners), corners).unwrap_or(first);
    Some(if second.1 < first.1 { [second, first] } else { [first, second] })
}

/// The pose that the homography between panel and plane z = 1 tells.
fn start(camera: &Camera, corners: &[Sighting]) -> Option<Se3> {
    let in_plane = |c: &Sighting| {
        let direction = camera.unproject(&c.pixel).filter(|d| d.z > LEAST_COSINE)?;
        Some((c.point.xy(), direction.xy() / direction.z))
    };
    let pairs: Vec<(Vector2<f64>, Vector2<f64>)> = corners.iter().filter_map(in_plane).collect();
    let h = homography(&pairs)?;
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm()) * h[(2, 2)].signum();
    let (a, b, t) = (h.column(0) * scale, h.column(1) * scale, h.column(2) * scale);
    let rotation = nearest_rotation(&Matrix3::from_columns(&[a, b, a.cross(&b)]))?;
    let translation: Vector3<f64> = t;
    translation.iter().all(|v| v.is_finite()).then_some(Se3 { rotation, translation })
}

fn nearest_rotation(m: &Matrix3<f64>) -> Option<So3> {
    let svd = m.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let turned = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    Some(to_so3(&(u * turned * v_t)))
}

fn to_so3(m: &Matrix3<f64>) -> So3 {
    So3 { quaternion: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*m)) }
}

/// The pose mirrored at the plane across the line of sight to the middle of the corners.
pub(super) fn mirrored(pose: &Se3, corners: &[Sighting]) -> Se3 {
    let middle = corners.iter().map(|c| c.point).sum::<Vector3<f64>>() / corners.len().max(1) as f64;
    let sight = pose.act(&middle);
    let to_axis = Rotation3::rotation_between(&sight, &Vector3::z()).unwrap_or_else(Rotation3::identity);
    let (a, d) = (to_axis.matrix(), Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0)));
    let rotation = to_so3(&(a.transpose() * d * a * pose.rotation.matrix() * d));
    Se3 { rotation, translation: sight - rotation.act(&middle) }
}

/// The pose of least squared error near a start, and that error.
pub(super) fn refined(camera: &Camera, start: Se3, corners: &[Sighting]) -> Option<(Se3, f64)> {
    let options = Options { max_iterations: MOST_STEPS, ..Options::default() };
    let Ok(end) = minimize(&mut PoseFit { camera, corners, normal: Normal::zeros() }, start, &options);
    end.map(|end| (end.state, end.cost))
}

/// The pose of a panel as a problem of six unknowns.
struct PoseFit<'a> {
    camera: &'a Camera,
    corners: &'a [Sighting],
    normal: Normal<6>,
}

impl Problem for PoseFit<'_> {
    type State = Se3;
    type Step = Vector6<f64>;
    type Error = Infallible;

    fn cost(&mut self, pose: &Se3) -> Result<Option<f64>, Infallible> {
        Ok(squared_error(self.camera, pose, self.corners))
    }

    fn linearize(&mut self, pose: &Se3) -> Result<(), Infallible> {
        let at = block(self.camera, pose, self.corners);
        self.normal = at.map_or_else(Normal::zeros, |b| Normal { information: b.pose, gradient: b.pose_gradient });
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Vector6<f64>, f64)>, Infallible> {
        Ok(self.normal.step(damping))
    }

    fn moved(&self, pose: &Se3, step: &Vector6<f64>) -> Option<Se3> {
        Some(pose.plus(step))
    }
}

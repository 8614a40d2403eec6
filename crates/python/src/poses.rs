//! Poses and their covariances, for what Python lays out, draws and tells. In the plane (x, y, heading), in space
//! (position, then x, y, z, w).

use crate::border::{self, In1, In2, In3, Out};
use crate::gate;
use groma_calibration::vehicle::Motions;
use groma_geometry::{LieGroup, Se2, Se3, So3, largest_sigma};
use groma_localization::Observation;
use groma_planning::camera::{camera_by_panel, foot_and_mount};
use nalgebra::{Matrix2, Matrix3, Quaternion, UnitQuaternion, Vector2, Vector3};
use numpy::ndarray::{Array2, Array3, ArrayView3};
use pyo3::prelude::*;

type Pose = (f64, f64, f64);

/// Seven numbers as a pose.
pub(crate) fn in_space([x, y, z, qx, qy, qz, qw]: [f64; 7]) -> Se3 {
    let quaternion = UnitQuaternion::new_normalize(Quaternion::new(qw, qx, qy, qz));
    Se3 { rotation: So3 { quaternion }, translation: Vector3::new(x, y, z) }
}

/// A pose as seven numbers.
pub(crate) fn numbers(pose: &Se3) -> [f64; 7] {
    let (t, q) = (pose.translation, pose.rotation.quaternion);
    [t.x, t.y, t.z, q.i, q.j, q.k, q.w]
}

fn plane(pose: &Se2) -> Pose {
    (pose.x(), pose.y(), pose.theta())
}

/// Foot of a camera in the plane, and the camera seen from there; None when it is not above the floor or looks plumb.
#[pyfunction]
pub(crate) fn foot_of(camera: [f64; 7]) -> Option<(Pose, [f64; 7])> {
    foot_and_mount(&in_space(camera)).map(|(foot, mount)| (plane(&foot), numbers(&mount)))
}

/// The camera that sees a panel at `seen` (4, 4), which a robot at `robot` carries at `carried`.
#[pyfunction]
pub(crate) fn camera_seeing(robot: Pose, carried: [f64; 7], seen: In2<'_, f64>) -> PyResult<[f64; 7]> {
    let m = seen.as_array();
    let seen = crate::rendering::pose(|i, j| m[(i, j)]);
    Ok(numbers(&camera_by_panel(&gate::pose(robot)?, &in_space(carried), &seen)))
}

/// `T_a_c` of `T_a_b` and `T_b_c`.
#[pyfunction]
pub(crate) fn composed(a: Pose, b: Pose) -> PyResult<Pose> {
    Ok(plane(&(gate::pose(a)? * gate::pose(b)?)))
}

/// `T_a_b` of two poses in one frame.
#[pyfunction]
pub(crate) fn between(a: Pose, b: Pose) -> PyResult<Pose> {
    Ok(plane(&gate::pose(a)?.between(&gate::pose(b)?)))
}

/// Of poses (n, 7), each but the first: the one before it as seen from it, (n - 1, 4, 4).
#[pyfunction]
pub(crate) fn steps_back<'py>(py: Python<'py>, poses: In2<'py, f64>) -> border::Array3<f64> {
    let rows = poses.as_array();
    let pose = |k: usize| in_space(std::array::from_fn(|c| rows[(k, c)]));
    let steps: Vec<[f64; 16]> =
        (1..rows.nrows()).map(|k| crate::rendering::entries(&(pose(k).inverse() * pose(k - 1)))).collect();
    Array3::from_shape_fn((steps.len(), 4, 4), |(k, r, c)| steps[k][4 * r + c]).out(py)
}

/// Range and bearing (n, 2) of points (n, 2) in the laser frame, with covariances (n, 2, 2) from those of the points.
#[pyfunction]
pub(crate) fn points_seen<'py>(
    py: Python<'py>,
    points: In2<'py, f64>,
    covariances: In3<'py, f64>,
) -> (border::Array2<f64>, border::Array3<f64>) {
    let (points, c) = (points.as_array(), covariances.as_array());
    let seen = |k: usize| {
        let covariance = Matrix2::from_fn(|i, j| c[(k, i, j)]);
        Observation::at_point(0.0, Vector2::new(points[(k, 0)], points[(k, 1)]), covariance)
    };
    let seen: Vec<Observation> = (0..points.nrows()).map(seen).collect();
    let polar = Array2::from_shape_fn((seen.len(), 2), |(k, c)| seen[k].polar[c]);
    let spread =
        |(k, i, j): (usize, usize, usize)| f64::midpoint(seen[k].covariance[(i, j)], seen[k].covariance[(j, i)]);
    (polar.out(py), Array3::from_shape_fn((seen.len(), 2, 2), spread).out(py))
}

/// Standard deviations by covariances (n, 3, 3) of x, y, heading: of the position in its worst direction, and the heading.
#[pyfunction]
pub(crate) fn planar_sigmas<'py>(
    py: Python<'py>,
    covariances: In3<'py, f64>,
) -> (border::Array1<f64>, border::Array1<f64>) {
    let all = blocks(covariances.as_array());
    let position = |c: &Matrix3<f64>| largest_sigma(&c.fixed_view::<2, 2>(0, 0).into_owned());
    let (positions, headings): (Vec<f64>, Vec<f64>) = all.iter().map(|c| (position(c), c.m33.max(0.0).sqrt())).unzip();
    (positions.out(py), headings.out(py))
}

/// Motions (n - 1, 3), covariances and couplings.
type Between = (border::Array2<f64>, border::Array3<f64>, border::Array3<f64>);

/// Motions between poses (n, 3) whose errors are independent.
#[pyfunction]
pub(crate) fn motions_between_poses<'py>(
    py: Python<'py>,
    stamps: In1<'py, f64>,
    poses: In2<'py, f64>,
    covariances: In3<'py, f64>,
) -> Between {
    let rows = poses.as_array();
    let pose = |(k, t): (usize, &f64)| (*t, Vector3::new(rows[(k, 0)], rows[(k, 1)], rows[(k, 2)]));
    let poses: Vec<_> = stamps.as_array().iter().enumerate().map(pose).collect();
    let found = Motions::between_poses(&poses, &blocks(covariances.as_array()));
    let m = &found.motions;
    let motion = |(k, c): (usize, usize)| [m[k].motion.x(), m[k].motion.y(), m[k].turn][c];
    let cube = |all: &Option<Vec<Matrix3<f64>>>| {
        let all = all.as_deref().unwrap_or_default();
        Array3::from_shape_fn((all.len(), 3, 3), |(k, r, c)| all[k][(r, c)]).out(py)
    };
    let rows = Array2::from_shape_fn((m.len(), 3), motion).out(py);
    (rows, cube(&found.covariances), cube(&found.couplings))
}

fn blocks(array: ArrayView3<'_, f64>) -> Vec<Matrix3<f64>> {
    (0..array.shape()[0]).map(|k| Matrix3::from_fn(|r, c| array[(k, r, c)])).collect()
}

//! Where a fixed camera is and where the target sits on the robot, from known poses of the robot.
//!
//! `T_W_R,i T_R_B = T_W_C Z_i` for every view i: "robot-world / hand-eye". Closed form first, then least squares over the
//! corners ([`refine`]).
//!
//! *Full motion.* `(R_Z,i kron R_R,i) vec(R_M) = vec(R_C)`: the largest singular pair of `sum_i R_Z,i kron R_R,i`
//! (Shah, J. Mechanisms Robotics 5 (2013) 031007); then both translations by linear least squares.
//!
//! *Motion in the plane.* The axis of all turns is `n_C = R_C^T e_z` in the camera and `n_B = R_M^T e_z` in the target, seen
//! directly. With A_C, A_B that turn these onto e_z: `R_C = Rz(alpha) A_C`, `R_M = Rz(beta) A_B`, and
//!
//! ```text
//! A_C R_Z,i A_B^T = Rz(theta_i + beta - alpha)
//! Rz(alpha) (A_C t_Z,i)_xy - Rz(theta_i) m + c = t_i          linear in (cos alpha, sin alpha, m, c)
//! (A_C t_Z,i)_z = m_z - c_z + h_i                             the heights: only their difference
//! ```
//!
//! The height of the target is *not observable* then: raising target and camera together changes nothing. It is taken as
//! given. A robot that never turns does not determine the mount.

use crate::Error;
use crate::batch::Lens;
use crate::measurement::jacobians;
use crate::view::{Corner, Sighting, by_twist};
use groma_estimation::least_squares::{Fit, Options, minimize};
use groma_geometry::{LieGroup, Se3, So3};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3, Vector6, wrap};

/// Turns about axes that spread less than this are all about one axis [rad].
const ONE_AXIS: f64 = 0.01;
/// Turns smaller than this all together determine no axis [rad].
const NO_TURN: f64 = 0.02;
/// A component of a weak direction below this share of the largest is not named.
const NAMED: f64 = 0.1;

/// Camera and mount.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandEye {
    /// `T_W_C`.
    pub camera: Se3,
    /// `T_R_B`.
    pub mount: Se3,
    /// Whether the robot moved in the plane, so that the height of the mount is the one given.
    pub planar: bool,
}

/// The closed form. `height` is the target's on the robot, used when motion in the plane cannot tell it [m].
///
/// # Errors
/// [`Error::NoData`] when there are fewer than three views or the robot does not turn.
pub fn closed_form(robots: &[Se3], views: &[Se3], height: f64) -> Result<HandEye, Error> {
    if robots.len() != views.len() || robots.len() < 3 {
        return Err(Error::NoData(format!("hand-eye needs three views or more, got {}", views.len())));
    }
    let (most, second) = turning(robots);
    if most < NO_TURN {
        return Err(Error::NoData("the robot never turned: nothing tells where the target is on it".into()));
    }
    if second < ONE_AXIS { planar(robots, views, height) } else { full(robots, views) }
}

/// Root mean square turn about the main axis and about the next one, between the poses [rad].
fn turning(robots: &[Se3]) -> (f64, f64) {
    let mut moments = Matrix3::zeros();
    for robot in &robots[1..] {
        let turn = (robot.rotation * robots[0].rotation.inverse()).log();
        moments += turn * turn.transpose() / (robots.len() - 1) as f64;
    }
    let mut values: Vec<f64> = moments.symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    (values[0], values[1])
}

fn full(robots: &[Se3], views: &[Se3]) -> Result<HandEye, Error> {
    let mut sum = DMatrix::zeros(9, 9);
    for (robot, view) in robots.iter().zip(views) {
        sum += view.rotation.matrix().kronecker(&robot.rotation.matrix());
    }
    let svd = sum.svd(true, true);
    let largest = svd.singular_values.imax();
    let (u, v_t) = svd.u.zip(svd.v_t).ok_or_else(no_rotation)?;
    let matrix = |values: &[f64]| Matrix3::from_column_slice(values);
    let (camera, mount) =
        (matrix(u.column(largest).clone_owned().as_slice()), matrix(v_t.row(largest).transpose().as_slice()));
    let sign = mount.determinant().signum();
    let (camera, mount) = (rotation(&(camera * sign))?, rotation(&(mount * sign))?);
    let (m, c) = translations(robots, views, &camera);
    Ok(HandEye {
        camera: Se3 { rotation: camera, translation: c },
        mount: Se3 { rotation: mount, translation: m },
        planar: false,
    })
}

/// `R_R,i t_M - t_C = R_C t_Z,i - t_R,i`.
fn translations(robots: &[Se3], views: &[Se3], camera: &So3) -> (Vector3<f64>, Vector3<f64>) {
    let mut rows = DMatrix::zeros(3 * robots.len(), 6);
    let mut right = DVector::zeros(3 * robots.len());
    for (k, (robot, view)) in robots.iter().zip(views).enumerate() {
        rows.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&robot.rotation.matrix());
        rows.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&-Matrix3::identity());
        right.fixed_rows_mut::<3>(3 * k).copy_from(&(camera.act(&view.translation) - robot.translation));
    }
    let x = solved(rows, &right);
    (Vector3::new(x[0], x[1], x[2]), Vector3::new(x[3], x[4], x[5]))
}

/// Motion in the plane, of a robot that may be tilted, always in the same way.
fn planar(robots: &[Se3], views: &[Se3], height: f64) -> Result<HandEye, Error> {
    let level = Se3 { rotation: robots[0].rotation.inverse(), ..Se3::identity() };
    let upright: Vec<Se3> = robots.iter().map(|robot| *robot * level).collect();
    let found = planar_upright(&upright, views, height)?;
    Ok(HandEye { mount: level * found.mount, ..found })
}

fn planar_upright(robots: &[Se3], views: &[Se3], height: f64) -> Result<HandEye, Error> {
    let yaw = |robot: &Se3| {
        let r = robot.rotation.matrix();
        r[(1, 0)].atan2(r[(0, 0)])
    };
    let turns: Vec<f64> = robots.iter().map(yaw).collect();
    let (mut n_c, mut n_b) = (Vector3::zeros(), Vector3::zeros());
    for (view, turn) in views.iter().zip(&turns) {
        let turned = wrap(turn - turns[0], -std::f64::consts::PI, std::f64::consts::PI);
        n_c += (view.rotation * views[0].rotation.inverse()).log() * turned;
        n_b += (views[0].rotation.inverse() * view.rotation).log() * turned;
    }
    let (a_c, a_b) = (upright(&n_c), upright(&n_b));
    let angle = |view: &Se3, turn: f64| {
        let r = (a_c * view.rotation * a_b.inverse()).matrix();
        r[(1, 0)].atan2(r[(0, 0)]) - turn
    };
    let (s, c) = views.iter().zip(&turns).fold((0.0, 0.0), |sum, (view, &turn)| {
        let a = angle(view, turn);
        (sum.0 + a.sin(), sum.1 + a.cos())
    });
    let seen: Vec<Vector3<f64>> = views.iter().map(|view| a_c.act(&view.translation)).collect();
    let alpha = heading(robots, &turns, &seen);
    let camera = z_turn(alpha) * a_c;
    let (mut m, mut at) = translations(robots, views, &camera);
    let lift = height - m.z;
    (m.z, at.z) = (m.z + lift, at.z + lift);
    Ok(HandEye {
        camera: Se3 { rotation: camera, translation: at },
        mount: Se3 { rotation: z_turn(alpha + s.atan2(c)) * a_b, translation: m },
        planar: true,
    })
}

/// alpha, from the positions.
fn heading(robots: &[Se3], turns: &[f64], seen: &[Vector3<f64>]) -> f64 {
    let mut rows = DMatrix::zeros(2 * robots.len(), 6);
    let mut right = DVector::zeros(2 * robots.len());
    for (k, ((robot, turn), q)) in robots.iter().zip(turns).zip(seen).enumerate() {
        let (s, c) = turn.sin_cos();
        rows.row_mut(2 * k).copy_from_slice(&[q.x, -q.y, -c, s, 1.0, 0.0]);
        rows.row_mut(2 * k + 1).copy_from_slice(&[q.y, q.x, -s, -c, 0.0, 1.0]);
        (right[2 * k], right[2 * k + 1]) = (robot.translation.x, robot.translation.y);
    }
    let x = solved(rows, &right);
    x[1].atan2(x[0])
}

/// Least squares; of all solutions the shortest.
fn solved(rows: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let n = rows.ncols();
    rows.svd(true, true).solve(right, 1e-9).unwrap_or_else(|_| DVector::zeros(n))
}

fn z_turn(angle: f64) -> So3 {
    So3::exp(&Vector3::new(0.0, 0.0, angle))
}

/// A rotation that turns a direction onto z.
fn upright(direction: &Vector3<f64>) -> So3 {
    let turn = UnitQuaternion::rotation_between(direction, &Vector3::z());
    So3 {
        quaternion: turn.unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)),
    }
}

fn rotation(m: &Matrix3<f64>) -> Result<So3, Error> {
    let svd = m.svd(true, true);
    let (u, v_t) = svd.u.zip(svd.v_t).ok_or_else(no_rotation)?;
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    let rotation = Rotation3::from_matrix_unchecked(u * flip * v_t);
    Ok(So3 { quaternion: UnitQuaternion::from_rotation_matrix(&rotation) })
}

fn no_rotation() -> Error {
    Error::NoData("the poses are no poses".into())
}

/// Camera, mount and calibration states.
pub type Estimate = (Se3, Se3, DVector<f64>);

/// The least squares fit over all corners: the world-frame errors of camera and mount, six each, and the lens' calibration
/// states with their prior. Unconstrained directions stay at the start and are in `weak`; say them with
/// [`in_words`].
///
/// # Errors
/// When the camera does not see a corner from the start.
pub fn refine(lens: &Lens, robots: &[Se3], corners: &[Vec<Corner>], start: &HandEye) -> Result<Fit<Estimate>, Error> {
    let moved = |(c, m, b): &Estimate, d: &DVector<f64>| {
        let part = |k: usize| Se3::exp(&Vector6::from_column_slice(&d.as_slice()[k..k + 6]));
        (part(0) * *c, part(6) * *m, b + d.rows(12, b.len()))
    };
    let model = |at: &Estimate| residuals(lens, robots, corners, at);
    let start = (start.camera, start.mount, DVector::zeros(lens.basis.ncols()));
    Ok(minimize(start, moved, model, &Options::default())?)
}

/// Whitened residuals, those of the prior last, and their derivatives.
fn residuals(
    lens: &Lens,
    robots: &[Se3],
    corners: &[Vec<Corner>],
    (c, m, b): &Estimate,
) -> (DVector<f64>, DMatrix<f64>) {
    let (count, states) = (corners.iter().map(Vec::len).sum::<usize>(), b.len());
    let camera = lens.calibrated(b);
    let mut r = DVector::from_element(2 * count + states, f64::INFINITY);
    let mut j = DMatrix::zeros(2 * count + states, 12 + states);
    r.rows_mut(2 * count, states).copy_from(b);
    j.view_mut((2 * count, 12), (states, states)).fill_with_identity();
    let mut row = 0;
    for (robot, seen) in robots.iter().zip(corners) {
        let pose = c.between(&(*robot * *m));
        let (by_robot, by_mount) = jacobians(robot, m);
        for corner in seen {
            if let Some(image) = camera.project_with_jacobians(&pose.act(&corner.point)) {
                let j_d = image.by_point * by_twist(&pose, &corner.point) / corner.sigma;
                let j_b = image.by_parameters.columns(0, lens.basis.nrows()) * &lens.basis / corner.sigma;
                r.fixed_rows_mut::<2>(row).copy_from(&((image.pixel - corner.pixel) / corner.sigma));
                j.fixed_view_mut::<2, 6>(row, 0).copy_from(&(-(j_d * by_robot)));
                j.fixed_view_mut::<2, 6>(row, 6).copy_from(&(j_d * by_mount));
                j.view_mut((row, 12), (2, states)).copy_from(&j_b);
            }
            row += 2;
        }
    }
    (r, j)
}

/// A weak direction of [`refine`] in words.
#[must_use]
pub fn in_words(direction: &DVector<f64>) -> String {
    // The target rises along the robot's vertical, whatever its axes are.
    let (camera_z, mount) = (direction[2].abs(), direction.rows(6, 3).norm());
    let rest = [0, 1, 3, 4, 5, 9, 10, 11].map(|k: usize| direction[k].abs()).iter().fold(0.0, |a: f64, b| a.max(*b));
    if rest < NAMED * camera_z && (camera_z - mount).abs() < NAMED * camera_z {
        return "the height of the target on the robot is unobservable: raising target and camera together changes \
                nothing, for the robot moves in the plane; measure it"
            .to_owned();
    }
    let names = ["x", "y", "z", "rotation about x", "rotation about y", "rotation about z"];
    let largest = direction.amax();
    let named = |k: usize| format!("{} of the {}", names[k % 6], if k < 6 { "camera" } else { "target" });
    let parts: Vec<String> = (0..12).filter(|&k| direction[k].abs() > NAMED * largest).map(named).collect();
    format!(
        "the data do not determine a common change of {}: let the robot turn more, and at other places",
        parts.join(", ")
    )
}

/// Root mean square residual over coordinates [standard deviations].
#[must_use]
pub fn rms(fit: &Fit<Estimate>) -> f64 {
    let states = fit.estimate.2.len();
    let corners = fit.residuals.rows(0, fit.residuals.len() - states);
    (corners.norm_squared() / corners.len().max(1) as f64).sqrt()
}

/// Closed form and fit in one: each view's pose from its corners, then [`closed_form`], then [`refine`]. Also whether the
/// robot moved in the plane.
///
/// # Errors
/// As those two, and when a view's pose cannot be found.
pub fn place(
    lens: &Lens,
    robots: &[Se3],
    corners: &[Vec<Corner>],
    height: f64,
) -> Result<(Fit<Estimate>, bool), Error> {
    let sighting = |k: usize| Some((k, Sighting::new(&lens.camera, &lens.basis, &corners[k])?.fits[0].pose));
    let seen: Vec<(usize, Se3)> = (0..corners.len().min(robots.len())).filter_map(sighting).collect();
    let chosen: Vec<Se3> = seen.iter().map(|(k, _)| robots[*k]).collect();
    let views: Vec<Se3> = seen.iter().map(|(_, pose)| *pose).collect();
    let start = closed_form(&chosen, &views, height)?;
    let used: Vec<Vec<Corner>> = seen.iter().map(|(k, _)| corners[*k].clone()).collect();
    Ok((refine(lens, &chosen, &used, &start)?, start.planar))
}

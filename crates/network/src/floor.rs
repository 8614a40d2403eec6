//! The floor: where the robot stands it is level at height zero, up to unevenness that is new at every stop.
//!
//! `T_W_R = planar(x, y, yaw) Exp(j)`, `j ~ N(0, diag(0, 0, sigma_h^2, sigma_t^2, sigma_t^2, 0))`. When the robot drives on,
//! its old unevenness is forgotten: the pose becomes `planar(T)`, its error `F xi`, F the derivative of `planar` in the
//! world frame ([`levelled`]). F leaves a common motion of the plane, `xi = (a, b, 0, 0, 0, c)`, exactly as it is, so that
//! nothing is learned of what cannot be known. With both sigmas zero this is the planar robot: its z, roll and pitch
//! have no variance ever.
//!
//! This takes the place of a large process noise with pseudo-measurements `z = 0, tilt = 0`: the same model, O(n) instead
//! of O(n^2), and no large numbers. Not for ramps or several floors.

use groma_geometry::{LieGroup, Se3};
use nalgebra::{Matrix6, Vector6};
use serde::{Deserialize, Serialize};

/// How uneven the floor is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Floor {
    /// Standard deviation of the robot's height at a stop [m].
    pub height: f64,
    /// Standard deviation of its roll and of its pitch at a stop [rad].
    pub tilt: f64,
}

impl Default for Floor {
    /// A smooth hall: 2 mm and 0.2 degrees.
    fn default() -> Self {
        Self { height: 0.002, tilt: 0.2f64.to_radians() }
    }
}

impl Floor {
    /// A floor without unevenness: the robot moves in the plane.
    pub const PLANE: Self = Self { height: 0.0, tilt: 0.0 };

    /// Standard deviations of j.
    #[must_use]
    pub fn sigmas(&self) -> Vector6<f64> {
        Vector6::new(0.0, 0.0, self.height, self.tilt, self.tilt, 0.0)
    }
}

/// `planar(T)`: the same x, y and yaw, level, at height zero.
#[must_use]
pub fn planar(pose: &Se3) -> Se3 {
    let r = pose.rotation.matrix();
    let yaw = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, r[(1, 0)].atan2(r[(0, 0)]));
    Se3 { translation: [pose.translation.x, pose.translation.y, 0.0].into(), ..Se3::exp(&yaw) }
}

/// `planar(T)` and F: `planar(Exp(xi) T) = Exp(F xi) planar(T)` to first order.
///
/// With x_b the body's x axis in the world: `yaw' = w_z - x_bz (w_x x_bx + w_y x_by)/(x_bx^2 + x_by^2)`,
/// `(x', y') = rho + (w x p)_xy`; the twist of the level pose is `(x' + yaw' y, y' - yaw' x, 0, 0, 0, yaw')`.
#[must_use]
pub fn levelled(pose: &Se3) -> (Se3, Matrix6<f64>) {
    let (r, p) = (pose.rotation.matrix(), pose.translation);
    let share = r[(2, 0)] / (r[(0, 0)].powi(2) + r[(1, 0)].powi(2));
    let (yaw_x, yaw_y) = (-share * r[(0, 0)], -share * r[(1, 0)]);
    let mut f = Matrix6::zeros();
    f.row_mut(5).copy_from_slice(&[0.0, 0.0, 0.0, yaw_x, yaw_y, 1.0]);
    f.row_mut(0).copy_from_slice(&[1.0, 0.0, 0.0, yaw_x * p.y, p.z + yaw_y * p.y, 0.0]);
    f.row_mut(1).copy_from_slice(&[0.0, 1.0, 0.0, -p.z - yaw_x * p.x, -yaw_y * p.x, 0.0]);
    (planar(pose), f)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_equals_differences() {
        let pose = Se3::exp(&Vector6::new(5.0, -3.0, 0.4, 0.1, -0.2, 2.0));
        let (level, f) = levelled(&pose);
        let h = 1e-5;
        for k in 0..6 {
            let d = Vector6::from_fn(|i, _| if i == k { h } else { 0.0 });
            let at = |d: &Vector6<f64>| (planar(&(Se3::exp(d) * pose)) * level.inverse()).log();
            let numeric = (at(&d) - at(&-d)) / (2.0 * h);
            assert!((f.column(k) - numeric).amax() < 1e-7, "{k}: {} {numeric}", f.column(k));
        }
    }

    #[test]
    fn a_common_motion_of_the_plane_passes_unchanged() {
        let (_, f) = levelled(&Se3::exp(&Vector6::new(50.0, -30.0, 0.4, 0.05, -0.02, 2.0)));
        for common in [[1.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]] {
            let common = Vector6::from(common);
            assert_eq!(f * common, common);
        }
    }
}

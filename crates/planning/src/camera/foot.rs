//! Where a camera stands above the floor: its foot, and the camera as seen from there.
//!
//! ```text
//! foot     x and y of the camera; heading: where its optical axis points, seen from above
//! mount    T_foot_camera = planar(T_a_foot)^-1 T_a_camera
//! a view   T_a_camera    = planar(T_a_base) T_base_panel T_camera_panel^-1
//! ```
//!
//! The floor is z = 0 of frame a. A camera that is not above it, or looks straight up or down, has no foot.

use groma_geometry::{LieGroup, Se2, Se3, So3};
use nalgebra::{UnitQuaternion, Vector3};

/// A camera whose axis leaves the plumb line by less looks straight up or down [1].
const PLUMB: f64 = 1e-6;

/// A pose in the plane as one in space.
#[must_use]
pub fn on_the_level(pose: &Se2) -> Se3 {
    let quaternion = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.theta());
    Se3 { rotation: So3 { quaternion }, translation: Vector3::new(pose.x(), pose.y(), 0.0) }
}

/// Foot and mount of a camera in some frame.
#[must_use]
pub fn foot_and_mount(camera: &Se3) -> Option<(Se2, Se3)> {
    let (at, axis) = (camera.translation, camera.rotation.act(&Vector3::z()));
    if at.z <= 0.0 || axis.x.hypot(axis.y) < PLUMB {
        return None;
    }
    let foot = Se2::new(at.x, at.y, axis.y.atan2(axis.x));
    Some((foot, on_the_level(&foot).inverse() * *camera))
}

/// The camera that saw a panel at a pose (`T_camera_panel`), which a robot carries at another (`T_base_panel`).
#[must_use]
pub fn camera_by_panel(robot: &Se2, carried: &Se3, seen: &Se3) -> Se3 {
    on_the_level(robot) * *carried * seen.inverse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::mount;

    fn near(a: &Se3, b: &Se3) -> bool {
        (a.inverse() * *b).log().norm() < 1e-9
    }

    #[test]
    fn a_camera_on_its_mount_has_the_foot_it_was_put_on() {
        for pitch in [-0.3, 0.0, 0.4, 1.4] {
            let (foot, mount) = (Se2::new(3.0, -2.0, 2.5), mount(2.2, pitch).unwrap());
            let (found, above) = foot_and_mount(&(on_the_level(&foot) * mount)).unwrap();
            assert!(found.minus(&foot).norm() < 1e-12, "{found:?}");
            assert!(near(&above, &mount));
        }
    }

    #[test]
    fn below_the_floor_or_on_the_plumb_line_there_is_no_foot() {
        let at = |z: f64, pitch: f64| mount(z, pitch).unwrap();
        assert!(foot_and_mount(&at(-0.1, 0.2)).is_none() && foot_and_mount(&at(0.0, 0.2)).is_none());
        let turned = So3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
        let down = Se3 { rotation: turned, translation: Vector3::new(1.0, 1.0, 3.0) };
        assert!(foot_and_mount(&down).is_none());
    }

    /// By hand: a robot at (2, 1) that faces left, a panel half a metre ahead of it, a camera a metre behind that panel.
    #[test]
    fn a_look_at_a_panel_tells_where_the_camera_is() {
        let robot = Se2::new(2.0, 1.0, std::f64::consts::FRAC_PI_2);
        let carried = Se3 { translation: Vector3::new(0.5, 0.0, 0.8), ..Se3::identity() };
        let seen = Se3 { translation: Vector3::new(1.0, 0.0, 0.2), ..Se3::identity() };
        let camera = camera_by_panel(&robot, &carried, &seen);
        assert!((camera.translation - Vector3::new(2.0, 0.5, 0.6)).norm() < 1e-12, "{}", camera.translation);
        let back = camera * seen;
        assert!(near(&back, &(on_the_level(&robot) * carried)));
    }
}

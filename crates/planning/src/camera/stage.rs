//! A camera on its mount, a robot with panels on the floor before it, and what the camera sees of them.
//!
//! The floor is z = 0; the camera stands at (0, 0, height), looks along x and down by its pitch. A panel is seen when its
//! front is turned towards the camera by less than 75 degrees and at least eight of its corners are in the image, two
//! pixels from its border. Not modelled: occlusion, blur, light.

use crate::error::Error;
use groma_geometry::{LieGroup, Se2, Se3, So3};
use groma_models::target::TagGrid;
use groma_models::{Camera, Lens, Panel, Pattern, Target};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

/// Cosine of the steepest angle under which a panel is read.
const STEEPEST: f64 = 0.26;
/// Fewest corners of a panel that is read.
const LEAST_CORNERS: usize = 8;
/// Distance from the border of the image at which a corner counts [pixel].
const MARGIN: f64 = 2.0;

/// What a drive is judged on.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The camera, as far as it is known: its nominal intrinsics do.
    pub camera: Camera,
    /// `T_floor_camera`.
    pub mount: Se3,
    /// The panels on the robot.
    pub target: Target,
    /// Standard deviation of a corner's coordinate [pixel].
    pub sigma: f64,
}

/// A panel in an image.
#[derive(Clone, Debug)]
pub struct PanelView {
    /// `T_camera_panel`.
    pub pose: Se3,
    /// The corners seen, in the frame of the panel [m].
    pub corners: Vec<Vector3<f64>>,
}

impl Stage {
    /// A camera at a height [m], pitched down [rad], and panels of 6 by 6 tags, 0.6 m wide, upright around the robot at
    /// the given yaws [rad], their middles 0.3 m from its centre and 0.8 m high.
    pub fn new(camera: Camera, height: f64, pitch: f64, yaws: &[f64]) -> Result<Self, Error> {
        Error::unless(height > 0.0 && height.is_finite(), "height", height, "must be above 0 and finite")?;
        Error::unless(pitch.abs() < 1.5, "pitch", pitch, "must be within 1.5 rad of level")?;
        let (s, c) = pitch.sin_cos();
        let rotation = Matrix3::new(0.0, -s, c, -1.0, 0.0, 0.0, 0.0, -c, -s);
        let mount = Se3 { rotation: turned(rotation), translation: Vector3::new(0.0, 0.0, height) };
        let panels = yaws.iter().enumerate().map(|(k, &yaw)| upright(k, yaw)).collect();
        Ok(Self { camera, mount, target: Target { panels }, sigma: 0.3 })
    }

    /// The camera of the thesis' kind: 640 by 480 pixels, focal length 600, some barrel distortion.
    pub fn nominal_camera() -> Result<Camera, Error> {
        let parameters = vec![600.0, 600.0, 319.5, 239.5, -0.25, 0.1, 0.0, 0.0];
        Camera::new(640, 480, Lens::Radtan, parameters).map_err(|e| Error::Unreachable(e.to_string()))
    }

    /// What the camera sees of a robot at a pose.
    #[must_use]
    pub fn views(&self, robot: &Se2) -> Vec<PanelView> {
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), robot.theta());
        let translation = Vector3::new(robot.x(), robot.y(), 0.0);
        let t_camera_robot = self.mount.inverse() * Se3 { rotation: So3 { quaternion: yaw }, translation };
        self.target.panels.iter().filter_map(|panel| self.view(panel, t_camera_robot * panel.t_robot_panel())).collect()
    }

    fn view(&self, panel: &Panel, pose: Se3) -> Option<PanelView> {
        let corners = panel.pattern.corners();
        let middle = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let to_camera = -pose.act(&middle);
        let facing = (pose.rotation.matrix() * Vector3::z()).dot(&to_camera) / to_camera.norm();
        if facing < STEEPEST {
            return None;
        }
        let seen: Vec<_> =
            corners.into_iter().filter(|p| self.camera.project(&pose.act(p)).is_some_and(|q| self.holds(q))).collect();
        (seen.len() >= LEAST_CORNERS).then_some(PanelView { pose, corners: seen })
    }

    fn holds(&self, pixel: Vector2<f64>) -> bool {
        let shift = Vector2::new(MARGIN, MARGIN);
        self.camera.holds(&(pixel - shift)) && self.camera.holds(&(pixel + shift))
    }
}

fn upright(number: usize, yaw: f64) -> Panel {
    let grid = TagGrid {
        family: "tag36h11".into(),
        columns: 6,
        rows: 6,
        size: 0.08,
        spacing: 0.25,
        first_id: 36 * number as u32,
        border: 2,
    };
    let half = 0.29;
    // x of the panel to the left of who looks at it from outside is -y of the robot; z outwards.
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), yaw).into_inner();
    let rotation = turn * Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    let origin = turn * Vector3::new(0.3, -half, 0.8 - half);
    let q = turned(rotation).quaternion;
    Panel {
        name: format!("panel_{number}"),
        pattern: Pattern::TagGrid(grid),
        position: origin.into(),
        quaternion: [q.i, q.j, q.k, q.w],
    }
}

fn turned(rotation: Matrix3<f64>) -> So3 {
    So3 { quaternion: UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn stage() -> Stage {
        Stage::new(Stage::nominal_camera().unwrap(), 2.0, 0.43, &[0.0]).unwrap()
    }

    #[test]
    fn a_panel_that_faces_the_camera_is_in_the_middle_of_its_image() {
        let views = stage().views(&Se2::new(2.9, 0.0, PI));
        assert_eq!((views.len(), views[0].corners.len()), (1, 144));
        let middle = views[0].pose.act(&Vector3::new(0.29, 0.29, 0.0));
        let pixel = stage().camera.project(&middle).unwrap();
        assert!((pixel - Vector2::new(319.5, 239.5)).norm() < 10.0, "{pixel}");
    }

    #[test]
    fn a_panel_that_is_turned_away_or_out_of_the_image_is_not_seen() {
        assert!(stage().views(&Se2::new(2.9, 0.0, 0.0)).is_empty());
        assert!(stage().views(&Se2::new(2.9, 5.0, PI)).is_empty());
        assert!(stage().views(&Se2::new(-2.9, 0.0, 0.0)).is_empty());
    }
}

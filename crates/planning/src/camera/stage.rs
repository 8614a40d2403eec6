//! A camera on its mount, a robot with panels on the floor before it, and what the camera sees of them.
//!
//! The floor is z = 0, its origin the foot of the camera, x the direction in which it looks. A panel is seen when its
//! front is turned towards the camera by less than 75 degrees and enough of it can be read: four tags whose four corners are
//! in the image, two pixels from its border, and whose sides are 8 pixels long; of a board, eight corners. Not modelled:
//! occlusion, blur, light.

use crate::error::Error;
use groma_geometry::{LieGroup, Se2, Se3, So3};
use groma_models::target::TagGrid;
use groma_models::{Camera, Lens, Panel, Pattern, Target};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};
use std::f64::consts::FRAC_PI_4;

/// Cosine of the steepest angle under which a panel is read.
const STEEPEST: f64 = 0.26;
/// Fewest tags of a panel that is read, and corners of a board.
const LEAST_TAGS: usize = 4;
const LEAST_CORNERS: usize = 8;
/// A panel with fewer than four times as many corners is never thinned.
const LEAST_THINNED: usize = 16;
/// Shortest side of a tag that is read [pixel].
const SHORTEST: f64 = 8.0;
/// Distance from the border of the image at which a corner counts [pixel].
const MARGIN: f64 = 2.0;
/// Standard deviation of a corner's coordinate [pixel].
pub const SIGMA: f64 = 0.3;
/// Headings of three panels, 45 degrees apart [rad].
pub const FAN: [f64; 3] = [-FRAC_PI_4, 0.0, FRAC_PI_4];

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
    /// Corners of each panel in its frame [m].
    corners: Vec<Vec<Vector3<f64>>>,
    /// Some of them, and how many each represents.
    sparse: Vec<(Vec<Vector3<f64>>, f64)>,
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
    /// A camera on a mount before a robot that carries a target.
    ///
    /// # Errors
    /// When the camera is not above the floor, a number is not finite, or the target makes no sense.
    pub fn new(camera: Camera, mount: Se3, target: Target, sigma: f64) -> Result<Self, Error> {
        let height = mount.translation.z;
        Error::unless(height > 0.0 && height.is_finite(), "height", height, "must be above 0 and finite")?;
        Error::unless(sigma > 0.0 && sigma.is_finite(), "corner", sigma, "must be above 0 and finite")?;
        target.check().map_err(|e| Error::Graph(e.to_string()))?;
        let corners: Vec<_> = target.panels.iter().map(|panel| panel.pattern.corners()).collect();
        let sparse = corners.iter().map(|all| thinned(all)).collect();
        Ok(Self { camera, mount, target, sigma, corners, sparse })
    }

    /// The same with other panels.
    ///
    /// # Errors
    /// As [`Stage::new`].
    pub fn with_target(&self, target: Target) -> Result<Self, Error> {
        Self::new(self.camera.clone(), self.mount, target, self.sigma)
    }

    /// What the camera sees of a robot at a pose.
    #[must_use]
    pub fn views(&self, robot: &Se2) -> Vec<PanelView> {
        let panels = self.poses(robot).zip(&self.corners);
        panels.filter_map(|((panel, pose), corners)| self.view(panel, corners, pose)).collect()
    }

    /// The same in a hurry, to compare drives: a quarter of the corners, each with the number that it represents.
    pub(super) fn glimpses(&self, robot: &Se2) -> Vec<(PanelView, f64)> {
        let panels = self.poses(robot).zip(&self.sparse);
        let seen = panels.filter_map(|((panel, pose), (corners, share))| {
            let inside = || corners.iter().copied().filter(|p| self.pixel(&pose.act(p)).is_some()).collect::<Vec<_>>();
            let corners = Self::faces(panel, corners, &pose).then(inside)?;
            (corners.len() >= LEAST_TAGS).then_some((PanelView { pose, corners }, *share))
        });
        seen.collect()
    }

    /// Every panel at `T_camera_panel` of a robot at a pose.
    fn poses(&self, robot: &Se2) -> impl Iterator<Item = (&Panel, Se3)> {
        let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), robot.theta());
        let translation = Vector3::new(robot.x(), robot.y(), 0.0);
        let t_camera_robot = self.mount.inverse() * Se3 { rotation: So3 { quaternion: yaw }, translation };
        self.target.panels.iter().map(move |panel| (panel, t_camera_robot * panel.t_robot_panel()))
    }

    /// Whether a panel with these corners is turned towards the camera.
    fn faces(panel: &Panel, corners: &[Vector3<f64>], pose: &Se3) -> bool {
        let middle = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
        let to_camera = -pose.act(&middle);
        (pose.rotation.matrix() * outwards(panel)).dot(&to_camera) >= STEEPEST * to_camera.norm()
    }

    /// What the camera reads of a panel at `T_camera_panel`.
    pub(super) fn view(&self, panel: &Panel, corners: &[Vector3<f64>], pose: Se3) -> Option<PanelView> {
        if !Self::faces(panel, corners, &pose) {
            return None;
        }
        let corners = match panel.pattern {
            Pattern::TagGrid(_) => self.read_tags(corners, &pose),
            _ => corners.iter().copied().filter(|p| self.pixel(&pose.act(p)).is_some()).collect(),
        };
        let least = if matches!(panel.pattern, Pattern::TagGrid(_)) { 4 * LEAST_TAGS } else { LEAST_CORNERS };
        (corners.len() >= least).then_some(PanelView { pose, corners })
    }

    /// The corners of the tags that can be read.
    fn read_tags(&self, corners: &[Vector3<f64>], pose: &Se3) -> Vec<Vector3<f64>> {
        let is_read = |tag: &&[Vector3<f64>]| {
            let pixels: Option<Vec<_>> = tag.iter().map(|p| self.pixel(&pose.act(p))).collect();
            pixels.is_some_and(|q| (0..q.len()).all(|k| (q[k] - q[(k + 1) % q.len()]).norm() >= SHORTEST))
        };
        corners.chunks_exact(4).filter(is_read).flatten().copied().collect()
    }

    /// Where a point is seen, if well inside the image.
    fn pixel(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let shift = Vector2::new(MARGIN, MARGIN);
        let inside = |q: &Vector2<f64>| self.camera.holds(&(q - shift)) && self.camera.holds(&(q + shift));
        self.camera.project(point).filter(inside)
    }
}

/// `T_floor_camera` of a camera at a height [m], pitched down [rad], level across.
///
/// # Errors
/// When it does not look forward.
pub fn mount(height: f64, pitch: f64) -> Result<Se3, Error> {
    Error::unless(pitch.abs() < 1.5, "pitch", pitch, "must be within 1.5 rad of level")?;
    let (s, c) = pitch.sin_cos();
    let rotation = Matrix3::new(0.0, -s, c, -1.0, 0.0, 0.0, 0.0, -c, -s);
    Ok(Se3 { rotation: turned(rotation), translation: Vector3::new(0.0, 0.0, height) })
}

/// A camera of the thesis' kind: 640 by 480 pixels, focal length 600, some barrel distortion.
///
/// # Errors
/// Never; its numbers are good.
pub fn nominal_camera() -> Result<Camera, Error> {
    let parameters = vec![600.0, 600.0, 319.5, 239.5, -0.25, 0.1, 0.0, 0.0];
    Camera::new(640, 480, Lens::Radtan, parameters).map_err(|e| Error::Unreachable(e.to_string()))
}

/// Panels of 6 by 6 tags, 0.6 m wide, upright around the robot at the given yaws [rad], their middles 0.3 m from its
/// centre and 0.8 m high.
#[must_use]
pub fn upright_panels(yaws: &[f64]) -> Target {
    Target { panels: yaws.iter().enumerate().map(|(k, &yaw)| upright(k, yaw)).collect() }
}

/// The direction, in the frame of a panel, out of which it is read.
pub(super) fn outwards(panel: &Panel) -> Vector3<f64> {
    if matches!(panel.pattern, Pattern::TagGrid(_)) { Vector3::z() } else { -Vector3::z() }
}

/// Some corners, all over the panel, and how many each represents: of every four, the first, second, third, fourth in turn.
fn thinned(all: &[Vector3<f64>]) -> (Vec<Vector3<f64>>, f64) {
    if all.len() < 4 * LEAST_THINNED {
        return (all.to_vec(), 1.0);
    }
    let some: Vec<_> = all.chunks(4).enumerate().filter_map(|(k, four)| four.get(k % 4)).copied().collect();
    let share = all.len() as f64 / some.len() as f64;
    (some, share)
}

fn upright(number: usize, yaw: f64) -> Panel {
    let grid = TagGrid {
        family: "tag36h11".into(),
        columns: 6,
        rows: 6,
        size: 0.08,
        spacing: 0.3,
        first_id: 36 * number as u32,
        border: 2,
    };
    let half = 0.3;
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
        Stage::new(nominal_camera().unwrap(), mount(2.0, 0.43).unwrap(), upright_panels(&[0.0]), SIGMA).unwrap()
    }

    #[test]
    fn a_panel_that_faces_the_camera_is_in_the_middle_of_its_image() {
        let views = stage().views(&Se2::new(2.9, 0.0, PI));
        assert_eq!((views.len(), views[0].corners.len()), (1, 144));
        let middle = views[0].pose.act(&Vector3::new(0.3, 0.3, 0.0));
        let pixel = stage().camera.project(&middle).unwrap();
        assert!((pixel - Vector2::new(319.5, 239.5)).norm() < 10.0, "{pixel}");
    }

    #[test]
    fn a_panel_that_is_turned_away_or_out_of_the_image_is_not_seen() {
        assert!(stage().views(&Se2::new(2.9, 0.0, 0.0)).is_empty());
        assert!(stage().views(&Se2::new(2.9, 5.0, PI)).is_empty());
        assert!(stage().views(&Se2::new(-2.9, 0.0, 0.0)).is_empty());
    }

    #[test]
    fn a_camera_below_the_floor_or_upside_down_is_refused() {
        assert!(
            Stage::new(nominal_camera().unwrap(), mount(-1.0, 0.4).unwrap(), upright_panels(&[0.0]), SIGMA).is_err()
        );
        assert!(mount(2.0, 1.6).is_err());
    }
}

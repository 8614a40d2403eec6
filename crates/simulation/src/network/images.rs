//! What each camera sees of the target at a stop, as an image: so that the real detector runs.

use super::{NetworkRecording, NetworkScene, view};
use crate::error::SimulationError;
use crate::render::{Appearance, Drawing, Shown, render};
use groma_geometry::{LieGroup, Se3};

/// The image that a camera takes at a stop; nothing when no tag would be in view.
///
/// # Arguments
/// `drawings`: of each panel, the drawings of its tags. The pose error of views that the fast mode draws
/// ([`super::NetworkNoise::view`]) has no place here.
///
/// # Errors
/// [`SimulationError`] when there is no such stop or camera, or a panel cannot be drawn.
pub fn image(
    scene: &NetworkScene,
    recording: &NetworkRecording,
    place: (usize, usize),
    drawings: &[Vec<Drawing>],
    appearance: &Appearance,
) -> Result<Option<Vec<u8>>, SimulationError> {
    let (stop, camera) = place;
    let missing = || SimulationError::Scene(format!("there is no stop {stop} or no camera {camera}"));
    let (at, lens) =
        (recording.stops.get(stop).ok_or_else(missing)?, recording.lenses.get(camera).ok_or_else(missing)?);
    let t_c_b = view::camera_at(scene, camera, stop).between(&(at.pose * recording.mount));
    let poses: Vec<Se3> = scene.target.panels.iter().map(|panel| t_c_b * panel.t_robot_panel()).collect();
    let in_view =
        scene.target.panels.iter().zip(&poses).any(|(panel, pose)| !view::corners(lens, pose, panel).is_empty());
    if !in_view {
        return Ok(None);
    }
    let none: Vec<Drawing> = vec![];
    let shown: Vec<Shown<'_>> = scene
        .target
        .panels
        .iter()
        .zip(poses)
        .enumerate()
        .map(|(k, (panel, t_camera_panel))| Shown {
            pattern: &panel.pattern,
            drawings: drawings.get(k).unwrap_or(&none),
            t_camera_panel,
        })
        .collect();
    let seed = scene.seed ^ ((stop as u64) << 32) ^ ((camera as u64 + 1) << 16);
    render(lens, &shown, appearance, seed).map(Some)
}

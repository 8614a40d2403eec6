//! What each camera sees of the target at a stop: corners with noise, without making an image.
//!
//! A tag is seen when its panel faces the camera (within 75 degrees), all of its corners lie in the image, a margin away
//! from its edge, and its sides are long enough to be read. Corners of boards are taken one by one.

use super::{NetworkScene, Stop};
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Panel, Pattern};
use nalgebra::{Vector2, Vector3, Vector6};

/// From the edge of the image [pixel].
const MARGIN: f64 = 5.0;
/// Shortest side of a tag [pixel].
const SMALLEST: f64 = 8.0;
/// Most that a panel may look away from the camera: cosine of 75 degrees.
const SLANTED: f64 = 0.2588;
/// A panel with fewer corners is not seen.
const FEWEST: usize = 8;

/// Corners of one panel in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenPanel {
    /// Number of the stop.
    pub stop: usize,
    /// Time of the exposure [s].
    pub stamp: f64,
    /// Number of the camera.
    pub camera: usize,
    /// Number of the panel.
    pub panel: usize,
    /// Numbers of the corners, rising.
    pub ids: Vec<u32>,
    /// Where they are [pixel].
    pub pixels: Vec<Vector2<f64>>,
}

/// What the scene does not tell: the errors that were drawn.
pub(super) struct Truth<'a> {
    pub lenses: &'a [Camera],
    pub mount: Se3,
}

/// True `T_W_C` of a camera at a stop.
pub fn camera_at(scene: &NetworkScene, camera: usize, stop: usize) -> Se3 {
    let placed = &scene.cameras[camera];
    let bumped = scene.bump.as_ref().filter(|bump| bump.camera == placed.name && stop >= bump.stop);
    bumped.map_or(placed.t_w_c(), |bump| placed.t_w_c() * Se3::exp(&Vector6::from(bump.motion)))
}

pub(super) fn all(scene: &NetworkScene, stops: &[Stop], truth: &Truth<'_>) -> Vec<SeenPanel> {
    let mut random = Random::new(scene.seed, Purpose::Corners);
    let mut seen = vec![];
    for (number, stop) in stops.iter().enumerate() {
        for camera in 0..scene.cameras.len() {
            let [metres, radians] = scene.noise.view;
            let off = Se3::exp(&Vector6::from_fn(|k, _| if k < 3 { metres } else { radians } * random.normal()));
            let t_c_b = camera_at(scene, camera, number).between(&(stop.pose * truth.mount)) * off;
            for frame in 0..scene.frames.max(1) {
                let share = (frame as f64 + 0.5) / scene.frames.max(1) as f64;
                let stamp = stop.from + share * (stop.to - stop.from);
                for (panel, shown) in scene.target.panels.iter().enumerate() {
                    let found = corners(&truth.lenses[camera], &(t_c_b * shown.t_robot_panel()), shown);
                    let (ids, pixels) = noisy(found, scene.noise.corner, &mut random);
                    if ids.len() >= FEWEST {
                        seen.push(SeenPanel { stop: number, stamp, camera, panel, ids, pixels });
                    }
                }
            }
        }
    }
    seen
}

fn noisy(found: Vec<(u32, Vector2<f64>)>, sigma: f64, random: &mut Random) -> (Vec<u32>, Vec<Vector2<f64>>) {
    let shake = |p: Vector2<f64>, random: &mut Random| p + sigma * Vector2::new(random.normal(), random.normal());
    found.into_iter().map(|(id, pixel)| (id, shake(pixel, random))).unzip()
}

/// The corners of a panel that a camera sees, without noise.
pub fn corners(camera: &Camera, t_c_p: &Se3, panel: &Panel) -> Vec<(u32, Vector2<f64>)> {
    if !faces(t_c_p, panel) {
        return vec![];
    }
    let ids: Vec<u32> = (0..panel.pattern.corner_count()).collect();
    let group = if matches!(panel.pattern, Pattern::TagGrid(_)) { 4 } else { 1 };
    let pixel = |id: u32| {
        let corner = panel.pattern.corner(id)?;
        camera.project(&t_c_p.act(&corner)).filter(|p| inside(camera, p)).map(|p| (id, p))
    };
    let whole = |ids: &[u32]| ids.iter().map(|&id| pixel(id)).collect::<Option<Vec<_>>>().filter(|g| large(g));
    ids.chunks(group).filter_map(whole).flatten().collect()
}

/// Whether the printed side looks at the camera. A tag grid's z comes out of it, a board's goes into it.
fn faces(t_c_p: &Se3, panel: &Panel) -> bool {
    let corners = panel.pattern.corners();
    let middle = corners.iter().sum::<Vector3<f64>>() / corners.len().max(1) as f64;
    let out = if matches!(panel.pattern, Pattern::TagGrid(_)) { 1.0 } else { -1.0 };
    let (normal, towards) = (t_c_p.rotation.act(&Vector3::z()) * out, -t_c_p.act(&middle));
    normal.dot(&towards) > SLANTED * towards.norm()
}

fn inside(camera: &Camera, p: &Vector2<f64>) -> bool {
    let within = |x: f64, size: u32| x >= MARGIN && x <= f64::from(size) - 1.0 - MARGIN;
    within(p.x, camera.width()) && within(p.y, camera.height())
}

fn large(group: &[(u32, Vector2<f64>)]) -> bool {
    group.len() < 4 || (0..4).all(|k| (group[k].1 - group[(k + 1) % 4].1).norm() >= SMALLEST)
}

//! Images of panels: what a camera with a lens, blur and noise makes of them, so that a real detector can run.
//!
//! Every pixel is the mean of what its square sees of the panel's plane: the corners of the square are unprojected and
//! met with the plane, what lies between is bilinear; a square that sees more than one shade is sampled 16 x 16 times on
//! a skewed lattice (an edge is placed to about 1/200 pixel). The image is then blurred by a Gaussian, and normal noise is
//! added before rounding. Nearer panels hide farther ones; the light is the same everywhere.
//!
//! Behind stands a wall with slow waves of grey, so that the threshold of a detector has something to do. No motion blur,
//! no rolling shutter, no vignetting.

mod blur;
mod texture;

pub use texture::Drawing;

use crate::error::SimulationError;
use blur::blurred;
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Pattern};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use texture::Texture;

/// Samples along a pixel that sees more than one shade.
const FINE: u32 = 16;
/// Samples along a pixel that tell whether it does.
const COARSE: u32 = 4;
/// Grey of the wall behind and the height of its waves.
const WALL: (f32, f32) = (120.0, 25.0);

/// How an image looks.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields, default)]
pub struct Appearance {
    /// Grey of white paper.
    pub white: f64,
    /// Grey of black print.
    pub black: f64,
    /// Standard deviation of the blur [pixel].
    pub blur: f64,
    /// Standard deviation of the noise [grey].
    pub noise: f64,
}

impl Default for Appearance {
    fn default() -> Self {
        Self { white: 210.0, black: 35.0, blur: 0.7, noise: 3.0 }
    }
}

/// A panel before the camera.
#[derive(Clone, Debug)]
pub struct Shown<'a> {
    /// What is printed on it.
    pub pattern: &'a Pattern,
    /// The drawings of its tags, in the order of the grid.
    pub drawings: &'a [Drawing],
    /// `T_camera_panel`.
    pub t_camera_panel: Se3,
}

/// The image, rows from the top, 8 bits a pixel.
///
/// # Errors
/// [`SimulationError`] when a setting makes no sense or a pattern has no drawing.
pub fn render(
    camera: &Camera,
    shown: &[Shown<'_>],
    appearance: &Appearance,
    seed: u64,
) -> Result<Vec<u8>, SimulationError> {
    check(appearance)?;
    let (width, height) = (camera.width() as usize, camera.height() as usize);
    let mut image = wall(width, height);
    let mut panels: Vec<&Shown<'_>> = shown.iter().collect();
    panels.sort_by(|a, b| b.t_camera_panel.translation.norm().total_cmp(&a.t_camera_panel.translation.norm()));
    for panel in panels {
        let texture = Texture::new(panel.pattern, panel.drawings)?;
        paint(&mut image, camera, &panel.t_camera_panel, &texture, appearance);
    }
    let mut random = Random::new(seed, Purpose::Pixels);
    let noisy = |v: f32| (f64::from(v) + appearance.noise * random.normal()).round().clamp(0.0, 255.0) as u8;
    Ok(blurred(&image, width, appearance.blur).into_iter().map(noisy).collect())
}

fn check(appearance: &Appearance) -> Result<(), SimulationError> {
    let rules = [("blur", appearance.blur, 20.0), ("noise", appearance.noise, 255.0)];
    for (name, value, most) in rules {
        if !(0.0..=most).contains(&value) {
            return Err(SimulationError::Setting { name, value, rule: "must be 0 or more, and not absurd" });
        }
    }
    Ok(())
}

fn wall(width: usize, height: usize) -> Vec<f32> {
    let wave = |k: usize| {
        let (x, y) = ((k % width) as f32, (k / width) as f32);
        WALL.0 + WALL.1 * (0.021 * x + 0.4).sin() * (0.017 * y + 0.9).cos()
    };
    (0..width * height).map(wave).collect()
}

/// Paints a panel over an image.
fn paint(image: &mut [f32], camera: &Camera, pose: &Se3, texture: &Texture<'_>, appearance: &Appearance) {
    let Some([left, top, right, bottom]) = extent(camera, pose, texture) else { return };
    let width = camera.width() as usize;
    let lattice = |y: usize| -> Vec<Option<Vector2<f64>>> {
        (left..=right + 1).map(|x| on_panel(camera, pose, texture, x as f64 - 0.5, y as f64 - 0.5)).collect()
    };
    let mut above = lattice(top);
    for y in top..=bottom {
        let below = lattice(y + 1);
        for x in left..=right {
            let k = x - left;
            let corners = [above[k], above[k + 1], below[k], below[k + 1]];
            if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                let (share, white) = seen(texture, &[a, b, c, d]);
                let paper = appearance.black + white * (appearance.white - appearance.black);
                let pixel = &mut image[y * width + x];
                *pixel += share as f32 * (paper as f32 - *pixel);
            }
        }
        above = below;
    }
}

/// The pixels that the panel may touch: left, top, right, bottom; nothing when it is out of view.
fn extent(camera: &Camera, pose: &Se3, texture: &Texture<'_>) -> Option<[usize; 4]> {
    let outline: Vec<_> = texture.outline().iter().filter_map(|p| camera.project(&pose.act(&p.push(0.0)))).collect();
    let (low, high) = outline.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.x), h.max(p.x)));
    let (up, down) = outline.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p.y), h.max(p.y)));
    let (columns, rows) = (f64::from(camera.width()), f64::from(camera.height()));
    if outline.is_empty() || high < -1.0 || low > columns || down < -1.0 || up > rows {
        return None;
    }
    let within = |v: f64, size: f64| v.clamp(0.0, size - 1.0) as usize;
    Some([within(low - 3.0, columns), within(up - 3.0, rows), within(high + 3.0, columns), within(down + 3.0, rows)])
}

/// Where the ray of a pixel meets the printed side of the panel [m].
fn on_panel(camera: &Camera, pose: &Se3, texture: &Texture<'_>, u: f64, v: f64) -> Option<Vector2<f64>> {
    let towards = camera.unproject(&Vector2::new(u, v))?;
    let (direction, eye) = (pose.rotation.inverse().act(&towards), pose.inverse().translation);
    let distance = -eye.z / direction.z;
    let front = eye.z * texture.out() > 0.0;
    (front && distance > 0.0 && distance.is_finite()).then(|| (eye + direction * distance).xy())
}

/// Share of a pixel that the panel covers, and how white that is, from where its corners meet the panel.
fn seen(texture: &Texture<'_>, corners: &[Vector2<f64>; 4]) -> (f64, f64) {
    let coarse = sampled(texture, corners, COARSE);
    let flat = (coarse.0 == 0.0 || coarse.0 == 1.0) && (coarse.1 == 0.0 || coarse.1 == 1.0);
    if flat { coarse } else { sampled(texture, corners, FINE) }
}

fn sampled(texture: &Texture<'_>, [a, b, c, d]: &[Vector2<f64>; 4], along: u32) -> (f64, f64) {
    let (mut on, mut white, n) = (0.0, 0.0, f64::from(along));
    for i in 0..along {
        for j in 0..along {
            let (x, y) = (f64::from(i) + (f64::from(j) + 0.5) / n, f64::from(j) + (f64::from(i) + 0.5) / n);
            let (x, y) = (x / n, y / n);
            let at = (a * (1.0 - x) + b * x) * (1.0 - y) + (c * (1.0 - x) + d * x) * y;
            if let Some(shade) = texture.is_white(&at) {
                on += 1.0;
                white += f64::from(u8::from(shade));
            }
        }
    }
    (on / (n * n), if on > 0.0 { white / on } else { 0.0 })
}

//! Corners of the target as one camera sees them at one stop, averaged over its images.
//!
//! Standing still, a detector repeats part of its error in every image: where the corner falls within its pixel, how the
//! light lies. So n images are one measurement, with
//!
//! ```text
//! sigma_mean^2 = sigma^2 (rho + (1 - rho)/n)
//! ```

use groma_models::Target;
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;

/// rho: share of a corner's variance that all images of a stop have in common.
const SHARED: f64 = 0.25;

/// A corner of the target in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Number of its panel.
    pub panel: usize,
    /// Where it is on its panel, in the plane z = 0 [m].
    pub on_panel: Vector3<f64>,
    /// Where it is on the target body B, as the target file has it [m].
    pub point: Vector3<f64>,
    /// Where it is seen [pixel].
    pub pixel: Vector2<f64>,
    /// Standard deviation of a coordinate [pixel].
    pub sigma: f64,
}

/// One panel in one image: number of the panel, then number, pixel and standard deviation of each corner.
pub type Panel<'a> = (usize, &'a [u32], &'a [Vector2<f64>], &'a [f64]);

/// The mean of each corner over the images of a stop, by panel and number. Corners that the target does not have are
/// counted, not used.
#[must_use]
pub fn average<'a>(target: &Target, seen: impl IntoIterator<Item = Panel<'a>>) -> (Vec<Corner>, usize) {
    let mut sums: BTreeMap<(usize, u32), (Vector2<f64>, f64, f64)> = BTreeMap::new();
    for (panel, ids, pixels, sigmas) in seen {
        for ((&id, pixel), sigma) in ids.iter().zip(pixels).zip(sigmas) {
            let sum = sums.entry((panel, id)).or_insert((Vector2::zeros(), 0.0, 0.0));
            *sum = (sum.0 + pixel, sum.1 + sigma * sigma, sum.2 + 1.0);
        }
    }
    let count = sums.len();
    let corner = |(&(panel, id), &(pixel, variance, n)): (&(usize, u32), &(Vector2<f64>, f64, f64))| {
        let shown = target.panels.get(panel)?;
        let on_panel = shown.pattern.corner(id)?;
        let sigma = (variance / n * (SHARED + (1.0 - SHARED) / n)).sqrt();
        let point = groma_geometry::LieGroup::act(&shown.t_robot_panel(), &on_panel);
        Some(Corner { panel, on_panel, point, pixel: pixel / n, sigma })
    };
    let corners: Vec<Corner> = sums.iter().filter_map(corner).collect();
    let unknown = count - corners.len();
    (corners, unknown)
}

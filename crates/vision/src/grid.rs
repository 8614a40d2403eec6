//! The corners of a grid of tags in an image, and what was left out and why.
//!
//! A tag counts when it belongs to the grid, is seen once, its code is legible ([`Options::least_margin`]), its shortest
//! edge is long enough and its corners keep away from the border of the image. Each corner is then fitted
//! ([`mod@crate::corner`]) in a disc that keeps clear of the bits inside the border and of the tags beside. For lone squares
//! (a border of one module) the crossing of the lines that the detector fits along whole edges is more accurate than a disc,
//! and the two are joined by their weights; where they disagree, the lens bends the lines, and the disc decides. In
//! Kalibr's grids other squares touch the corners and the lines may go astray: there the disc alone counts, and a corner
//! that cannot be fitted is left out. Tags that the detector missed are looked for where the others say
//! (`complete.rs`).

use crate::apriltag::{Family, Tag};
use crate::complete::complete;
use crate::corner::{Corner, Guess, refine};
use crate::error::VisionError;
use crate::image::Gray;
use groma_estimation::robust;
use groma_models::target::TagGrid;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Standard deviation of the crossing of the detector's lines along the edges of a lone square [pixel].
const LINES_SIGMA: f64 = 0.04;
/// The same where nothing stands beside it to tell that the lines are right [pixel].
const UNREFINED_SIGMA: f64 = 0.1;
/// Squared distance, in units of its variance, from which lines and fit disagree.
const DISAGREE_SQ: f64 = 16.0;

/// Which tags count.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Options {
    /// Least mean distance of the bits from the threshold [grey].
    pub least_margin: f64,
    /// Shortest edge [pixel].
    pub least_side: f64,
    /// Least distance of a corner to the border of the image [pixel].
    pub border: f64,
    /// Largest spread of the edges: a panel whose median lies above is blurred and left out [pixel].
    pub most_blur: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { least_margin: 10.0, least_side: 8.0, border: 2.0, most_blur: 2.5 }
    }
}

/// A corner of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridCorner {
    /// Its number.
    pub id: u32,
    /// The place [pixel].
    pub pixel: Vector2<f64>,
    /// Standard deviation of a coordinate [pixel].
    pub sigma: f64,
}

/// What was found of a grid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// By number.
    pub corners: Vec<GridCorner>,
    /// Median spread of the edges [pixel]; zero when no corner could be fitted.
    pub blur: f64,
    /// Tags left out: seen more than once.
    pub repeated: usize,
    /// Tags left out: hardly legible.
    pub illegible: usize,
    /// Tags left out: too small.
    pub small: usize,
    /// Tags left out: at the border of the image.
    pub at_border: usize,
    /// Tags left out: the panel is blurred.
    pub blurred: usize,
    /// Corners that could not be fitted.
    pub unrefined: usize,
}

/// The corners of a grid, given all tags of its family in the image.
///
/// # Errors
/// [`VisionError`] when there is no such family or border.
pub fn find_grid(image: &Gray<'_>, tags: &[Tag], grid: &TagGrid, options: &Options) -> Result<Found, VisionError> {
    let modules = Family::named(&grid.family)?.modules(grid.border)?;
    let room = free_share(grid, modules);
    let mut tags = tags.to_vec();
    complete(image, &mut tags, grid, room)?;
    let mut found = Found::default();
    let mut blurs = vec![];
    for (place, tag) in chosen(image, &tags, grid, options, &mut found) {
        for j in 0..4 {
            let corner = refine(image, &Guess::of_tag(tag, j, room));
            found.unrefined += usize::from(corner.is_none());
            blurs.extend(corner.map(|c| c.blur));
            let (id, detected) = (4 * place + j as u32, tag.seen[j].then_some(tag.corners[j]));
            let best = if grid.border > 1 { corner.map(alone) } else { joined(detected, corner) };
            found.corners.extend(best.map(|(pixel, sigma)| GridCorner { id, pixel, sigma }));
        }
    }
    found.corners.sort_by_key(|corner| corner.id);
    found.blur = robust::median(&mut blurs).unwrap_or(0.0);
    if found.blur > options.most_blur {
        found.blurred = found.corners.len() / 4;
        found.corners.clear();
    }
    Ok(found)
}

/// Free room around a corner as a share of the tag's edge: up to the first bit inside, up to what is printed beside it.
fn free_share(grid: &TagGrid, modules: u32) -> f64 {
    let inside = f64::from(grid.border) / f64::from(modules);
    if grid.spacing > 0.0 { inside.min(grid.spacing) } else { inside }
}

/// The tags that count, with their place in the grid; the others are counted.
fn chosen<'a>(
    image: &Gray<'_>,
    tags: &'a [Tag],
    grid: &TagGrid,
    options: &Options,
    found: &mut Found,
) -> Vec<(u32, &'a Tag)> {
    let mut kept = vec![];
    for tag in tags {
        let Some(place) = tag.id.checked_sub(grid.first_id).filter(|&k| k < grid.tags()) else { continue };
        let alone = tags.iter().filter(|other| other.id == tag.id).count() == 1;
        let inset = tag.corners.iter().map(|c| image.inset(c.x, c.y)).fold(f64::INFINITY, f64::min);
        let fault = match () {
            () if !alone => &mut found.repeated,
            () if tag.margin < options.least_margin => &mut found.illegible,
            () if shortest_edge(tag) < options.least_side => &mut found.small,
            () if inset < options.border => &mut found.at_border,
            () => {
                kept.push((place, tag));
                continue;
            }
        };
        *fault += 1;
    }
    kept
}

fn shortest_edge(tag: &Tag) -> f64 {
    (0..4).map(|j| (tag.corners[(j + 1) % 4] - tag.corners[j]).norm()).fold(f64::INFINITY, f64::min)
}

fn alone(corner: Corner) -> (Vector2<f64>, f64) {
    (corner.pixel, corner.sigma)
}

/// The crossing of the detector's lines and the fitted corner, by their weights; the fitted one where they disagree.
fn joined(detected: Option<Vector2<f64>>, corner: Option<Corner>) -> Option<(Vector2<f64>, f64)> {
    let (Some(lines), Some(corner)) = (detected, corner) else {
        return corner.map(alone).or(detected.map(|lines| (lines, UNREFINED_SIGMA)));
    };
    let (a, b) = (LINES_SIGMA * LINES_SIGMA, corner.sigma * corner.sigma);
    if (lines - corner.pixel).norm_squared() > DISAGREE_SQ * (a + b) {
        return Some(alone(corner));
    }
    Some(((lines * b + corner.pixel * a) / (a + b), (a * b / (a + b)).sqrt()))
}

//! An occupancy grid of all keyframes, each at its pose in the map.
//!
//! ```text
//! hits(c)    readings that end in cell c
//! passes(c)  readings that went through c
//! occupied   (hits + a) / (hits + passes + a + b) >= OCCUPIED,  with a Beta prior (a, b),  and
//!            hits >= OVERSHADOWED * the most hits among the eight cells around
//! free       else, if passes > 0;   unknown otherwise
//! ```
//!
//! **What a reading counts for.** A reading within `CAP` hits the cell where it ends. One beyond it hits nothing: a
//! heading error of 0.3 degrees moves it by decimetres, and a wall drawn of such readings is doubled or smeared. Every
//! reading marks the way to it as passed, up to `CAP`. It stops where it comes as close as a cell to the surface that it is
//! about to hit: `resolution / sin(alpha)` before the hit, with `alpha` the angle between beam and surface as the neighbour
//! beams tell it. Otherwise beams along a corridor would wash out its walls. A beam without return marks nothing. Beams
//! are cast from where the laser was when they were fired.
//!
//! **Why two conditions.** The first erases what moved: where a person stood, other scans look through. The second
//! keeps walls thin: behind a wall nothing passes, and the tail of the range noise would make it three or four cells
//! thick. What is seen once and never seen through stays.
//!
//! **Extent.** The box of all hits and laser positions, with a margin, its origin a multiple of the resolution. A grid
//! that would exceed `MOST_CELLS` is made with twice the cell, as often as it takes: see [`Grid::resolution`]. Coordinates
//! are finite and below `FARTHEST`, so it takes few times; what is not, is left out.
//!
//! The line of cells that a beam passes holds one cell a column (a row, for steep beams), the one at its middle.
//! Counters stop at 65535. Poses are taken as exact; a keyframe whose pose is not finite, or lies beyond all reason
//! (`FARTHEST`), is left out.

use crate::keyframe::Keyframe;
use groma_geometry::Se2;
use groma_models::{Cancelled, Cell, Grid, Token};
use groma_registration::PolarView;
use nalgebra::Vector2;

/// Readings are traced and believed up to this range [m].
const CAP: f64 = 30.0;
/// No reading stops farther than this before its hit [m].
const FARTHEST_STOP: f64 = 1.0;
/// The Beta prior `(a, b)` of a cell: the prior weight of one reading of a mostly empty world.
const PRIOR: (f64, f64) = (0.2, 0.8);
/// Expected occupancy from which a cell is occupied.
const OCCUPIED: f64 = 0.3;
/// Share of the hits of the busiest neighbour that an occupied cell has at least.
const OVERSHADOWED: f64 = 0.25;
/// Cells of a grid, at most.
const MOST_CELLS: f64 = 40e6;
/// Coordinates from which a pose is taken for an error [m].
const FARTHEST: f64 = 1e9;
/// Empty cells around everything.
const MARGIN: f64 = 4.0;
/// Binary digits after the point of the coordinates that are counted up along a beam.
const FRACTION: u32 = 32;

/// The grid of `keyframes` at `poses` (map from vehicle, one a keyframe) with cells of `resolution` [m], or of a
/// power of two times that where the map is too large. Nothing seen, or a resolution that is no positive number,
/// gives a grid without cells.
///
/// # Errors
/// When `token` is cancelled.
pub fn occupancy(keyframes: &[Keyframe], poses: &[Se2], resolution: f64, token: &Token) -> Result<Grid, Cancelled> {
    let nothing = Grid { resolution, origin: Vector2::zeros(), width: 0, height: 0, cells: Vec::new() };
    if !(resolution.is_finite() && resolution > 0.0) {
        return Ok(nothing);
    }
    let placed = || keyframes.iter().map(|k| &*k.tracked.view).zip(poses).filter(|(_, pose)| is_usable(pose));
    let mut corners = None;
    for (view, pose) in placed() {
        token.check()?;
        rays(view, pose, resolution).for_each(|ray| widen(&mut corners, &ray));
    }
    let Some(mut counts) = corners.map(|(low, high)| Counts::new(low, high, resolution)) else { return Ok(nothing) };
    for (view, pose) in placed() {
        token.check()?;
        rays(view, pose, counts.resolution).for_each(|ray| counts.add(&ray));
    }
    Ok(counts.into_grid())
}

fn is_usable(pose: &Se2) -> bool {
    pose.to_vector().iter().all(|x| x.abs() < FARTHEST)
}

/// A reading in the map frame [m].
struct Ray {
    /// The laser.
    from: Vector2<f64>,
    /// Up to here the beam surely met nothing.
    clear: Vector2<f64>,
    /// Where it ended, if near enough to be used.
    hit: Option<Vector2<f64>>,
}

/// The readings of a view at `pose`, for cells of the size `cell`.
fn rays<'a>(view: &'a PolarView, pose: &'a Se2, cell: f64) -> impl Iterator<Item = Ray> + 'a {
    let (ranges, geometry) = view.ranges();
    let beams = ranges.iter().enumerate().zip(view.beams_at(pose));
    beams.filter(|((_, r), _)| r.is_finite()).filter_map(move |((i, &r), (from, direction))| {
        let range = f64::from(r);
        let before = cell / sine_of_incidence(ranges, i, geometry.angle_increment);
        let clear = (range - before.min(FARTHEST_STOP.max(cell))).clamp(0.0, CAP);
        let near = |p: Vector2<f64>| p.iter().all(|x| x.abs() < FARTHEST);
        let ray = Ray { from, clear: from + direction * clear, hit: (range <= CAP).then(|| from + direction * range) };
        (near(ray.from) && near(ray.clear)).then_some(ray)
    })
}

/// Sine of the angle between beam `i` and the surface that it hits, by the neighbour that is nearer to it in range;
/// 1 without neighbours.
fn sine_of_incidence(ranges: &[f32], i: usize, step: f64) -> f64 {
    let at = |k: usize| ranges.get(k).map_or(f64::NAN, |r| f64::from(*r));
    let range = at(i);
    let along = (at(i.wrapping_sub(1)) - range).abs().min((at(i + 1) - range).abs());
    let across = range * step.abs();
    if along.is_nan() || across <= 0.0 { 1.0 } else { across / (across * across + along * along).sqrt() }
}

/// Widens the box, given by its lower-left and upper-right corner, by all that a ray touches.
fn widen(corners: &mut Option<(Vector2<f64>, Vector2<f64>)>, ray: &Ray) {
    for p in [Some(ray.from), Some(ray.clear), ray.hit].into_iter().flatten() {
        let (low, high) = corners.unwrap_or((p, p));
        *corners = Some((low.inf(&p), high.sup(&p)));
    }
}

/// Hits and passes of every cell.
struct Counts {
    resolution: f64,
    origin: Vector2<f64>,
    width: usize,
    height: usize,
    hits: Vec<u16>,
    passes: Vec<u16>,
}

impl Counts {
    /// Zeros for the box from `low` to `high` (finite) and its margin, in cells of `resolution` (above 0) or more.
    fn new(low: Vector2<f64>, high: Vector2<f64>, mut resolution: f64) -> Self {
        let (first, size) = loop {
            let first = low.map(|x| (x / resolution).floor() - MARGIN);
            let size = high.map(|x| (x / resolution).floor() + MARGIN + 1.0) - first;
            // Both ends are finite, so a cell of their size is reached, and is large enough.
            if size.x * size.y <= MOST_CELLS {
                break (first, size);
            }
            resolution *= 2.0;
        };
        let (width, height) = (size.x as usize, size.y as usize);
        let zeros = || vec![0; width * height];
        Self { resolution, origin: first * resolution, width, height, hits: zeros(), passes: zeros() }
    }

    /// A point in cells from the lower-left corner.
    fn in_cells(&self, p: Vector2<f64>) -> Vector2<f64> {
        (p - self.origin) / self.resolution
    }

    fn add(&mut self, ray: &Ray) {
        self.pass(self.in_cells(ray.from), self.in_cells(ray.clear));
        if let Some(hit) = ray.hit.map(|p| self.in_cells(p)) {
            let count = &mut self.hits[hit.y as usize * self.width + hit.x as usize];
            *count = count.saturating_add(1);
        }
    }

    /// Counts the cells from `a` to `b`, both in cells, as passed.
    fn pass(&mut self, a: Vector2<f64>, b: Vector2<f64>) {
        let d = b - a;
        if d.x.abs() >= d.y.abs() {
            self.pass_along((a.x, b.x), (a.y, d.y), (1, self.width));
        } else {
            self.pass_along((a.y, b.y), (a.x, d.x), (self.width, 1));
        }
    }

    /// One cell for each step of the coordinate that changes more: `major` is where it starts and ends, `minor` where
    /// the other starts and by how much it changes, `strides` what a step of each is in the arrays.
    fn pass_along(&mut self, major: (f64, f64), minor: (f64, f64), strides: (usize, usize)) {
        let length = major.1 - major.0;
        let slope = if length == 0.0 { 0.0 } else { minor.1 / length };
        let (first, last) = (major.0.min(major.1) as usize, major.0.max(major.1) as usize);
        let one = (1_u64 << FRACTION) as f64;
        let mut other = ((minor.0 + slope * (first as f64 + 0.5 - major.0)) * one) as i64;
        let step = (slope * one) as i64;
        for k in first..=last {
            let count = &mut self.passes[k * strides.0 + (other >> FRACTION) as usize * strides.1];
            *count = count.saturating_add(1);
            other += step;
        }
    }

    fn into_grid(self) -> Grid {
        let cells = (0..self.hits.len()).map(|i| self.state(i)).collect();
        Grid { resolution: self.resolution, origin: self.origin, width: self.width, height: self.height, cells }
    }

    fn state(&self, i: usize) -> Cell {
        if self.hits[i] > 0 && self.expected(i) >= OCCUPIED && !self.is_overshadowed(i) {
            Cell::Occupied
        } else if self.passes[i] > 0 {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }

    /// Posterior mean of the occupancy.
    fn expected(&self, i: usize) -> f64 {
        let (hits, passes) = (f64::from(self.hits[i]), f64::from(self.passes[i]));
        (hits + PRIOR.0) / (hits + passes + PRIOR.0 + PRIOR.1)
    }

    /// Whether a neighbour has many times the hits. Hits keep clear of the edge by the margin.
    fn is_overshadowed(&self, i: usize) -> bool {
        let rows = [i - self.width, i, i + self.width];
        let most = rows.iter().flat_map(|row| &self.hits[row - 1..=row + 1]).max();
        most.is_some_and(|most| f64::from(self.hits[i]) < OVERSHADOWED * f64::from(*most))
    }
}

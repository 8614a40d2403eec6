//! Ray casting and clearance over the uniform grid.
//!
//! The cells of a beam are visited in order (J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing",
//! Eurographics 1987); the first surface met within the cell just visited is the answer, so the cost depends on how far
//! the beam travels and not on the size of the world.

use super::cells::Cells;
use super::{Surface, World};
use nalgebra::Vector2;

/// Edge of a cell [m]: near the spacing of surfaces in buildings.
const CELL: f64 = 1.0;

/// Where a beam ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the start of the beam [m].
    pub range: f64,
    /// Cosine of the angle between beam and surface normal, 0..1.
    pub cos_incidence: f64,
    /// Reflectivity of the surface.
    pub reflectivity: f64,
}

/// A world ready to be looked at.
#[derive(Clone, Debug)]
pub struct RayCaster {
    surfaces: Vec<Surface>,
    cells: Cells,
}

/// The walk of a beam over the cells: present cell, step and, per axis, the distance at which the next border is.
struct Walk {
    cell: [isize; 2],
    step: [isize; 2],
    next: [f64; 2],
    pitch: [f64; 2],
}

impl RayCaster {
    /// Prepares `world`.
    #[must_use]
    pub fn new(world: &World) -> Self {
        Self { surfaces: world.surfaces.clone(), cells: Cells::new(world, CELL) }
    }

    /// The first surface met from `origin` along the unit vector `direction` within `reach` [m].
    #[must_use]
    pub fn cast(&self, origin: Vector2<f64>, direction: Vector2<f64>, reach: f64) -> Option<Hit> {
        let (enter, leave) = self.clip(origin, direction, reach)?;
        let mut walk = self.walk(origin, direction, enter);
        let mut best: Option<Hit> = None;
        loop {
            let (i, j) = (walk.cell[0] as usize, walk.cell[1] as usize);
            self.nearest_in(i, j, origin, direction, &mut best);
            let border = walk.next[0].min(walk.next[1]);
            if best.is_some_and(|hit| hit.range <= border) || border > leave || !walk.advance(self.cells.shape) {
                return best.filter(|hit| hit.range <= reach);
            }
        }
    }

    /// Whether any surface lies within `radius` [m] of `p`.
    #[must_use]
    pub fn touches(&self, p: Vector2<f64>, radius: f64) -> bool {
        let [columns, rows] = self.cells.range(p.add_scalar(-radius), p.add_scalar(radius));
        rows.into_iter().any(|j| {
            columns
                .clone()
                .any(|i| self.cells.at(i, j).iter().any(|&s| self.surfaces[s as usize].shape.distance(p) < radius))
        })
    }

    fn nearest_in(&self, i: usize, j: usize, o: Vector2<f64>, d: Vector2<f64>, best: &mut Option<Hit>) {
        for &s in self.cells.at(i, j) {
            let Surface { shape, reflectivity } = self.surfaces[s as usize];
            if let Some((range, cos_incidence)) = shape.meet(o, d)
                && best.is_none_or(|hit| range < hit.range)
            {
                *best = Some(Hit { range, cos_incidence, reflectivity });
            }
        }
    }

    /// Distances at which the beam enters and leaves the grid; `None` when it misses it.
    fn clip(&self, o: Vector2<f64>, d: Vector2<f64>, reach: f64) -> Option<(f64, f64)> {
        let (mut enter, mut leave) = (0.0_f64, reach);
        for k in 0..2 {
            let low = self.cells.origin[k];
            let high = low + self.cells.size * self.cells.shape[k] as f64;
            if d[k] == 0.0 && (o[k] < low || o[k] > high) {
                return None;
            }
            if d[k] != 0.0 {
                let (a, b) = ((low - o[k]) / d[k], (high - o[k]) / d[k]);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        (enter <= leave).then_some((enter, leave))
    }

    fn walk(&self, o: Vector2<f64>, d: Vector2<f64>, enter: f64) -> Walk {
        let Cells { origin, size, shape, .. } = &self.cells;
        let start = (o + d * enter - origin) / *size;
        let cell = [0, 1].map(|k| (start[k].floor() as isize).clamp(0, shape[k] as isize - 1));
        let step = [0, 1].map(|k| if d[k] < 0.0 { -1 } else { 1 });
        let next = [0, 1].map(|k| {
            let border = origin[k] + (cell[k] + isize::from(step[k] > 0)) as f64 * size;
            if d[k] == 0.0 { f64::INFINITY } else { (border - o[k]) / d[k] }
        });
        Walk { cell, step, next, pitch: [0, 1].map(|k| (size / d[k]).abs()) }
    }
}

impl Walk {
    /// Goes to the next cell; false when that is outside.
    fn advance(&mut self, shape: [usize; 2]) -> bool {
        let k = usize::from(self.next[1] < self.next[0]);
        self.cell[k] += self.step[k];
        self.next[k] += self.pitch[k];
        self.cell[k] >= 0 && (self.cell[k] as usize) < shape[k]
    }
}

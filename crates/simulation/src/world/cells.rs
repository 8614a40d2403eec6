//! A uniform grid over the world that tells which surfaces touch a cell.
//!
//! A surface is entered into every cell whose box, grown by a hair, it touches; so a surface on the border of two cells
//! is in both, and a walk over the cells of a beam meets surfaces no later than they are hit.

use super::surface::Shape;
use super::{Surface, World};
use nalgebra::Vector2;

/// Growth of a cell's box against rounding [m].
const HAIR: f64 = 1e-6;

/// Surfaces by cell; the lists of all cells lie in one array, cell after cell.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Lower corner of the grid [m].
    pub origin: Vector2<f64>,
    /// Edge of a cell [m].
    pub size: f64,
    /// Number of cells along x and y.
    pub shape: [usize; 2],
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Cells {
    /// Sorts the surfaces of `world` into cells of edge `size` [m].
    #[must_use]
    pub fn new(world: &World, size: f64) -> Self {
        let zero = Vector2::zeros();
        let (low, high) = world.bounds().unwrap_or((zero, zero));
        let origin = low.add_scalar(-size / 2.0);
        let shape = [0, 1].map(|k| ((high[k] - origin[k]) / size) as usize + 1);
        let mut cells = Self { origin, size, shape, starts: vec![0; shape[0] * shape[1] + 1], members: vec![] };
        cells.fill(&world.surfaces);
        cells
    }

    /// Surfaces that touch the cell in column `i`, row `j`.
    #[must_use]
    pub fn at(&self, i: usize, j: usize) -> &[u32] {
        let k = j * self.shape[0] + i;
        &self.members[self.starts[k] as usize..self.starts[k + 1] as usize]
    }

    /// Columns and rows of the cells that touch a box, cut at the border of the grid.
    #[must_use]
    pub fn range(&self, low: Vector2<f64>, high: Vector2<f64>) -> [std::ops::RangeInclusive<usize>; 2] {
        [0, 1].map(|k| {
            let index = |x: f64| (((x - self.origin[k]) / self.size).max(0.0) as usize).min(self.shape[k] - 1);
            index(low[k] - HAIR)..=index(high[k] + HAIR)
        })
    }

    fn fill(&mut self, surfaces: &[Surface]) {
        let mut entries: Vec<(u32, u32)> = vec![];
        for (s, surface) in surfaces.iter().enumerate() {
            let (low, high) = surface.shape.bounds();
            let [columns, rows] = self.range(low, high);
            for j in rows {
                let touched = columns.clone().filter(|&i| self.touches(&surface.shape, i, j));
                entries.extend(touched.map(|i| ((j * self.shape[0] + i) as u32, s as u32)));
            }
        }
        entries.sort_unstable();
        for &(cell, _) in &entries {
            self.starts[cell as usize + 1] += 1;
        }
        for k in 1..self.starts.len() {
            self.starts[k] += self.starts[k - 1];
        }
        self.members = entries.into_iter().map(|(_, s)| s).collect();
    }

    /// Whether a shape, known to touch the columns and rows around, touches this very cell.
    fn touches(&self, shape: &Shape, i: usize, j: usize) -> bool {
        let Shape::Segment { a, b } = *shape else { return true };
        let center = self.origin + Vector2::new(i as f64 + 0.5, j as f64 + 0.5) * self.size;
        let e = b - a;
        let reach = (e.x.abs() + e.y.abs()) * (self.size / 2.0 + HAIR);
        (center - a).perp(&e).abs() <= reach
    }
}

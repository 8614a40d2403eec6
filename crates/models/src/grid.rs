//! An occupancy grid: square cells, row 0 at the bottom, x to the right.

use crate::bounds::{CELLS, COORDINATE, RESOLUTION};
use crate::error::{ModelError, require};
use nalgebra::Vector2;

/// What is known of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cell {
    /// Never seen.
    Unknown,
    /// Seen through.
    Free,
    /// Hit.
    Occupied,
}

/// A rectangle of cells whose lower-left corner lies at `origin`; its axes are those of the map frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Edge of a cell [m].
    pub resolution: f64,
    /// Lower-left corner of the lower-left cell [m].
    pub origin: Vector2<f64>,
    /// Number of columns (x).
    pub width: usize,
    /// Number of rows (y).
    pub height: usize,
    /// Row-major cells, `height * width` of them, bottom row first.
    pub cells: Vec<Cell>,
}

impl Grid {
    /// Refuses a grid that covers nothing on earth.
    ///
    /// # Errors
    /// Resolution, origin or number of cells out of bounds; cells that are not as many as its sides say.
    pub fn validate(&self) -> Result<(), ModelError> {
        RESOLUTION.check("resolution", self.resolution)?;
        COORDINATE.check("origin.x", self.origin.x)?;
        COORDINATE.check("origin.y", self.origin.y)?;
        CELLS.check("cells", self.width as f64 * self.height as f64)?;
        let (width, height) = (self.width as f64 * self.resolution, self.height as f64 * self.resolution);
        COORDINATE.check("width", width)?;
        COORDINATE.check("height", height)?;
        let count = self.cells.len();
        require("cells", count as f64, count == self.width * self.height, "must be as many as width times height")
    }

    /// Column and row of the cell that holds a point, if the grid covers it.
    #[must_use]
    pub fn index_of(&self, p: Vector2<f64>) -> Option<(usize, usize)> {
        let c = ((p.x - self.origin.x) / self.resolution).floor();
        let r = ((p.y - self.origin.y) / self.resolution).floor();
        let inside = c >= 0.0 && r >= 0.0 && c < self.width as f64 && r < self.height as f64;
        inside.then_some((c as usize, r as usize))
    }

    /// The cell at a point; `Unknown` outside.
    #[must_use]
    pub fn at(&self, p: Vector2<f64>) -> Cell {
        self.index_of(p).map_or(Cell::Unknown, |(c, r)| self.cells[r * self.width + c])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_cells_from_the_lower_left() {
        let mut g =
            Grid { resolution: 0.5, origin: Vector2::new(-1.0, 2.0), width: 3, height: 2, cells: vec![Cell::Free; 6] };
        g.cells[4] = Cell::Occupied;
        assert_eq!(g.at(Vector2::new(-0.4, 2.6)), Cell::Occupied);
        assert_eq!(g.at(Vector2::new(-0.6, 2.6)), Cell::Free);
        assert_eq!(g.at(Vector2::new(0.6, 2.6)), Cell::Unknown);
        assert_eq!(g.at(Vector2::new(-1.1, 2.6)), Cell::Unknown);
    }
}

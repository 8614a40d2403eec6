//! What is printed on a panel, as a function of the place on it: white, black, or beside the panel.
//!
//! A grid of tags with a border of two modules has Kalibr's black squares where gaps cross. Around each pattern runs a
//! margin of white paper. A tag without drawing is a black square.

use crate::error::SimulationError;
use groma_models::Pattern;
use groma_models::target::{Chessboard, TagGrid};
use nalgebra::Vector2;

/// The modules of a tag, row by row from the top, true where white; as many rows as columns.
pub type Drawing = Vec<bool>;

/// Points along each side of the outline: a lens bends it.
const OUTLINE: u32 = 12;

/// A printed panel.
pub(super) struct Texture<'a> {
    printed: Printed<'a>,
    low: Vector2<f64>,
    high: Vector2<f64>,
}

enum Printed<'a> {
    Tags(&'a TagGrid, &'a [Drawing]),
    Squares(&'a Chessboard),
}

impl<'a> Texture<'a> {
    pub(super) fn new(pattern: &'a Pattern, drawings: &'a [Drawing]) -> Result<Self, SimulationError> {
        match pattern {
            Pattern::TagGrid(grid) => {
                let margin = grid.size * (grid.spacing + 0.15);
                let side = |count: u32| f64::from(count) * grid.size * (1.0 + grid.spacing) - grid.spacing * grid.size;
                let high = Vector2::new(side(grid.columns) + margin, side(grid.rows) + margin);
                Ok(Self { printed: Printed::Tags(grid, drawings), low: Vector2::repeat(-margin), high })
            }
            Pattern::Chessboard(board) => {
                let margin = 1.5 * board.square;
                let side = |count: u32| f64::from(count - 1) * board.square + margin;
                let high = Vector2::new(side(board.columns), side(board.rows));
                Ok(Self { printed: Printed::Squares(board), low: Vector2::repeat(-margin), high })
            }
            Pattern::Charuco(_) => Err(SimulationError::NoDrawing("a ChArUco board")),
        }
    }

    /// Towards which side of z the print looks.
    pub(super) fn out(&self) -> f64 {
        if matches!(self.printed, Printed::Tags(..)) { 1.0 } else { -1.0 }
    }

    /// Whether a place is white; nothing beside the panel.
    pub(super) fn is_white(&self, p: &Vector2<f64>) -> Option<bool> {
        if p.x < self.low.x || p.y < self.low.y || p.x > self.high.x || p.y > self.high.y {
            return None;
        }
        Some(match self.printed {
            Printed::Tags(grid, drawings) => tag_white(grid, drawings, p),
            Printed::Squares(board) => square_white(board, p),
        })
    }

    /// Points around the panel.
    pub(super) fn outline(&self) -> Vec<Vector2<f64>> {
        let at = |k: u32| f64::from(k) / f64::from(OUTLINE);
        let place = |i: u32, j: u32| self.low + (self.high - self.low).component_mul(&Vector2::new(at(i), at(j)));
        (0..=OUTLINE).flat_map(|i| (0..=OUTLINE).map(move |j| place(i, j))).collect()
    }
}

fn tag_white(grid: &TagGrid, drawings: &[Drawing], p: &Vector2<f64>) -> bool {
    let pitch = grid.size * (1.0 + grid.spacing);
    let cell = (p / pitch).map(f64::floor);
    let inside = p - cell * pitch;
    let (in_x, in_y) = (inside.x < grid.size, inside.y < grid.size);
    let exists = |k: f64, count: u32| k >= 0.0 && k < f64::from(count);
    if in_x && in_y && exists(cell.x, grid.columns) && exists(cell.y, grid.rows) {
        return module_white(
            drawings.get(cell.y as usize * grid.columns as usize + cell.x as usize),
            &(inside / grid.size),
        );
    }
    let crossing = |k: f64, count: u32| k >= -1.0 && k < f64::from(count);
    let square = !in_x && !in_y && crossing(cell.x, grid.columns) && crossing(cell.y, grid.rows);
    !(square && grid.border == 2)
}

/// Whether a place of a tag is white; (0, 0) is its lower left corner, (1, 1) the upper right one.
fn module_white(drawing: Option<&Drawing>, place: &Vector2<f64>) -> bool {
    let Some(drawing) = drawing else { return false };
    let modules = drawing.len().isqrt();
    let module = |share: f64| ((share * modules as f64) as usize).min(modules.saturating_sub(1));
    let (column, from_below) = (module(place.x), module(place.y));
    drawing.get((modules - 1 - from_below) * modules + column).copied().unwrap_or(false)
}

fn square_white(board: &Chessboard, p: &Vector2<f64>) -> bool {
    let cell = (p / board.square).map(f64::floor);
    let exists = |k: f64, count: u32| k >= -1.0 && k < f64::from(count);
    let printed = exists(cell.x, board.columns) && exists(cell.y, board.rows);
    !printed || (cell.x + cell.y).rem_euclid(2.0) == 1.0
}

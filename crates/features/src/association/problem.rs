//! What every method of association is given, and what it gives back.

use super::Options;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// What a method works on: finite, not empty.
pub(super) struct Problem<'a, F> {
    pub a: &'a [Vector2<f64>],
    pub b: &'a [Vector2<f64>],
    pub middle: Vector2<f64>,
    pub options: &'a Options,
    pub compatible: F,
}

/// Motions with how well they are supported, best first, and whether the search ran to its end.
pub(super) type Proposed = (Vec<(usize, Se2)>, bool);

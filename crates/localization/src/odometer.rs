//! How far the vehicle has driven.

use groma_geometry::Se2;

/// Distance driven, and the same with turns.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Odometer {
    distance: f64,
    with_turns: f64,
}

impl Odometer {
    /// The vehicle has moved.
    pub fn advance(&mut self, motion: &Se2) {
        self.distance += motion.translation.norm();
        self.with_turns += motion.translation.norm() + motion.theta().abs();
    }

    /// Distance driven [m].
    pub fn distance(self) -> f64 {
        self.distance
    }

    /// Distance driven and turned: a radian counts as a metre [m].
    pub fn with_turns(self) -> f64 {
        self.with_turns
    }
}

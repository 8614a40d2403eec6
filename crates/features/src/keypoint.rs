//! A point of a scan that can be found again.

use nalgebra::{Matrix2, Vector2};

/// A corner of a scan, in the laser frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// Beam that hit the corner.
    pub index: usize,
    /// Position in the laser frame [m].
    pub point: Vector2<f64>,
    /// Direction into which the corner opens, in `(-pi, pi]` in the laser frame [rad].
    pub orientation: f64,
    /// Radius of the neighbourhood in which the corner was judged [m].
    pub radius: f64,
    /// Covariance of the position in the laser frame [m^2].
    pub covariance: Matrix2<f64>,
}

//! Point landmarks in the map frame, with what is known of how well and how often each was seen.

use nalgebra::{Matrix2, Vector2};

/// A corner feature or a reflector.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// Position in the map frame [m].
    pub position: Vector2<f64>,
    /// Covariance of the position [m^2].
    pub covariance: Matrix2<f64>,
    /// Direction into which the corner opens, in the map frame [rad].
    pub orientation: f64,
    /// Number of scans in which it was detected.
    pub seen: u32,
    /// Number of scans in which it was in view.
    pub visible: u32,
}

/// All landmarks of a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkMap {
    /// In order of first sight.
    pub landmarks: Vec<Landmark>,
}

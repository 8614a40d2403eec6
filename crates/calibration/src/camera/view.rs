//! What calibration starts from: the corners of a panel in an image.

use nalgebra::{Vector2, Vector3};

/// Standard deviation that is added to that of every corner [pixel]: what print and lens model leave. It keeps a few
/// corners that are seen very sharply from deciding everything.
const FLOOR: f64 = 0.1;

/// A panel in an image: at least four corners, not on a line.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Number of the image: panels in one image are kept together when images are split.
    pub image: usize,
    /// The corners, as numbered on the panel.
    pub corners: Vec<Sighting>,
}

/// A corner of a panel and where it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// In the frame of the panel [m]; z is small, the panel nearly flat.
    pub point: Vector3<f64>,
    /// In the image [pixel].
    pub pixel: Vector2<f64>,
    /// Standard deviation of a coordinate [pixel].
    pub sigma: f64,
}

impl Sighting {
    /// The weight of a squared residual, in 1/pixel^2.
    #[must_use]
    pub fn weight(&self) -> f64 {
        1.0 / (self.sigma * self.sigma + FLOOR * FLOOR)
    }
}

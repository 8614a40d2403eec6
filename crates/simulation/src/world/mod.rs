//! A flat world: surfaces that a laser beam meets, each with a reflectivity.
//!
//! A surface is a straight wall piece or a circle (pillar, pallet leg, cylindrical reflector) seen from outside.
//! Everything stands at the height of the beam and is opaque. Reflectivity is that of a diffuse wall, 0..1; a
//! retro-reflector is given a value far above 1.

pub mod cells;
pub mod raycast;
pub mod surface;

pub use raycast::{Hit, RayCaster};
pub use surface::{Shape, Surface};

use nalgebra::Vector2;

/// Reflectivity of a painted wall.
pub const WALL: f64 = 0.6;
/// Reflectivity of furniture and goods.
pub const FURNITURE: f64 = 0.35;
/// Reflectivity of retro-reflecting tape.
pub const REFLECTOR: f64 = 30.0;

/// All surfaces of a world, in the order in which they were built.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// The surfaces.
    pub surfaces: Vec<Surface>,
}

impl World {
    /// Adds a straight piece from `a` to `b` [m].
    pub fn wall(&mut self, a: Vector2<f64>, b: Vector2<f64>, reflectivity: f64) {
        self.surfaces.push(Surface { shape: Shape::Segment { a, b }, reflectivity });
    }

    /// Adds a circle [m].
    pub fn circle(&mut self, center: Vector2<f64>, radius: f64, reflectivity: f64) {
        self.surfaces.push(Surface { shape: Shape::Circle { center, radius }, reflectivity });
    }

    /// Adds the straight pieces between consecutive points [m].
    pub fn polyline(&mut self, points: &[Vector2<f64>], reflectivity: f64) {
        for pair in points.windows(2) {
            self.wall(pair[0], pair[1], reflectivity);
        }
    }

    /// Adds a rectangle of full size `(length, depth)` [m], turned by `angle` [rad] about its centre.
    pub fn rectangle(&mut self, center: Vector2<f64>, size: Vector2<f64>, angle: f64, reflectivity: f64) {
        let pose = groma_geometry::Se2::new(center.x, center.y, angle);
        let (u, v) = (size.x / 2.0, size.y / 2.0);
        let corners = [(-u, -v), (u, -v), (u, v), (-u, v), (-u, -v)].map(|(x, y)| pose.act(Vector2::new(x, y)));
        self.polyline(&corners, reflectivity);
    }

    /// Lower and upper corner of the box around everything [m]; `None` when the world is empty.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vector2<f64>, Vector2<f64>)> {
        self.surfaces.iter().map(|s| s.shape.bounds()).reduce(|(a, b), (c, d)| (a.inf(&c), b.sup(&d)))
    }
}

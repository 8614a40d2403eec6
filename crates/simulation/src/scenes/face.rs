//! The visible face of a wall, with what interrupts it.
//!
//! A face runs from one point to another with the free space on its left; u is measured along it, v into the free space
//! (so v < 0 is inside the wall). Only what can be seen is drawn: the plain pieces, and at each feature its outline.

use super::room::Room;
use crate::world::{FURNITURE, WALL, World};
use groma_estimation::streams::Random;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Thickness of the wall at a doorway [m].
pub const THICKNESS: f64 = 0.15;

/// What interrupts a face.
#[derive(Clone, Debug, PartialEq)]
pub enum Feature {
    /// A closed door, a niche or a blind corridor: set back by a depth [m].
    Recess(f64),
    /// A pilaster or a cupboard: standing out by a depth [m].
    Box(f64),
    /// An open door with the room behind it.
    Open(Room),
}

/// A feature at its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// Its middle along the face [m].
    pub u: f64,
    /// Its width [m].
    pub width: f64,
    /// What it is.
    pub feature: Feature,
}

/// A straight wall face.
#[derive(Clone, Copy, Debug)]
pub struct Face {
    /// Start of the face; x runs along it, y into the free space.
    pub frame: Se2,
    /// Length [m].
    pub length: f64,
}

impl Face {
    /// From `a` to `b`, free space on the left.
    #[must_use]
    pub fn new(a: Vector2<f64>, b: Vector2<f64>) -> Self {
        let e = b - a;
        Self { frame: Se2::new(a.x, a.y, e.y.atan2(e.x)), length: e.norm() }
    }

    /// The faces of a closed polygon whose free space lies on the left of its edges.
    #[must_use]
    pub fn around(corners: &[Vector2<f64>]) -> Vec<Self> {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(&a, &b)| Self::new(a, b)).collect()
    }

    /// The point `u` along and `v` off the face.
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> Vector2<f64> {
        self.frame.act(Vector2::new(u, v))
    }

    /// Draws the face with its features, which must be in order and not overlap.
    pub fn draw(&self, world: &mut World, features: &[Placed], random: &mut Random) {
        let mut done = 0.0;
        for placed in features {
            let (from, to) = (placed.u - placed.width / 2.0, placed.u + placed.width / 2.0);
            world.wall(self.point(done, 0.0), self.point(from, 0.0), WALL);
            self.draw_feature(world, from, to, &placed.feature, random);
            done = to;
        }
        world.wall(self.point(done, 0.0), self.point(self.length, 0.0), WALL);
    }

    fn draw_feature(&self, world: &mut World, from: f64, to: f64, feature: &Feature, random: &mut Random) {
        match feature {
            Feature::Recess(depth) => self.outline(world, from, to, -depth, WALL),
            Feature::Box(depth) => self.outline(world, from, to, *depth, FURNITURE),
            Feature::Open(room) => {
                let pose = self.frame * Se2::new((from + to) / 2.0, -THICKNESS, std::f64::consts::PI);
                for u in [from, to] {
                    world.wall(self.point(u, 0.0), self.point(u, -THICKNESS), WALL);
                }
                room.draw(world, &pose, random);
            }
        }
    }

    fn outline(&self, world: &mut World, from: f64, to: f64, v: f64, reflectivity: f64) {
        let corners = [(from, 0.0), (from, v), (to, v), (to, 0.0)].map(|(u, v)| self.point(u, v));
        world.polyline(&corners, reflectivity);
    }
}

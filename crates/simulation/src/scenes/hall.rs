//! A hall to turn in: four walls with doors, pilasters and goods along them, and a floor that is free.
//!
//! The origin is the middle of the floor, x and y run along the walls. A few columns stand beside the free floor.

use super::face::Face;
use super::row::Row;
use crate::world::{WALL, World};
use groma_estimation::streams::Random;
use nalgebra::Vector2;

/// Width of the strip along the walls in which things stand [m].
const STRIP: f64 = 1.4;
/// Distance of the columns along a wall [m].
const COLUMNS: f64 = 6.0;
const COLUMN: f64 = 0.4;
const HALL_WALL: Row =
    Row { module: (3.2, 5.5), depth: (3.0, 3.5), open: 0.0, margin: 0.3, clutter: 0.8, niches: (0.2, 0.6) };

/// Draws a hall whose free floor reaches from `-half` to `half` [m].
#[must_use]
pub fn build(half: Vector2<f64>, random: &mut Random) -> World {
    let mut world = World::default();
    let wall = half.add_scalar(STRIP);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for face in Face::around(&corners.map(|(x, y)| Vector2::new(x * wall.x, y * wall.y))) {
        let features = HALL_WALL.features(&face, random);
        face.draw(&mut world, &features, random);
        columns(&mut world, &face, random);
    }
    world
}

/// Square columns before a wall, not quite in line.
fn columns(world: &mut World, face: &Face, random: &mut Random) {
    let mut u = random.uniform(2.0, COLUMNS);
    while u < face.length - 2.0 {
        let v = random.uniform(0.8, STRIP - COLUMN / 2.0);
        let turned = face.frame.theta() + random.uniform(-0.02, 0.02);
        world.rectangle(face.point(u, v), Vector2::repeat(COLUMN), turned, WALL);
        u += COLUMNS * random.uniform(0.8, 1.3);
    }
}

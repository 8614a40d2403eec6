//! A warehouse: double racks with uprights and pallets, reflectors, columns, a staging area, an office in one corner.
//!
//! x runs along the aisles. Below and above every double rack is an aisle; two lanes cross at the ends of the racks. At the
//! height of the beam a rack is its uprights and the pallets on the floor: loaded ones are boxes, empty ones three blocks
//! a side. Racks have unequal lengths and gaps.
//! Route: around the racks, all aisles to and fro, around again.

use super::face::Face;
use super::row::Row;
use super::stock::{Room, Stock};
use crate::drive::Route;
use crate::world::{FURNITURE, REFLECTOR, WALL, World};
use groma_estimation::streams::Random;
use nalgebra::Vector2;

/// Size of the hall along x and y [m].
const HALL: (f64, f64) = (68.0, 36.5);
/// Size of the office cut out of its upper right corner [m].
const OFFICE: (f64, f64) = (9.0, 8.5);
/// Double racks.
pub const RACKS: usize = 5;
/// Middle of the lowest aisle and distance to the next one [m].
const AISLES: (f64, f64) = (3.2, 5.9);
/// Middle of the left and right lane [m].
pub const LANES: (f64, f64) = (3.6, 54.0);
/// Where the racks begin [m].
pub const RACK_START: f64 = 7.0;
/// Length of a bay between uprights [m].
pub const BAY: f64 = 2.75;
/// Depth of a single rack, and the gap between the two of a double rack [m].
const DEPTH: (f64, f64) = (1.1, 0.2);
/// How a hall wall is drawn: pilasters, doors, no rooms.
const HALL_WALL: Row =
    Row { module: (4.0, 6.5), depth: (3.0, 3.5), open: 0.0, margin: 0.3, clutter: 0.7, niches: (0.2, 0.6) };

/// Draws the warehouse and its route.
#[must_use]
pub fn build(random: &mut Random) -> (World, Route) {
    (draw(random, &mut Stock::unchanged()), route())
}

/// Draws the warehouse with the stock of a day.
#[must_use]
pub fn draw(random: &mut Random, stock: &mut Stock) -> World {
    let mut world = World::default();
    walls(&mut world, random);
    for rack in 0..RACKS {
        double_rack(&mut world, aisle(rack) + AISLES.1 / 2.0, random, stock);
    }
    staging(&mut world, random, stock);
    world
}

/// Middle of an aisle, counted from below [m].
#[must_use]
pub fn aisle(k: usize) -> f64 {
    AISLES.0 + AISLES.1 * k as f64
}

fn walls(world: &mut World, random: &mut Random) {
    let ((w, h), (a, b)) = (HALL, OFFICE);
    let corners = [(0.0, 0.0), (w, 0.0), (w, h - b), (w - a, h - b), (w - a, h), (0.0, h)];
    for face in Face::around(&corners.map(|(x, y)| Vector2::new(x, y))) {
        let features = HALL_WALL.features(&face, random);
        face.draw(world, &features, random);
        plates(world, &face, random);
    }
}

/// Flat reflectors on a wall, clear of what stands out from it.
fn plates(world: &mut World, face: &Face, random: &mut Random) {
    let mut u = random.uniform(2.0, 6.0);
    while u + 0.5 < face.length {
        let width = random.uniform(0.2, 0.5);
        world.wall(face.point(u, 0.42), face.point(u + width, 0.42), REFLECTOR);
        u += random.uniform(5.0, 12.0);
    }
}

fn double_rack(world: &mut World, middle: f64, random: &mut Random, stock: &mut Stock) {
    let bays = 13 + random.index(4);
    let start = RACK_START + random.uniform(0.0, 0.9);
    let missing = random.index(bays);
    for side in [-1.0, 1.0] {
        let y = middle + side * (DEPTH.0 + DEPTH.1) / 2.0;
        for bay in (0..bays).filter(|&bay| bay != missing) {
            single_bay(world, Vector2::new(start + BAY * bay as f64, y), random, stock);
        }
    }
    let end = start + BAY * bays as f64;
    for x in [start - 0.15, end + 0.15] {
        if random.chance(0.8) {
            world.circle(Vector2::new(x, middle + random.uniform(-0.9, 0.9)), 0.04, REFLECTOR);
        }
    }
}

/// The four uprights of a bay whose left end is in the middle at `at`, and its three places for pallets.
fn single_bay(world: &mut World, at: Vector2<f64>, random: &mut Random, stock: &mut Stock) {
    for x in [0.0, BAY] {
        for y in [-0.5, 0.5] {
            let post = at + Vector2::new(x, y * (DEPTH.0 - 0.1));
            world.rectangle(post, Vector2::new(0.1, 0.08), 0.0, FURNITURE);
        }
    }
    for place in 0..3 {
        let middle = at + Vector2::new((f64::from(place) + 0.5) * BAY / 3.0, 0.0);
        stock.place(world, middle, &Room { x: 0.03, y: 0.08, turn: 0.03 }, random);
    }
}

/// Columns and pallets that wait at the docks, right of the right lane.
fn staging(world: &mut World, random: &mut Random, stock: &mut Stock) {
    for y in [7.0, 14.5, 22.0] {
        let column = Vector2::new(59.5, y);
        world.rectangle(column, Vector2::new(0.35, 0.35), 0.0, WALL);
        world.circle(column + Vector2::new(-0.25, 0.0), 0.04, REFLECTOR);
    }
    for row in 0..6 {
        for place in 0..3 {
            let center = Vector2::new(61.5 + 1.7 * f64::from(place), 3.0 + 3.6 * f64::from(row));
            stock.place(world, center, &Room { x: 0.25, y: 0.5, turn: 0.5 }, random);
        }
    }
}

/// Around the racks, all aisles to and fro, around again.
#[must_use]
pub fn route() -> Route {
    let (left, right) = LANES;
    let mut points = vec![(left + 6.0, aisle(0)), (right, aisle(0)), (right, aisle(RACKS)), (left, aisle(RACKS))];
    for k in 0..=RACKS {
        let (from, to) = if k % 2 == 0 { (left, right) } else { (right, left) };
        points.extend([(from, aisle(k)), (to, aisle(k))]);
    }
    points.extend([(left, aisle(0)), (right, aisle(0)), (right, aisle(RACKS)), (left + 10.0, aisle(RACKS))]);
    let mut route = Route::from(Vector2::new(points[0].0, points[0].1));
    for (x, y) in points.into_iter().skip(1) {
        route.to(Vector2::new(x, y));
    }
    route
}

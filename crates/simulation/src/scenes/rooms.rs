//! An office floor: corridors in the shape of an 8 around two blocks of rooms, a lobby, a blind end.
//!
//! Centre lines: south y = 0, north y = H, west x = 0, east x = W, rung x = R. The corridors have unequal widths; the
//! lobby widens the south corridor, the east corridor goes on beyond the north one and ends blind.
//! Route: once around with a visit to rooms on the way, once around without, the 8 through the rung the other way round.

use super::face::Face;
use super::row::Row;
use super::visit::{self, Visit};
use crate::drive::Route;
use crate::world::{FURNITURE, WALL, World};
use groma_estimation::streams::Random;
use nalgebra::Vector2;

/// Least distance between two rooms that are visited [m].
const VISIT_SPACING: f64 = 9.0;

/// Lines and widths of the corridors [m].
struct Plan {
    width: f64,
    height: f64,
    rung: f64,
    south: f64,
    north: f64,
    west: f64,
    east: f64,
    middle: f64,
    lobby: f64,
    blind: f64,
}

/// A face with the way it is drawn and its distance from the centre line.
struct Side {
    face: Face,
    row: Option<Row>,
    distance: f64,
}

/// Draws the floor and its route.
#[must_use]
pub fn build(random: &mut Random) -> (World, Route) {
    let plan = Plan::draw(random);
    let mut world = World::default();
    let mut visits = vec![];
    for side in plan.sides(random) {
        let features = side.row.map_or(vec![], |row| row.features(&side.face, random));
        side.face.draw(&mut world, &features, random);
        visits.extend(Visit::behind(&side.face, &features, side.distance));
    }
    plan.furnish_lobby(&mut world, random);
    (world, plan.route(&visits, random))
}

const ROOMS: Row =
    Row { module: (2.9, 6.2), depth: (3.8, 5.6), open: 0.6, margin: 0.3, clutter: 0.4, niches: (0.25, 0.5) };
const PLAIN: Row =
    Row { module: (2.2, 4.0), depth: (3.0, 3.5), open: 0.0, margin: 0.3, clutter: 0.5, niches: (0.0, 0.0) };

impl Plan {
    fn draw(random: &mut Random) -> Self {
        let width = random.uniform(43.0, 49.0);
        Self {
            width,
            height: random.uniform(11.4, 12.2),
            rung: width * random.uniform(0.36, 0.44),
            south: random.uniform(1.15, 1.3),
            north: random.uniform(0.92, 1.0),
            west: random.uniform(1.0, 1.1),
            east: random.uniform(1.2, 1.35),
            middle: random.uniform(0.9, 0.95),
            lobby: width * random.uniform(0.6, 0.66),
            blind: random.uniform(7.0, 9.0),
        }
    }

    fn outer(&self) -> [Vector2<f64>; 10] {
        let (left, right) = (-self.west, self.width + self.east);
        let (bottom, top) = (-self.south, self.height + self.north);
        let end = top + self.blind;
        [
            (left, bottom),
            (self.lobby, bottom),
            (self.lobby, bottom - 4.6),
            (self.lobby + 6.5, bottom - 4.6),
            (self.lobby + 6.5, bottom),
            (right, bottom),
            (right, end),
            (self.width - self.east, end),
            (self.width - self.east, top),
            (left, top),
        ]
        .map(|(x, y)| Vector2::new(x, y))
    }

    fn block(&self, left: f64, right: f64) -> [Vector2<f64>; 4] {
        let (bottom, top) = (self.south, self.height - self.north);
        [(left, bottom), (left, top), (right, top), (right, bottom)].map(|(x, y)| Vector2::new(x, y))
    }

    fn sides(&self, random: &mut Random) -> Vec<Side> {
        let (deep, shallow) = self.block_rows(random);
        let outer = Face::around(&self.outer()).into_iter().zip([
            (Some(ROOMS), self.south),
            (None, 0.0),
            (Some(PLAIN), 0.0),
            (None, 0.0),
            (Some(ROOMS), self.south),
            (Some(ROOMS), self.east),
            (None, 0.0),
            (Some(PLAIN), 0.0),
            (Some(ROOMS), self.north),
            (Some(ROOMS), self.west),
        ]);
        let first = Face::around(&self.block(self.west, self.rung - self.middle));
        let second = Face::around(&self.block(self.rung + self.middle, self.width - self.east));
        let rows = [(Some(PLAIN), 0.0), (Some(shallow), self.north), (Some(PLAIN), 0.0), (Some(deep), self.south)];
        let blocks = [first, second].into_iter().flat_map(|faces| faces.into_iter().zip(rows));
        outer.chain(blocks).map(|(face, (row, distance))| Side { face, row, distance }).collect()
    }

    /// Rows of the blocks: two rooms back to back, three walls between the corridors.
    fn block_rows(&self, random: &mut Random) -> (Row, Row) {
        let free = self.height - self.south - self.north - 0.5;
        let deep = free * random.uniform(0.5, 0.56);
        let row = |depth| Row { depth: (depth, depth + 1e-9), niches: (0.0, 0.0), ..ROOMS };
        (row(deep), row(free - deep))
    }

    fn furnish_lobby(&self, world: &mut World, random: &mut Random) {
        let bottom = -self.south;
        for x in [1.1, 5.2] {
            world.circle(Vector2::new(self.lobby + x, bottom - 0.9), 0.22, WALL);
        }
        let sofa = Vector2::new(self.lobby + random.uniform(2.0, 4.5), bottom - 3.2);
        world.rectangle(sofa, Vector2::new(1.9, 0.8), random.uniform(-0.3, 0.3), FURNITURE);
        world.circle(Vector2::new(self.lobby + 0.5, bottom - 4.0), 0.25, FURNITURE);
    }

    fn route(&self, visits: &[Visit], random: &mut Random) -> Route {
        let at = |x, y| Vector2::new(x, y);
        let (sw, se) = (at(0.0, 0.0), at(self.width, 0.0));
        let (ne, nw) = (at(self.width, self.height), at(0.0, self.height));
        let (low, high) = (at(self.rung, 0.0), at(self.rung, self.height));
        let start = at(self.rung / 2.0, 0.0);
        let mut route = Route::from(start);
        for line in [start, se, ne, nw, sw, start].windows(2) {
            for visit in visit::on_line(visits, line[0], line[1], VISIT_SPACING) {
                visit::call(&mut route, &visit, random);
            }
            route.to(line[1]);
        }
        for point in [se, ne, high, low, sw, nw, high] {
            route.to(point);
        }
        route.stop(3.0);
        for point in [nw, sw, low, high, ne, se, start] {
            route.to(point);
        }
        route
    }
}

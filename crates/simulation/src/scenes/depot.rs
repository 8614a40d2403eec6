//! The warehouse as a vehicle that navigates by reflectors knows it, on a day of its life, and the drives by which
//! localization is judged.
//!
//! Besides the marks of the warehouse, posts with tape stand in its aisles, in front of the uprights on alternating sides,
//! so that several are always in view. Of all marks a share hangs; those of a smaller share are among those of a larger.
//! Pallets move from day to day, see [`super::stock`].
//!
//! Routes: one for the map (as the warehouse's own) and its way back, four paths of 12, 12, 12 and 7 m (the lengths of F. Kallasi, thesis,
//! Parma 2017, table 5.6), and a round of ten halting points that is driven `ROUNDS` times.

use super::stock::Stock;
use super::warehouse::{self, LANES, RACK_START, RACKS, aisle};
use crate::drive::Route;
use crate::world::{REFLECTOR, World};
use groma_estimation::streams::{Purpose, Random};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Distance of the posts in an aisle [m].
const POST_SPACING: f64 = 7.0;
/// How far a post stands from the middle of the aisle, in front of the uprights [m].
const POST_ASIDE: f64 = 1.67;
/// Radius of a post [m].
const POST: f64 = 0.04;
/// Where the posts end, beyond the shortest rack [m].
const POSTS_END: f64 = 43.0;
/// How often the halting points are visited.
const ROUNDS: usize = 3;
/// How long the vehicle stands at the end of a drive and at a halting point [s].
const PAUSE: f64 = 2.0;
/// Keeps the random numbers of the marks apart from those of buildings.
const MARKS: u64 = 1 << 41;

/// A day in the warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Depot {
    /// Draws the building; the seed of the scenario draws the noise alone.
    pub plan: u64,
    /// Draws the stock.
    pub day: u64,
    /// Share of the places for pallets that are drawn anew on this day.
    pub changed: f64,
    /// Share of the reflectors that hang.
    pub reflectors: f64,
    /// Where the vehicle drives.
    pub drive: DepotDrive,
}

/// A drive through the warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DepotDrive {
    /// Through all aisles, to map them.
    Survey,
    /// The same the other way round.
    Back,
    /// 12 m along an aisle.
    Path1,
    /// 12 m out of an aisle into a lane.
    Path2,
    /// 12 m out of a lane into an aisle.
    Path3,
    /// 7 m along a lane.
    Path4,
    /// Around a rack, with ten stops, three times.
    Halts,
}

impl Default for Depot {
    fn default() -> Self {
        Self { plan: 1, day: 0, changed: 0.0, reflectors: 1.0, drive: DepotDrive::Survey }
    }
}

/// Draws the warehouse on that day and the route of the drive.
#[must_use]
pub fn build(depot: &Depot) -> (World, Route) {
    let mut random = Random::new(depot.plan, Purpose::Building);
    let mut world = warehouse::draw(&mut random, &mut Stock::of_day(depot.day, depot.changed));
    posts(&mut world, &mut random);
    let mut marks = Random::new(MARKS, Purpose::Building);
    world.surfaces.retain(|surface| surface.reflectivity < REFLECTOR || marks.uniform(0.0, 1.0) < depot.reflectors);
    (world, route(depot.drive))
}

fn posts(world: &mut World, random: &mut Random) {
    for k in 0..=RACKS {
        let mut side = random.sign();
        let mut x = RACK_START + random.uniform(1.0, 3.0);
        while x < POSTS_END {
            let aside = match k {
                // The outermost aisles have a rack on one side only.
                0 => 1.0,
                RACKS => -1.0,
                _ => side,
            };
            world.circle(Vector2::new(x, aisle(k) + aside * POST_ASIDE), POST, REFLECTOR);
            x += POST_SPACING + random.uniform(-1.0, 1.0);
            side = -side;
        }
    }
}

fn route(drive: DepotDrive) -> Route {
    let (left, right) = LANES;
    match drive {
        DepotDrive::Survey => warehouse::route(),
        DepotDrive::Back => back(),
        DepotDrive::Path1 => path(&[(12.0, aisle(1)), (24.0, aisle(1))]),
        DepotDrive::Path2 => path(&[(12.4, aisle(2)), (left, aisle(2)), (left, aisle(2) + 4.0)]),
        DepotDrive::Path3 => path(&[(right, aisle(3) + 6.5), (right, aisle(3)), (right - 6.3, aisle(3))]),
        DepotDrive::Path4 => path(&[(left, 22.5), (left, 29.5)]),
        DepotDrive::Halts => halts(),
    }
}

fn back() -> Route {
    let points: Vec<_> =
        warehouse::route().legs.into_iter().flat_map(|leg| leg.points).rev().map(|p| (p.x, p.y)).collect();
    path(&points)
}

fn path(points: &[(f64, f64)]) -> Route {
    let mut route = Route::from(Vector2::new(points[0].0, points[0].1));
    points[1..].iter().for_each(|&(x, y)| route.to(Vector2::new(x, y)));
    route.stop(PAUSE);
    route
}

/// Around the second rack from below: four stops in each of its aisles, one in each lane.
fn halts() -> Route {
    let (left, right) = LANES;
    let (low, high) = (aisle(1), aisle(2));
    let mut route = Route::from(Vector2::new(left + 5.0, low));
    for _ in 0..ROUNDS {
        let out = [12.0, 21.0, 30.0, 39.0].map(|x| (x, low));
        let back = [44.0, 35.0, 26.0, 17.0].map(|x| (x, high));
        out.iter().for_each(|&(x, y)| halt(&mut route, x, y));
        route.to(Vector2::new(right, low));
        halt(&mut route, right, (low + high) / 2.0);
        route.to(Vector2::new(right, high));
        back.iter().for_each(|&(x, y)| halt(&mut route, x, y));
        route.to(Vector2::new(left, high));
        halt(&mut route, left, (low + high) / 2.0);
        route.to(Vector2::new(left, low));
    }
    route
}

fn halt(route: &mut Route, x: f64, y: f64) {
    route.to(Vector2::new(x, y));
    route.stop(PAUSE);
}

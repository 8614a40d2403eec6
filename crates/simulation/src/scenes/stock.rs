//! Pallets on the floor: loaded ones are boxes, empty ones three blocks a side, some places are free.
//!
//! The stock of a day keeps what the building was drawn with, but for a share of the places, which are drawn anew from the
//! day's own random numbers. So the same building can be mapped on one day and driven through on another.

use crate::world::{FURNITURE, World};
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Footprint of a pallet, the long side across the rack [m].
const PALLET: (f64, f64) = (0.8, 1.2);
/// Keeps the random numbers of days apart from those of buildings.
const DAYS: u64 = 1 << 40;

/// How far a pallet may stand from the middle of its place.
pub struct Room {
    /// Along x [m].
    pub x: f64,
    /// Along y [m].
    pub y: f64,
    /// Turned [rad].
    pub turn: f64,
}

/// What stands where on a day.
pub struct Stock {
    changed: f64,
    random: Random,
}

/// What stands at a place.
enum Pallet {
    Loaded(Vector2<f64>),
    Empty,
    None,
}

impl Stock {
    /// As the building was drawn.
    #[must_use]
    pub fn unchanged() -> Self {
        Self::of_day(0, 0.0)
    }

    /// With a share of the places drawn anew.
    #[must_use]
    pub fn of_day(day: u64, changed: f64) -> Self {
        Self { changed, random: Random::new(DAYS + day, Purpose::Building) }
    }

    /// Draws what stands at the place around `middle`; `random` is that of the building.
    pub fn place(&mut self, world: &mut World, middle: Vector2<f64>, room: &Room, random: &mut Random) {
        let built = draw(middle, room, random);
        let (pose, pallet) =
            if self.random.chance(self.changed) { draw(middle, room, &mut self.random) } else { built };
        match pallet {
            Pallet::Loaded(load) => world.rectangle(pose.translation, load, pose.theta(), FURNITURE),
            Pallet::Empty => blocks(world, &pose),
            Pallet::None => {}
        }
    }
}

/// Where a pallet stands, and which.
fn draw(middle: Vector2<f64>, room: &Room, random: &mut Random) -> (Se2, Pallet) {
    let x = middle.x + random.uniform(-room.x, room.x);
    let y = middle.y + random.uniform(-room.y, room.y);
    let pose = Se2::new(x, y, random.uniform(-room.turn, room.turn));
    let pallet = match random.uniform(0.0, 1.0) {
        kind if kind < 0.55 => {
            Pallet::Loaded(Vector2::new(PALLET.0 - random.uniform(0.0, 0.15), PALLET.1 - random.uniform(0.0, 0.3)))
        }
        kind if kind < 0.75 => Pallet::Empty,
        _ => Pallet::None,
    };
    (pose, pallet)
}

fn blocks(world: &mut World, pose: &Se2) {
    for (x, y) in [-0.33, 0.0, 0.33].into_iter().flat_map(|x| [(x, -0.53), (x, 0.53)]) {
        world.rectangle(pose.act(Vector2::new(x, y)), Vector2::new(0.1, 0.14), pose.theta(), FURNITURE);
    }
}

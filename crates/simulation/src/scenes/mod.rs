//! Scenes: a world drawn from a seed, and a route through it.
//!
//! Buildings are irregular on purpose (rooms, doors and furniture of many sizes, corridors of unequal width, no
//! symmetric plan) and repetitive on purpose (standard doors at a regular pitch), as real ones are.

pub mod corridor_loop;
pub mod depot;
pub mod face;
pub mod hall;
pub mod room;
pub mod rooms;
pub mod row;
pub mod stock;
pub mod visit;
pub mod warehouse;

use crate::drive::Route;
use crate::scenario::Building;
use crate::world::World;
use groma_estimation::streams::Random;

/// Draws `building` and its route.
#[must_use]
pub fn build(building: Building, random: &mut Random) -> (World, Route) {
    match building {
        Building::Rooms => rooms::build(random),
        Building::Warehouse => warehouse::build(random),
        Building::Depot(depot) => depot::build(&depot),
        Building::Loop => corridor_loop::build(random),
    }
}

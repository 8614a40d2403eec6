//! A room behind an open door, with furniture that leaves the way in free.
//!
//! Room frame: origin in the middle of the doorway on the room's side, y into the room. The room is the rectangle
//! `[-left, right] x [0, depth]`. Furniture is put at random places and left out where it would overlap what stands already
//! or the way from the door to the place where a visitor turns.

use crate::world::{FURNITURE, WALL, World};
use groma_estimation::streams::Random;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Half the width of the way that stays free [m].
const WAY: f64 = 0.65;
/// Free space around the place where a visitor turns [m].
const TURN: f64 = 0.75;

/// Sizes of a room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// Width of the door [m].
    pub door: f64,
    /// From the middle of the door to the wall at negative x [m].
    pub left: f64,
    /// From the middle of the door to the wall at positive x [m].
    pub right: f64,
    /// Depth [m].
    pub depth: f64,
    /// How far behind the door a visitor turns [m].
    pub reach: f64,
}

/// An upright box in the room frame: centre and size.
#[derive(Clone, Copy)]
struct Block {
    center: Vector2<f64>,
    size: Vector2<f64>,
}

impl Room {
    /// Draws the room, its open door leaf and its furniture at `pose` (`T_world_room`).
    pub fn draw(&self, world: &mut World, pose: &Se2, random: &mut Random) {
        let half = self.door / 2.0;
        let corners = [
            (-half, 0.0),
            (-self.left, 0.0),
            (-self.left, self.depth),
            (self.right, self.depth),
            (self.right, 0.0),
            (half, 0.0),
        ];
        world.polyline(&corners.map(|(x, y)| pose.act(Vector2::new(x, y))), WALL);
        let mut taken = vec![self.way()];
        taken.extend(self.leaf(world, pose, random));
        let items = 2 + ((self.left + self.right) * self.depth / 5.0) as usize;
        for _ in 0..items {
            self.furnish(world, pose, &mut taken, random);
        }
    }

    fn way(&self) -> Block {
        let length = self.reach + TURN;
        Block { center: Vector2::new(0.0, length / 2.0), size: Vector2::new(2.0 * WAY, length) }
    }

    /// The open leaf of the door, turned away from the way in.
    fn leaf(&self, world: &mut World, pose: &Se2, random: &mut Random) -> Option<Block> {
        let hinge = Vector2::new(-self.door / 2.0, 0.0);
        let (sin, cos) = random.uniform(1.6, 2.2).sin_cos();
        let end = hinge + Vector2::new(cos, sin) * (self.door - 0.05);
        (end.x > 0.1 - self.left && end.y < self.depth).then(|| {
            world.wall(pose.act(hinge), pose.act(end), WALL);
            Block { center: (hinge + end) / 2.0, size: (end - hinge).abs() }
        })
    }

    fn furnish(&self, world: &mut World, pose: &Se2, taken: &mut Vec<Block>, random: &mut Random) {
        let kind = random.index(4);
        let size = match kind {
            0 => Vector2::new(random.uniform(0.6, 1.8), random.uniform(0.35, 0.5)),
            1 => Vector2::new(random.uniform(1.4, 1.8), 1.5),
            2 => Vector2::new(0.35, random.uniform(0.7, 1.6)),
            _ => Vector2::new(0.4, 0.4),
        };
        let Some(block) = self.place(kind, size, random).filter(|b| taken.iter().all(|t| !b.overlaps(t))) else {
            return;
        };
        taken.push(block);
        match kind {
            1 => desk(world, pose, &block, random),
            3 => world.circle(pose.act(block.center), random.uniform(0.12, 0.2), FURNITURE),
            _ => world.rectangle(pose.act(block.center), block.size, pose.theta(), FURNITURE),
        }
    }

    /// Cupboards (0) at the far wall, shelves (2) at a side wall, the rest anywhere.
    fn place(&self, kind: usize, size: Vector2<f64>, random: &mut Random) -> Option<Block> {
        let gap = 0.03;
        let (low, high) = (Vector2::new(-self.left, 0.0), Vector2::new(self.right, self.depth));
        let (first, last) = (low + size / 2.0, high - size / 2.0);
        let (low, high) = (first.add_scalar(gap), last.add_scalar(-gap));
        if low.x >= high.x || low.y >= high.y {
            return None;
        }
        let mut center = Vector2::new(random.uniform(low.x, high.x), random.uniform(low.y, high.y));
        match kind {
            0 => center.y = high.y,
            2 => center.x = if random.chance(0.5) { low.x } else { high.x },
            _ => {}
        }
        Some(Block { center, size })
    }
}

impl Block {
    fn overlaps(&self, other: &Self) -> bool {
        let (gap, reach) = ((self.center - other.center).abs(), (self.size + other.size) / 2.0);
        gap.x < reach.x && gap.y < reach.y
    }
}

/// A desk as a scanner sees it: legs, a chest of drawers, and the star foot of a chair.
fn desk(world: &mut World, room: &Se2, block: &Block, random: &mut Random) {
    let pose = *room * Se2::new(block.center.x, block.center.y, random.uniform(-0.08, 0.08));
    let (x, y) = (block.size.x / 2.0 - 0.08, block.size.y / 2.0 - 0.08);
    let side = random.sign();
    for (a, b) in [(-x, y), (x, y), (-x, y - 0.7), (x, y - 0.7)] {
        world.circle(pose.act(Vector2::new(a, b)), 0.025, FURNITURE);
    }
    let chest = pose.act(Vector2::new(side * (x - 0.25), y - 0.33));
    world.rectangle(chest, Vector2::new(0.42, 0.58), pose.theta(), FURNITURE);
    let chair = Vector2::new(-side * random.uniform(0.0, 0.3), -0.35);
    let turn = random.uniform(0.0, 1.2);
    for k in 0..5 {
        let (sin, cos) = (turn + f64::from(k) * std::f64::consts::TAU / 5.0).sin_cos();
        world.circle(pose.act(chair + Vector2::new(cos, sin) * 0.27), 0.03, FURNITURE);
    }
}

//! A row of rooms, doors and cupboards along a face.
//!
//! The face is cut into modules, one room each; a module has its door, open or closed, at about the same place as
//! its neighbours (one architect drew the row) and sometimes a cupboard, a pilaster or a niche beside it.

use super::face::{Face, Feature, Placed, THICKNESS};
use super::room::Room;
use groma_estimation::streams::Random;

/// Clear widths of doors [m].
const DOORS: [f64; 4] = [0.85, 0.95, 1.1, 1.35];
/// How far a closed door is set back [m].
const DOOR_DEPTHS: [f64; 3] = [0.06, 0.09, 0.12];
/// Free space between two features [m].
const GAP: f64 = 0.2;

/// How a row is drawn.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Shortest and longest module [m].
    pub module: (f64, f64),
    /// Least and greatest depth of a room [m].
    pub depth: (f64, f64),
    /// Share of doors that stand open.
    pub open: f64,
    /// How far from the ends of the face open doors and niches begin [m].
    pub margin: f64,
    /// Share of modules with something beside the door.
    pub clutter: f64,
    /// Share of that which is a niche or a blind corridor, and how deep it may be [m].
    pub niches: (f64, f64),
}

/// What the modules of one row have in common.
struct Habit {
    door: f64,
    depth: f64,
    place: f64,
}

impl Row {
    /// The features of `face`, in order.
    pub fn features(&self, face: &Face, random: &mut Random) -> Vec<Placed> {
        let habit = Habit {
            door: DOORS[random.index(DOORS.len() - 1)],
            depth: DOOR_DEPTHS[random.index(DOOR_DEPTHS.len())],
            place: random.uniform(0.3, 0.5),
        };
        let mut out = vec![];
        let mut u = 2.0 * THICKNESS;
        while u + self.module.0 < face.length - THICKNESS {
            let end = (u + random.uniform(self.module.0, self.module.1)).min(face.length - THICKNESS);
            self.module_features(u, end, face.length, &habit, random, &mut out);
            u = end;
        }
        out
    }

    fn module_features(
        &self,
        u: f64,
        end: f64,
        length: f64,
        habit: &Habit,
        random: &mut Random,
        out: &mut Vec<Placed>,
    ) {
        let deep = u >= self.margin && end <= length - self.margin;
        let width = if random.chance(0.8) { habit.door } else { DOORS[random.index(DOORS.len())] };
        let middle = u + (end - u) * (habit.place + random.uniform(-0.06, 0.06));
        let middle = middle.clamp(u + width / 2.0 + GAP, end - width / 2.0 - GAP);
        let room = self.room(u, end, middle, width, random);
        let opens = random.chance(self.open) && deep;
        let feature = if opens { Feature::Open(room) } else { Feature::Recess(habit.depth) };
        out.push(Placed { u: middle, width, feature });
        if random.chance(self.clutter) {
            out.extend(self.beside(middle + width / 2.0 + GAP, end - GAP, deep && !opens, random));
        }
    }

    /// Room frames look into the wall, so what is left along the face is right in the room.
    fn room(&self, u: f64, end: f64, middle: f64, door: f64, random: &mut Random) -> Room {
        let depth = random.uniform(self.depth.0, self.depth.1);
        let reach = random.uniform(1.1, 1.9).min(depth - 1.0);
        Room { door, left: end - THICKNESS - middle, right: middle - u, depth, reach }
    }

    fn beside(&self, from: f64, to: f64, deep: bool, random: &mut Random) -> Option<Placed> {
        let niche = deep && random.chance(self.niches.0);
        let most = if niche { 2.2 } else { 1.8 };
        let width = random.uniform(0.25, most).min(to - from);
        let depth = if niche { random.uniform(0.3, self.niches.1) } else { random.uniform(0.08, 0.4) };
        let feature = if niche { Feature::Recess(depth) } else { Feature::Box(depth) };
        (width > 0.2).then(|| Placed { u: random.uniform(from + width / 2.0, to - width / 2.0 + 1e-9), width, feature })
    }
}

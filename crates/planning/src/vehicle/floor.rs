//! Whether an arc fits on a floor: the vehicle's outline, along the whole arc, within a polygon.
//!
//! The outline is a rectangle. It lies within when its corners do and no edge of the polygon crosses it, at poses along
//! the arc that are close against its size. Start poses are tried on a grid; the first that fits is taken, nearest the
//! middle of the floor first.

use super::arcs::Arc;
use groma_calibration::vehicle::Vehicle;
use groma_geometry::Se2;
use groma_models::ModelError;
use groma_models::bounds::{Bound, COORDINATE};
use nalgebra::Vector2;
use std::f64::consts::TAU;

type Point = Vector2<f64>;

/// Distance of poses along an arc at the farthest corner [m].
const STRIDE: f64 = 0.1;
/// Start poses along either side of the floor's box.
const PLACES: usize = 12;
/// Start headings.
const HEADINGS: usize = 16;

/// A polygon, corners in order [m].
#[derive(Clone, Debug, PartialEq)]
pub struct Floor {
    corners: Vec<Point>,
}

/// The outline of a vehicle about its base [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// Reach ahead of the base.
    pub front: f64,
    /// Reach behind it.
    pub rear: f64,
    /// Reach to either side.
    pub side: f64,
}

impl Footprint {
    /// Refuses an outline that no vehicle has.
    ///
    /// # Errors
    /// The first number that is not finite or out of its bound, by name.
    pub fn validate(&self) -> Result<(), ModelError> {
        let reach = Bound::new("reach", 0.0, 100.0, "must be from 0 to 100 m");
        reach.check("front", self.front)?;
        reach.check("rear", self.rear)?;
        reach.check("side", self.side)
    }

    fn corners(&self) -> [Point; 4] {
        let (f, r, s) = (self.front, self.rear, self.side);
        [Point::new(f, s), Point::new(-r, s), Point::new(-r, -s), Point::new(f, -s)]
    }

    fn reach(&self) -> f64 {
        self.front.max(self.rear).hypot(self.side)
    }
}

impl Floor {
    /// Nothing for fewer than three corners, numbers that are not finite or out of bounds, or no area.
    #[must_use]
    pub fn new(corners: Vec<Point>) -> Option<Self> {
        let finite = corners.iter().all(|p| COORDINATE.holds(p.x) && COORDINATE.holds(p.y));
        let floor = Self { corners };
        (floor.corners.len() >= 3 && finite && floor.area().abs() > 0.0).then_some(floor)
    }

    fn area(&self) -> f64 {
        self.edges().map(|(a, b)| a.perp(&b)).sum::<f64>() / 2.0
    }

    fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(a, b)| (*a, *b))
    }

    fn holds_point(&self, p: Point) -> bool {
        let crosses =
            |(a, b): (Point, Point)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
        self.edges().filter(|e| crosses(*e)).count() % 2 == 1
    }

    /// Whether the outline lies within at a pose.
    #[must_use]
    pub fn holds(&self, footprint: &Footprint, pose: &Se2) -> bool {
        let corners = footprint.corners().map(|c| pose.act(c));
        let sides = [0, 1, 2, 3].map(|k| (corners[k], corners[(k + 1) % 4]));
        corners.iter().all(|c| self.holds_point(*c)) && !self.edges().any(|e| sides.iter().any(|s| cross(e, *s)))
    }

    /// A start pose from which the whole arc fits; nothing when none is found.
    #[must_use]
    pub fn start(&self, vehicle: &Vehicle, arc: &Arc, footprint: &Footprint) -> Option<Se2> {
        let poses = along(vehicle, arc, footprint);
        let fits = |start: &Se2| poses.iter().all(|p| self.holds(footprint, &(*start * *p)));
        self.places().find(fits)
    }

    /// Start poses to try, nearest the middle of the box first.
    fn places(&self) -> impl Iterator<Item = Se2> {
        let (low, high) = self.bounds();
        let share = |k: usize| (k as f64 + 0.5) / PLACES as f64;
        let at = |i: usize, j: usize| low + (high - low).component_mul(&Point::new(share(i), share(j)));
        let mut places: Vec<Point> = (0..PLACES * PLACES).map(|k| at(k / PLACES, k % PLACES)).collect();
        let middle = (low + high) / 2.0;
        places.sort_by(|a, b| (a - middle).norm_squared().total_cmp(&(b - middle).norm_squared()));
        let headings = |p: Point| (0..HEADINGS).map(move |h| Se2::new(p.x, p.y, TAU * h as f64 / HEADINGS as f64));
        places.into_iter().flat_map(headings)
    }

    fn bounds(&self) -> (Point, Point) {
        let first = self.corners[0];
        self.corners.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)))
    }
}

/// Poses along an arc, seen from its start: the end first, for it fails most often.
fn along(vehicle: &Vehicle, arc: &Arc, footprint: &Footprint) -> Vec<Se2> {
    let u = arc.path_and_turn(vehicle);
    let count = ((u.x.abs() + u.y.abs() * footprint.reach()) / STRIDE).ceil().max(1.0) as usize;
    (0..=count).rev().map(|k| arc.motion(vehicle, k as f64 / count as f64)).collect()
}

fn cross((a, b): (Point, Point), (c, d): (Point, Point)) -> bool {
    let side = |p: Point, q: Point, r: Point| (q - p).perp(&(r - p));
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner_room() -> Floor {
        let corners = [(0.0, 0.0), (6.0, 0.0), (6.0, 2.0), (2.0, 2.0), (2.0, 6.0), (0.0, 6.0)];
        Floor::new(corners.map(|(x, y)| Point::new(x, y)).to_vec()).unwrap()
    }

    #[test]
    fn an_outline_fits_or_reaches_around_the_corner() {
        let (floor, box_) = (corner_room(), Footprint { front: 1.5, rear: 0.5, side: 0.4 });
        assert!(floor.holds(&box_, &Se2::new(1.0, 1.0, 0.0)));
        assert!(!floor.holds(&box_, &Se2::new(5.0, 1.0, 0.0)));
        assert!(!floor.holds(&box_, &Se2::new(1.0, 1.0, 0.8)));
        let long = Footprint { front: 4.0, rear: 0.1, side: 0.1 };
        assert!(!floor.holds(&long, &Se2::new(0.5, 4.0, -0.8)), "both ends are inside, the middle is not");
    }

    #[test]
    fn degenerate_floors_are_none() {
        assert!(Floor::new(vec![Point::new(0.0, 0.0), Point::new(1.0, 0.0)]).is_none());
        assert!(Floor::new(vec![Point::new(0.0, 0.0), Point::new(1.0, 1.0), Point::new(2.0, 2.0)]).is_none());
        assert!(Floor::new(vec![Point::new(0.0, 0.0), Point::new(1.0, 0.0), Point::new(f64::NAN, 2.0)]).is_none());
    }
}

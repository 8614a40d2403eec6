//! Two kilometres of corridor in one loop, as in a campus whose buildings are joined.
//!
//! The centre line is a fixed sketch of 12 corners (two of its lines oblique), jittered and scaled to the length; each
//! line has its own width. Doors are mostly closed, some rooms are open, niches and blind corridors branch off.
//! Route: once around with a visit to a room now and then, then on over the first corridors again.

use super::face::Face;
use super::row::Row;
use super::visit::{self, Visit};
use crate::drive::Route;
use crate::world::World;
use groma_estimation::streams::Random;
use nalgebra::Vector2;

/// Length of the centre line [m].
const LENGTH: f64 = 1920.0;
/// Least distance between two rooms that are visited [m].
const VISIT_SPACING: f64 = 110.0;
/// The corners before scaling, counter-clockwise; lines along x or y are shifted as a whole.
const SKETCH: [(f64, f64); 12] = [
    (0.0, 0.0),
    (180.0, 0.0),
    (180.0, -42.0),
    (330.0, -42.0),
    (330.0, 60.0),
    (420.0, 118.0),
    (420.0, 255.0),
    (296.0, 255.0),
    (296.0, 338.0),
    (140.0, 338.0),
    (140.0, 248.0),
    (0.0, 205.0),
];

const CAMPUS: Row =
    Row { module: (3.2, 7.5), depth: (3.5, 6.0), open: 0.14, margin: 12.0, clutter: 0.45, niches: (0.35, 6.0) };

/// Draws the campus and its route.
#[must_use]
pub fn build(random: &mut Random) -> (World, Route) {
    let center = center_line(random);
    let widths: Vec<f64> = center.iter().map(|_| random.uniform(1.0, 1.6)).collect();
    let outer = Face::around(&beside(&center, &widths, 1.0));
    let mut inner_corners = beside(&center, &widths, -1.0);
    inner_corners.reverse();
    let inner = Face::around(&inner_corners);
    let (mut world, mut visits) = (World::default(), vec![]);
    let n = center.len();
    let distances = (0..n).map(|k| widths[k]).chain((0..n).map(|k| widths[(2 * n - 2 - k) % n]));
    for (face, distance) in outer.into_iter().chain(inner).zip(distances) {
        let features = CAMPUS.features(&face, random);
        face.draw(&mut world, &features, random);
        visits.extend(Visit::behind(&face, &features, distance));
    }
    (world, route(&center, &visits, random))
}

fn center_line(random: &mut Random) -> Vec<Vector2<f64>> {
    let mut points = SKETCH.map(|(x, y)| Vector2::new(x, y));
    let n = points.len();
    for k in 0..n {
        let (next, by) = ((k + 1) % n, random.uniform(-7.0, 7.0));
        let upright = (points[next] - points[k]).map(|e| e == 0.0);
        for axis in (0..2).filter(|&axis| upright[axis]) {
            points[k][axis] += by;
            points[next][axis] += by;
        }
    }
    let length: f64 = (0..n).map(|k| (points[(k + 1) % n] - points[k]).norm()).sum();
    points.iter().map(|p| p * (LENGTH / length)).collect()
}

/// The closed line beside the centre line: `side` 1 on the right of it, -1 on the left, each edge at its own distance.
fn beside(center: &[Vector2<f64>], widths: &[f64], side: f64) -> Vec<Vector2<f64>> {
    let n = center.len();
    let edge = |k: usize| {
        let d = (center[(k + 1) % n] - center[k % n]).normalize();
        (center[k % n] + Vector2::new(d.y, -d.x) * (side * widths[k % n]), d)
    };
    let corner = |k: usize| {
        let ((p, d), (q, e)) = (edge(k + n - 1), edge(k));
        let turn = d.perp(&e);
        if turn.abs() < 1e-9 { q } else { p + d * ((q - p).perp(&e) / turn) }
    };
    (0..n).map(corner).collect()
}

fn route(center: &[Vector2<f64>], visits: &[Visit], random: &mut Random) -> Route {
    let start = center[0] + (center[1] - center[0]) * 0.35;
    let mut corners = vec![start];
    corners.extend(&center[1..]);
    corners.extend(&center[..3]);
    let mut route = Route::from(start);
    for line in corners.windows(2) {
        for visit in visit::on_line(visits, line[0], line[1], VISIT_SPACING) {
            visit::call(&mut route, &visit, random);
        }
        route.to(line[1]);
    }
    route.to(center[2] + (center[3] - center[2]) * 0.25);
    route
}

//! Places beside a route that can be visited: the rooms behind open doors.

use super::face::{Face, Feature, Placed, THICKNESS};
use crate::drive::Route;
use groma_estimation::streams::Random;
use nalgebra::Vector2;

/// How far from its ends a line of the route has room for a turn into a door [m].
const MARGIN: f64 = 1.5;
/// How near to the line the point before the door must lie [m].
const ON_LINE: f64 = 0.05;

/// A room to visit.
#[derive(Clone, Copy, Debug)]
pub struct Visit {
    /// On the route, before the door [m].
    pub outside: Vector2<f64>,
    /// In the room [m].
    pub inside: Vector2<f64>,
}

impl Visit {
    /// The rooms behind the open doors of a face that runs `distance` [m] beside the route.
    #[must_use]
    pub fn behind(face: &Face, features: &[Placed], distance: f64) -> Vec<Self> {
        let visit = |placed: &Placed| match &placed.feature {
            Feature::Open(room) => Some(Self {
                outside: face.point(placed.u, distance),
                inside: face.point(placed.u, -THICKNESS - room.reach),
            }),
            _ => None,
        };
        features.iter().filter_map(visit).collect()
    }
}

/// Visits that lie on the line from `a` to `b`, in order, at least `spacing` [m] apart.
#[must_use]
pub fn on_line(visits: &[Visit], a: Vector2<f64>, b: Vector2<f64>, spacing: f64) -> Vec<Visit> {
    let (length, along) = ((b - a).norm(), (b - a).normalize());
    let mut found: Vec<(f64, Visit)> = visits
        .iter()
        .map(|visit| (*visit, visit.outside - a))
        .filter(|(_, d)| d.perp(&along).abs() < ON_LINE)
        .map(|(visit, d)| (d.dot(&along), visit))
        .filter(|(s, _)| (MARGIN..length - MARGIN).contains(s))
        .collect();
    found.sort_by(|x, y| x.0.total_cmp(&y.0));
    let mut last = f64::NEG_INFINITY;
    found.retain(|(s, _)| {
        let keep = s - last >= spacing;
        last = if keep { *s } else { last };
        keep
    });
    found.into_iter().map(|(_, visit)| visit).collect()
}

/// Goes in, stands a moment, and comes out again.
pub fn call(route: &mut Route, visit: &Visit, random: &mut Random) {
    route.to(visit.outside);
    route.to(visit.inside);
    route.stop(random.uniform(0.5, 2.0));
    route.to(visit.outside);
}

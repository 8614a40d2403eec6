//! A route: legs of straight lines with rounded corners, a stop at the end of each leg.
//!
//! A corner between directions that differ by phi is rounded by an arc of radius r that begins and ends
//! `r tan(phi / 2)` from the corner; r shrinks where a line is too short for it. A vehicle that can turn on the spot does so
//! between legs; one that cannot must be given legs that go on in the direction in which the last one ended.

use groma_geometry::wrap;
use nalgebra::Vector2;

/// Length of the chords by which an arc is drawn [m].
const CHORD: f64 = 0.05;
/// Share of a line that the arc at one of its ends may use up.
const SHARE: f64 = 0.49;

/// A stretch driven without a stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// Corners, first and last point included [m].
    pub points: Vec<Vector2<f64>>,
    /// Time spent standing at the end [s].
    pub pause: f64,
}

/// Legs to be driven one after the other; each begins where the last one ended.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Route {
    /// The legs.
    pub legs: Vec<Leg>,
}

impl Route {
    /// A route that starts at `point` [m].
    #[must_use]
    pub fn from(point: Vector2<f64>) -> Self {
        Self { legs: vec![Leg { points: vec![point], pause: 0.0 }] }
    }

    /// Goes on to `point` [m].
    pub fn to(&mut self, point: Vector2<f64>) {
        if let Some(leg) = self.legs.last_mut()
            && leg.points.last().is_none_or(|last| (last - point).norm() > 1e-6)
        {
            leg.points.push(point);
        }
    }

    /// Stops for `pause` seconds; the next leg starts here.
    pub fn stop(&mut self, pause: f64) {
        if let Some(leg) = self.legs.last_mut()
            && let Some(&here) = leg.points.last()
            && leg.points.len() > 1
        {
            leg.pause = pause;
            self.legs.push(Leg { points: vec![here], pause: 0.0 });
        }
    }

    /// The paths of all legs that lead anywhere, corners rounded with `radius` [m], and the pause after each [s].
    #[must_use]
    pub fn paths(&self, radius: f64) -> Vec<(Path, f64)> {
        let leads = |leg: &&Leg| leg.points.len() > 1;
        self.legs.iter().filter(leads).map(|leg| (Path::new(&rounded(&leg.points, radius)), leg.pause)).collect()
    }
}

/// A polyline measured along its length.
#[derive(Clone, Debug)]
pub struct Path {
    points: Vec<Vector2<f64>>,
    lengths: Vec<f64>,
}

impl Path {
    /// Through at least two points.
    #[must_use]
    pub fn new(points: &[Vector2<f64>]) -> Self {
        let mut lengths = vec![0.0];
        for (k, pair) in points.windows(2).enumerate() {
            lengths.push(lengths[k] + (pair[1] - pair[0]).norm());
        }
        Self { points: points.to_vec(), lengths }
    }

    /// Its length [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.lengths.last().copied().unwrap_or(0.0)
    }

    /// The point after `s` metres; straight on beyond the ends.
    #[must_use]
    pub fn at(&self, s: f64) -> Vector2<f64> {
        let k = self.lengths.partition_point(|&l| l <= s).clamp(1, self.points.len() - 1);
        let (a, b) = (self.points[k - 1], self.points[k]);
        a + (b - a) * ((s - self.lengths[k - 1]) / (self.lengths[k] - self.lengths[k - 1]))
    }

    /// Direction of travel after `s` metres [rad].
    #[must_use]
    pub fn heading(&self, s: f64) -> f64 {
        let k = self.lengths.partition_point(|&l| l <= s).clamp(1, self.points.len() - 1);
        let e = self.points[k] - self.points[k - 1];
        e.y.atan2(e.x)
    }

    /// Length at the point nearest to `p` within `[s, s + window]`, for a vehicle that moves on from `s`.
    #[must_use]
    pub fn progress(&self, p: Vector2<f64>, s: f64, window: f64) -> f64 {
        let mut best = (f64::INFINITY, s);
        let first = self.lengths.partition_point(|&l| l <= s).clamp(1, self.points.len() - 1);
        for k in first..self.points.len() {
            if self.lengths[k - 1] > s + window {
                break;
            }
            let e = self.points[k] - self.points[k - 1];
            let along = (p - self.points[k - 1]).dot(&e) / e.norm();
            let l = self.lengths[k - 1] + along.clamp(0.0, e.norm());
            let distance = (self.at(l) - p).norm();
            if distance < best.0 {
                best = (distance, l);
            }
        }
        best.1.max(s)
    }
}

fn rounded(points: &[Vector2<f64>], radius: f64) -> Vec<Vector2<f64>> {
    let mut out = vec![points[0]];
    for triple in points.windows(3) {
        arc(triple[0], triple[1], triple[2], radius, &mut out);
    }
    out.push(points[points.len() - 1]);
    out
}

/// Appends the arc that rounds corner `b` between `a` and `c`.
fn arc(a: Vector2<f64>, b: Vector2<f64>, c: Vector2<f64>, radius: f64, out: &mut Vec<Vector2<f64>>) {
    let (before, after) = (b - a, c - b);
    let turn = wrap(after.y.atan2(after.x) - before.y.atan2(before.x));
    let half = (turn / 2.0).tan().abs();
    let room = SHARE * before.norm().min(after.norm());
    let r = radius.min(room / half.max(1e-9));
    if turn.abs() < 1e-3 || r < CHORD {
        out.push(b);
        return;
    }
    let (d, left) = (before.normalize(), Vector2::new(-before.y, before.x).normalize() * turn.signum());
    let start = b - d * (r * half);
    let pieces = (r * turn.abs() / CHORD).ceil() as usize;
    for k in 0..=pieces {
        let (sin, cos) = (turn.abs() * k as f64 / pieces as f64).sin_cos();
        out.push(start + d * (r * sin) + left * (r * (1.0 - cos)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_a_right_angle_tangentially() {
        let v = Vector2::new;
        let mut route = Route::from(v(0.0, 0.0));
        route.to(v(10.0, 0.0));
        route.to(v(10.0, 10.0));
        let (path, pause) = route.paths(2.0).remove(0);
        assert_eq!(pause, 0.0);
        assert!((path.length() - (16.0 + std::f64::consts::PI)).abs() < 1e-3);
        assert!((path.at(8.0 + std::f64::consts::FRAC_PI_2) - v(8.0, 2.0)).norm() - 2.0 < 1e-3);
        assert!((path.at(30.0).x - 10.0).abs() < 1e-9);
        assert!((path.progress(v(5.0, 0.3), 4.0, 2.0) - 5.0).abs() < 1e-12);
    }
}

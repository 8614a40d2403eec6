//! One surface and the meeting of a beam with it.
//!
//! With the beam `o + t d`, `|d| = 1`, and a segment `a + u e`, `e = b - a`, the meeting solves
//!
//! ```text
//! t = (a - o) x e / (d x e),   u = (a - o) x d / (d x e),   0 <= u <= 1, t > 0
//! cos(incidence) = |d x e| / |e|
//! ```
//!
//! and with a circle (centre c, radius r, beam from outside), `m = c - o`, `p = m . d`, `h^2 = |m|^2 - p^2`:
//! `t = p - sqrt(r^2 - h^2)`, `cos(incidence) = sqrt(1 - h^2 / r^2)`.
//! A beam along a segment does not meet it; a beam that starts inside a circle does not meet it.

use nalgebra::Vector2;

/// What a surface looks like from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A straight piece between two points [m].
    Segment {
        /// One end.
        a: Vector2<f64>,
        /// The other end.
        b: Vector2<f64>,
    },
    /// A circle [m].
    Circle {
        /// Centre.
        center: Vector2<f64>,
        /// Radius.
        radius: f64,
    },
}

/// A shape that reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Where it is.
    pub shape: Shape,
    /// Share of the light that a diffuse wall would send back; far above 1 for a retro-reflector.
    pub reflectivity: f64,
}

impl Shape {
    /// Distance [m] along the unit vector `direction` from `origin`, and cosine of the angle of incidence.
    #[must_use]
    pub fn meet(&self, origin: Vector2<f64>, direction: Vector2<f64>) -> Option<(f64, f64)> {
        match *self {
            Self::Segment { a, b } => meet_segment(origin, direction, a, b),
            Self::Circle { center, radius } => meet_circle(origin, direction, center, radius),
        }
    }

    /// Shortest distance from `p` to the surface [m].
    #[must_use]
    pub fn distance(&self, p: Vector2<f64>) -> f64 {
        match *self {
            Self::Segment { a, b } => {
                let e = b - a;
                let u = ((p - a).dot(&e) / e.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
                (a + e * u - p).norm()
            }
            Self::Circle { center, radius } => ((p - center).norm() - radius).abs(),
        }
    }

    /// Lower and upper corner of the box around it [m].
    #[must_use]
    pub fn bounds(&self) -> (Vector2<f64>, Vector2<f64>) {
        match *self {
            Self::Segment { a, b } => (a.inf(&b), a.sup(&b)),
            Self::Circle { center, radius } => (center.add_scalar(-radius), center.add_scalar(radius)),
        }
    }
}

fn meet_segment(o: Vector2<f64>, d: Vector2<f64>, a: Vector2<f64>, b: Vector2<f64>) -> Option<(f64, f64)> {
    let e = b - a;
    let slope = d.perp(&e);
    if slope == 0.0 {
        return None;
    }
    let (t, u) = ((a - o).perp(&e) / slope, (a - o).perp(&d) / slope);
    (t > 0.0 && (0.0..=1.0).contains(&u)).then(|| (t, slope.abs() / e.norm()))
}

fn meet_circle(o: Vector2<f64>, d: Vector2<f64>, center: Vector2<f64>, radius: f64) -> Option<(f64, f64)> {
    let m = center - o;
    let (p, miss) = (m.dot(&d), m.perp(&d));
    let inside = radius * radius - miss * miss;
    if inside < 0.0 {
        return None;
    }
    let t = p - inside.sqrt();
    (t > 0.0).then(|| (t, inside.sqrt() / radius))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meets_by_hand() {
        let v = Vector2::new;
        let wall = Shape::Segment { a: v(2.0, -1.0), b: v(2.0, 1.0) };
        assert_eq!(wall.meet(v(0.0, 0.5), v(1.0, 0.0)), Some((2.0, 1.0)));
        assert_eq!(wall.meet(v(0.0, 0.5), v(-1.0, 0.0)), None);
        assert_eq!(wall.meet(v(0.0, 1.5), v(1.0, 0.0)), None);
        let pillar = Shape::Circle { center: v(3.0, 0.0), radius: 1.0 };
        assert_eq!(pillar.meet(v(0.0, 0.0), v(1.0, 0.0)), Some((2.0, 1.0)));
        assert_eq!(pillar.meet(v(3.0, 0.0), v(1.0, 0.0)), None);
        assert_eq!(pillar.distance(v(3.0, 3.0)), 2.0);
        assert_eq!(wall.distance(v(5.0, 5.0)), 5.0);
    }
}

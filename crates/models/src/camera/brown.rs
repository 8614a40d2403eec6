//! Radial-tangential lenses, as a quotient of polynomials.
//!
//! With `x = X/Z`, `y = Y/Z`, `s = x^2 + y^2`:
//!
//! ```text
//! L(s) = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
//! m_x  = x L + 2 p1 x y + p2 (s + 2 x^2)
//! m_y  = y L + p1 (s + 2 y^2) + 2 p2 x y
//! ```
//!
//! coefficients in the order k1 k2 p1 p2 k3 k4 k5 k6. The radius `r L(r^2)` rises up to a limit; the inverse starts from
//! the radial part alone, which is a root in one variable, and ends with Newton's steps in the plane.
//! Source: D. C. Brown, Photogrammetric Engineering 37 (1971) 855; OpenCV 4.x, calib3d.

use super::distortion::{Coefficients, Distorted, first_turn, rising_root};
use nalgebra::{Matrix2, Matrix2x3, SMatrix, Vector2, Vector3};

/// Radius in the plane z = 1 up to which anything is asked: 88.6 degrees from the axis.
const MOST: f64 = 40.0;
/// Newton's method in the plane has the direction when it misses by less.
const CLOSE: f64 = 1e-13;

/// L and its derivatives in s and in the six radial coefficients (k1, k2, k3, k4, k5, k6).
struct Radial {
    value: f64,
    slope: f64,
    by_coefficients: [f64; 6],
}

fn radial(k: &Coefficients, s: f64) -> Radial {
    let [k1, k2, _, _, k3, k4, k5, k6] = *k;
    let above = 1.0 + s * (k1 + s * (k2 + s * k3));
    let below = 1.0 + s * (k4 + s * (k5 + s * k6));
    let value = above / below;
    let above_slope = k1 + s * (2.0 * k2 + s * 3.0 * k3);
    let below_slope = k4 + s * (2.0 * k5 + s * 3.0 * k6);
    let powers = [s / below, s * s / below, s * s * s / below];
    let by_coefficients = [powers[0], powers[1], powers[2], -value * powers[0], -value * powers[1], -value * powers[2]];
    Radial { value, slope: (above_slope - value * below_slope) / below, by_coefficients }
}

/// `d(r L(r^2))/dr`.
fn growth(k: &Coefficients, r: f64) -> f64 {
    let l = radial(k, r * r);
    l.value + 2.0 * r * r * l.slope
}

pub(super) fn limit(k: &Coefficients) -> f64 {
    first_turn(|r| growth(k, r), MOST)
}

pub(super) fn distort(k: &Coefficients, limit: f64, point: &Vector3<f64>) -> Option<Distorted> {
    let (x, y) = (point.x / point.z, point.y / point.z);
    if point.z <= 0.0 || (x * x + y * y).sqrt() > limit {
        return None;
    }
    let (direction, by_plane, by_coefficients) = in_plane(k, x, y);
    let by_point = by_plane * Matrix2x3::new(1.0, 0.0, -x, 0.0, 1.0, -y) / point.z;
    direction.iter().all(|v| v.is_finite()).then_some(Distorted { direction, by_point, by_coefficients })
}

/// m and its derivatives in (x, y) and in the coefficients.
fn in_plane(k: &Coefficients, x: f64, y: f64) -> (Vector2<f64>, Matrix2<f64>, SMatrix<f64, 2, 8>) {
    let (p1, p2) = (k[2], k[3]);
    let s = x * x + y * y;
    let l = radial(k, s);
    let direction = Vector2::new(
        x * l.value + 2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
        y * l.value + p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let shear = 2.0 * x * y * l.slope + 2.0 * p1 * x + 2.0 * p2 * y;
    let by_plane = Matrix2::new(
        l.value + 2.0 * x * x * l.slope + 2.0 * p1 * y + 6.0 * p2 * x,
        shear,
        shear,
        l.value + 2.0 * y * y * l.slope + 6.0 * p1 * y + 2.0 * p2 * x,
    );
    let [k1, k2, k3, k4, k5, k6] = l.by_coefficients;
    let p = Vector2::new(x, y);
    let columns = [
        p * k1,
        p * k2,
        Vector2::new(2.0 * x * y, s + 2.0 * y * y),
        Vector2::new(s + 2.0 * x * x, 2.0 * x * y),
        p * k3,
        p * k4,
        p * k5,
        p * k6,
    ];
    (direction, by_plane, SMatrix::from_columns(&columns))
}

pub(super) fn undistort(k: &Coefficients, limit: f64, m: &Vector2<f64>) -> Option<Vector3<f64>> {
    let wanted = m.norm();
    let radius = |r: f64| (r * radial(k, r * r).value - wanted, growth(k, r));
    let r = rising_root(radius, wanted, limit)?;
    let mut p = if wanted > 0.0 { m * (r / wanted) } else { *m };
    for _ in 0..20 {
        let (reached, slope, _) = in_plane(k, p.x, p.y);
        let miss = reached - m;
        p -= slope.try_inverse()? * miss;
        if miss.norm() <= CLOSE * (1.0 + wanted) {
            return (p.norm() <= limit).then(|| Vector3::new(p.x, p.y, 1.0).normalize());
        }
    }
    None
}

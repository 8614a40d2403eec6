//! The fisheye lens of Kannala and Brandt, as in Kalibr ("equi") and OpenCV ("fisheye").
//!
//! With `r = sqrt(X^2 + Y^2)` and the angle to the axis `a = atan2(r, Z)`:
//!
//! ```text
//! f(a) = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8),   m = f(a) (X, Y) / r
//! ```
//!
//! It sees points behind the camera too, as far as f rises. On the axis `(X, Y)/r` has no value; there the limit
//! `m = (X, Y)/Z` is used. Source: Kannala, Brandt, PAMI 28 (2006) 1335.

use super::distortion::{Coefficients, Distorted, first_turn, rising_root};
use nalgebra::{Matrix2, Matrix2x3, SMatrix, Vector2, Vector3};
use std::f64::consts::PI;

/// Share of the distance below which a point counts as on the axis; the terms left out are of its square.
const ON_AXIS: f64 = 1e-9;

/// f and its slope.
fn image_radius(k: &Coefficients, a: f64) -> (f64, f64) {
    let s = a * a;
    let value = a * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
    let slope = 1.0 + s * (3.0 * k[0] + s * (5.0 * k[1] + s * (7.0 * k[2] + s * 9.0 * k[3])));
    (value, slope)
}

pub(super) fn limit(k: &Coefficients) -> f64 {
    first_turn(|a| image_radius(k, a).1, PI)
}

pub(super) fn distort(k: &Coefficients, limit: f64, point: &Vector3<f64>) -> Option<Distorted> {
    let (r, length_sq) = (point.xy().norm(), point.norm_squared());
    if r <= ON_AXIS * point.z {
        return Some(on_axis(point));
    }
    let a = r.atan2(point.z);
    let (f, slope) = image_radius(k, a);
    if a > limit || !f.is_finite() {
        return None;
    }
    let n = point.xy() / r;
    // da = (z n . dxy - r dz) / |p|^2, and the direction n turns across itself by (I - n n^T) dxy / r.
    let radial = n * n.transpose();
    let by_plane = radial * (slope * point.z / length_sq) + (Matrix2::identity() - radial) * (f / r);
    let by_depth = n * (-slope * r / length_sq);
    let by_point = Matrix2x3::from_columns(&[by_plane.column(0).into(), by_plane.column(1).into(), by_depth]);
    let mut by_coefficients = SMatrix::<f64, 2, 8>::zeros();
    for power in 0..4 {
        by_coefficients.set_column(power, &(n * a.powi(2 * power as i32 + 3)));
    }
    Some(Distorted { direction: n * f, by_point, by_coefficients })
}

fn on_axis(point: &Vector3<f64>) -> Distorted {
    let direction = point.xy() / point.z;
    let by_point = Matrix2x3::new(1.0, 0.0, -direction.x, 0.0, 1.0, -direction.y) / point.z;
    Distorted { direction, by_point, by_coefficients: SMatrix::zeros() }
}

pub(super) fn undistort(k: &Coefficients, limit: f64, m: &Vector2<f64>) -> Option<Vector3<f64>> {
    let wanted = m.norm();
    if wanted == 0.0 {
        return Some(Vector3::z());
    }
    let a = rising_root(|a| (image_radius(k, a).0 - wanted, image_radius(k, a).1), wanted, limit)?;
    let (sine, cosine) = a.sin_cos();
    let n = m / wanted;
    Some(Vector3::new(n.x * sine, n.y * sine, cosine))
}

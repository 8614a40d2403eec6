//! What the lens models have in common: coefficients, a distorted direction with its derivatives, and roots of the image radius.

use nalgebra::{Matrix2x3, SMatrix, Vector2};

/// Coefficients of any lens, padded with zeros.
pub(super) type Coefficients = [f64; 8];

/// The direction that a lens makes of a point, with derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Distorted {
    pub direction: Vector2<f64>,
    pub by_point: Matrix2x3<f64>,
    pub by_coefficients: SMatrix<f64, 2, 8>,
}

/// Where a slope that starts above zero first reaches it, up to `most`; `most` when it never does.
pub(super) fn first_turn(slope: impl Fn(f64) -> f64, most: f64) -> f64 {
    const STEPS: u32 = 400;
    let at = |k: u32| most * (f64::from(k) / f64::from(STEPS)).powi(2);
    let Some(k) = (1..=STEPS).find(|&k| slope(at(k)) <= 0.0) else { return most };
    let (mut low, mut high) = (at(k - 1), at(k));
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        *(if slope(middle) > 0.0 { &mut low } else { &mut high }) = middle;
    }
    low
}

/// The root of a rising function in `0 ..= most`, by Newton's steps kept inside a shrinking bracket; nothing when the
/// function does not reach zero there.
pub(super) fn rising_root(value_and_slope: impl Fn(f64) -> (f64, f64), start: f64, most: f64) -> Option<f64> {
    if value_and_slope(most).0 < 0.0 {
        return None;
    }
    let (mut low, mut high, mut x) = (0.0, most, start.clamp(0.0, most));
    for _ in 0..100 {
        let (value, slope) = value_and_slope(x);
        *(if value < 0.0 { &mut low } else { &mut high }) = x;
        let newton = x - value / slope;
        let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - x).abs() <= 1e-15 * (1.0 + x) {
            return Some(next);
        }
        x = next;
    }
    Some(x)
}

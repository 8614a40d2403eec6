//! What the lens models have in common: coefficients, a distorted direction with its derivatives, and roots of the image radius.

use groma_estimation::root;
use nalgebra::{Matrix2x3, SMatrix, Vector2};
use std::convert::Infallible;

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
    let Ok((low, _)) = root::bisect((at(k - 1), at(k)), 50, |x| Ok::<_, Infallible>(slope(x) > 0.0));
    low
}

/// The root of a rising function in `0 ..= most`; nothing when the function does not reach zero there.
pub(super) fn rising_root(value_and_slope: impl Fn(f64) -> (f64, f64), start: f64, most: f64) -> Option<f64> {
    let reaches = value_and_slope(most).0 >= 0.0;
    reaches.then(|| root::newton((0.0, most), start.clamp(0.0, most), value_and_slope, |x| 1e-15 * (1.0 + x)))
}

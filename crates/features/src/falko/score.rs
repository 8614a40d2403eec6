//! How cleanly the points around a corner lie in two arms.
//!
//! The score of an arm is the sum over its pairs of points of the distance of their sectors on a ring of s sectors.
//! On a ring of an even s, the distance of two sectors is the number of the s/2 diameters that separate them, so
//!
//! ```text
//! sum over pairs of d(u, v) = sum over diameters c of H_c (N - H_c),   H_c = points on one side of diameter c
//! ```
//!
//! an exact integer identity that needs neither sectors, nor angles, nor pairs: O(N) in place of O(N^2).

use super::neighbourhood::{Arm, Arms};
use nalgebra::Vector2;

/// The diameters of the ring: the first s/2 sector borders, for a ring whose sector 0 begins at angle 0.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    diameters: Vec<Vector2<f64>>,
}

impl Ring {
    /// A ring of `sectors` sectors.
    pub fn new(sectors: u32) -> Self {
        let width = std::f64::consts::TAU / f64::from(sectors);
        let diameter = |c| {
            let (sin, cos) = (f64::from(c) * width).sin_cos();
            Vector2::new(cos, sin)
        };
        Self { diameters: (0..sectors / 2).map(diameter).collect() }
    }

    /// The score of a corner that opens towards `opening` (any length); sector 0 begins there.
    pub fn score(&self, arms: &Arms, opening: Vector2<f64>) -> u64 {
        let along =
            |d: &Vector2<f64>| Vector2::new(opening.x * d.x - opening.y * d.y, opening.y * d.x + opening.x * d.y);
        self.diameters.iter().map(along).map(|d| separated(&arms.left, d) + separated(&arms.right, d)).sum()
    }
}

/// Pairs of an arm that the line through the corner along `d` separates.
fn separated(arm: &Arm, d: Vector2<f64>) -> u64 {
    let beyond = |(&x, &y): (&f64, &f64)| u32::from(d.x * y - d.y * x >= 0.0);
    let one_side = u64::from(arm.x.iter().zip(&arm.y).map(beyond).sum::<u32>());
    one_side * (arm.len() as u64 - one_side)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    /// The definition: sectors, and all pairs.
    fn by_pairs(arm: &Arm, opening: f64, sectors: i64) -> i64 {
        let sector = |i: usize| {
            let angle = (arm.y[i].atan2(arm.x[i]) - opening).rem_euclid(TAU);
            (angle / (TAU / sectors as f64)).floor() as i64
        };
        let distance = |i, j| ((sector(i) - sector(j) + sectors / 2).rem_euclid(sectors) - sectors / 2).abs();
        (0..arm.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| distance(i, j)).sum()
    }

    fn arm(points: &[(f64, f64)]) -> Arm {
        Arm { x: points.iter().map(|p| p.0).collect(), y: points.iter().map(|p| p.1).collect() }
    }

    proptest! {
        #[test]
        fn equals_the_sum_over_pairs(
            left in prop::collection::vec((-1.0..1.0, -1.0..1.0), 0..40),
            right in prop::collection::vec((-1.0..1.0, -1.0..1.0), 0..40),
            opening in -7.0..7.0_f64,
            half in 1_u32..13,
        ) {
            let arms = Arms { left: arm(&left), right: arm(&right) };
            let fast = Ring::new(2 * half).score(&arms, 0.3 * Vector2::new(opening.cos(), opening.sin()));
            let sectors = i64::from(2 * half);
            let slow = by_pairs(&arms.left, opening, sectors) + by_pairs(&arms.right, opening, sectors);
            prop_assert_eq!(fast as i64, slow);
        }
    }
}

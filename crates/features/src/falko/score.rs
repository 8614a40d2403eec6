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

use super::neighbourhood::{Arm, Arms, LANES, Lanes};
use nalgebra::Vector2;

/// The diameters of the ring: the first s/2 sector borders, for a ring whose sector 0 begins at angle 0.
#[derive(Clone, Debug)]
pub(super) struct Ring {
    /// Coordinates x, y; diameters that fill up the last lanes are zero and separate nothing.
    diameters: Vec<(Lanes, Lanes)>,
}

impl Ring {
    /// A ring of `sectors` sectors.
    pub fn new(sectors: u32) -> Self {
        let width = std::f64::consts::TAU / f64::from(sectors);
        let all: Vec<(f64, f64)> = (0..sectors / 2).map(|c| (f64::from(c) * width).sin_cos()).collect();
        let lanes = |chunk: &[(f64, f64)]| {
            let mut lanes = ([0.0; LANES], [0.0; LANES]);
            chunk.iter().enumerate().for_each(|(k, (sin, cos))| (lanes.0[k], lanes.1[k]) = (*cos, *sin));
            lanes
        };
        Self { diameters: all.chunks(LANES).map(lanes).collect() }
    }

    /// The score of a corner that opens towards `opening` (any length); sector 0 begins there.
    #[inline(always)]
    pub fn score(&self, arms: &Arms, opening: Vector2<f64>) -> u64 {
        let mut score = 0.0;
        for (x, y) in &self.diameters {
            let mut along = ([0.0; LANES], [0.0; LANES]);
            for c in 0..LANES {
                along.0[c] = opening.x * x[c] - opening.y * y[c];
                along.1[c] = opening.y * x[c] + opening.x * y[c];
            }
            score += separated(&arms.left, &along) + separated(&arms.right, &along);
        }
        score as u64
    }
}

/// Pairs of an arm that the lines through the corner separate, over all lines; exact, being whole numbers below 2^53.
#[inline(always)]
fn separated(arm: &Arm, (along_x, along_y): &(Lanes, Lanes)) -> f64 {
    let mut one_side = [0.0; LANES];
    let (x, y) = arm.points();
    for (x, y) in x.iter().zip(y) {
        for c in 0..LANES {
            one_side[c] += if along_x[c] * y - along_y[c] * x >= 0.0 { 1.0 } else { 0.0 };
        }
    }
    let points = arm.len() as f64;
    let mut pairs = 0.0;
    for h in one_side {
        pairs += h * (points - h);
    }
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    /// The definition: sectors, and all pairs.
    fn by_pairs(arm: &Arm, opening: f64, sectors: i64) -> i64 {
        let sector = |i: usize| {
            let angle = (arm.points().1[i].atan2(arm.points().0[i]) - opening).rem_euclid(TAU);
            (angle / (TAU / sectors as f64)).floor() as i64
        };
        let distance = |i, j| ((sector(i) - sector(j) + sectors / 2).rem_euclid(sectors) - sectors / 2).abs();
        (0..arm.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| distance(i, j)).sum()
    }

    proptest! {
        #[test]
        fn equals_the_sum_over_pairs(
            left in prop::collection::vec((-1.0..1.0, -1.0..1.0), 0..40),
            right in prop::collection::vec((-1.0..1.0, -1.0..1.0), 0..40),
            opening in -7.0..7.0_f64,
            half in 1_u32..13,
        ) {
            let arms = Arms { left: Arm::of(&left), right: Arm::of(&right) };
            let fast = Ring::new(2 * half).score(&arms, 0.3 * Vector2::new(opening.cos(), opening.sin()));
            let sectors = i64::from(2 * half);
            let slow = by_pairs(&arms.left, opening, sectors) + by_pairs(&arms.right, opening, sectors);
            prop_assert_eq!(fast as i64, slow);
        }
    }
}

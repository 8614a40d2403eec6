//! One signature, and how far two are apart.

use super::Options;
use super::kernel::{Circular, Linear};
use nalgebra::Vector2;
use std::f64::consts::PI;

/// Sum of the bins of a signature, at most: two of them still fit a `u16`, so that a distance cannot overflow.
const FULL: f64 = 32767.0;

/// The histogram of the pairs of a set of landmarks, in whole parts of about 1/32767.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    n_theta: usize,
    n_rho: usize,
    /// Rows of equal direction, `n_rho` bins each.
    bins: Vec<u16>,
    /// Sums over the directions: they do not change when the set is turned.
    marginal: Vec<u16>,
}

impl Signature {
    /// The signature of landmarks at `points` [m]; the options are taken to be valid (see [`Options::validate`]).
    ///
    /// With no pair within `rho_max` it is empty: at distance 1 from every other.
    #[must_use]
    pub fn from_points(points: &[Vector2<f64>], options: &Options) -> Self {
        let &Options { n_theta, n_rho, .. } = options;
        let sums = accumulate(points, options);
        let total: f64 = sums.iter().sum();
        // Rounding adds at most half a part a bin.
        let scale = (FULL - 0.5 * sums.len() as f64) / total.max(1.0);
        let bins: Vec<u16> = sums.iter().map(|&s| (s * scale).round() as u16).collect();
        let marginal = (0..n_rho).map(|r| bins.iter().skip(r).step_by(n_rho).sum()).collect();
        Self { n_theta, n_rho, bins, marginal }
    }

    /// Distance to another signature, 0 to 1, and the rotation that takes the points of self onto those of other [rad],
    /// in `[0, pi)`: known up to half a turn.
    ///
    /// Signatures made with other bins, or empty ones, are at distance 1.
    #[must_use]
    pub fn distance(&self, other: &Self) -> (f64, f64) {
        let (l1, shift) = self.best_shift(other);
        (share(l1), self.rotation(other, shift))
    }

    /// Whether no pair counted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.marginal.iter().all(|&m| m == 0)
    }

    /// Least sum of absolute differences over all shifts of the directions, and the shift.
    pub(super) fn best_shift(&self, other: &Self) -> (u16, usize) {
        if !self.is_comparable(other) {
            return (u16::MAX, 0);
        }
        (0..self.n_theta).map(|shift| (self.at_shift(other, shift), shift)).min().unwrap_or((u16::MAX, 0))
    }

    /// A bound of the distance from below, whatever the shift.
    pub(super) fn bound(&self, other: &Self) -> u16 {
        if self.is_comparable(other) { l1(&self.marginal, &other.marginal) } else { u16::MAX }
    }

    /// The rotation that goes with the best shift, refined by a parabola through its neighbours.
    pub(super) fn rotation(&self, other: &Self, shift: usize) -> f64 {
        if !self.is_comparable(other) {
            return 0.0;
        }
        let n = self.n_theta;
        let at = |s: usize| f64::from(self.at_shift(other, s % n));
        let (before, here, after) = (at(shift + n - 1), at(shift), at(shift + 1));
        let curvature = before - 2.0 * here + after;
        let offset = if curvature > 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
        ((shift as f64 + offset) * PI / n as f64).rem_euclid(PI)
    }

    /// Whether both have pairs, over the same bins.
    pub(super) fn is_comparable(&self, other: &Self) -> bool {
        let same_bins = self.n_theta == other.n_theta && self.n_rho == other.n_rho;
        same_bins && !self.is_empty() && !other.is_empty()
    }

    /// Sum of absolute differences at one shift.
    pub(super) fn at_shift(&self, other: &Self, shift: usize) -> u16 {
        let cut = shift * self.n_rho;
        let (low, high) = self.bins.split_at(self.bins.len() - cut);
        l1(low, &other.bins[cut..]) + l1(high, &other.bins[..cut])
    }
}

/// Share of the pairs that differ.
pub(super) fn share(l1: u16) -> f64 {
    (0.5 * f64::from(l1) / FULL).min(1.0)
}

fn l1(a: &[u16], b: &[u16]) -> u16 {
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).sum()
}

/// Sums of the kernel over all pairs.
fn accumulate(points: &[Vector2<f64>], options: &Options) -> Vec<f64> {
    let &Options { n_theta, n_rho, rho_max, .. } = options;
    let (per_theta, per_rho) = (n_theta as f64 / PI, n_rho as f64 / rho_max);
    let circular = Circular::new(n_theta, options.sigma_theta * per_theta);
    let linear = Linear::new(n_rho, options.sigma_rho * per_rho);
    let mut sums = vec![0.0; n_theta * n_rho];
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let (theta, rho) = polar(a - b);
            if rho < rho_max {
                splat(&mut sums, n_rho, circular.at(theta * per_theta), linear.at(rho * per_rho));
            }
        }
    }
    sums
}

/// Direction in [0, pi) and length of a segment, equal to the bit for both orders of its ends.
fn polar(d: Vector2<f64>) -> (f64, f64) {
    let d = if d.y < 0.0 || (d.y == 0.0 && d.x < 0.0) { -d } else { d };
    (d.y.abs().atan2(d.x), d.norm())
}

fn splat(sums: &mut [f64], n_rho: usize, (first, weights): (usize, &[f64]), (from, row): (usize, &[f64])) {
    let (before, after) = sums.split_at_mut(first * n_rho);
    let rows = after.chunks_exact_mut(n_rho).chain(before.chunks_exact_mut(n_rho));
    for (bins, &w) in rows.zip(weights).filter(|(_, w)| **w > 0.0) {
        bins[from..].iter_mut().zip(row).for_each(|(bin, v)| *bin += w * v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;
    use proptest::prelude::*;

    fn points() -> impl Strategy<Value = Vec<Vector2<f64>>> {
        prop::collection::vec((-12.0..12.0, -12.0..12.0).prop_map(|(x, y)| Vector2::new(x, y)), 3..30)
    }

    proptest! {
        #[test]
        fn does_not_depend_on_the_order(mut p in points(), by in 1_usize..20) {
            let before = Signature::from_points(&p, &Options::default());
            let by = by % p.len();
            p.rotate_left(by);
            p.swap(0, by);
            prop_assert_eq!(before, Signature::from_points(&p, &Options::default()));
        }

        #[test]
        fn tells_the_turn_of_a_moved_set(p in points(), x in -5.0..5.0_f64, turn in 0.0..PI) {
            let options = Options::default();
            let moved: Vec<_> = p.iter().map(|&q| Se2::new(x, -x, turn).act(q)).collect();
            let (distance, rotation) =
                Signature::from_points(&p, &options).distance(&Signature::from_points(&moved, &options));
            let error = (rotation - turn + PI / 2.0).rem_euclid(PI) - PI / 2.0;
            prop_assert!(distance < 0.35, "{distance}");
            prop_assert!(error.abs() < 0.6 * PI / options.n_theta as f64, "{error}");
        }

        #[test]
        fn is_a_symmetric_distance(p in points(), q in points()) {
            let (p, q) = (Signature::from_points(&p, &Options::default()), Signature::from_points(&q, &Options::default()));
            prop_assert_eq!(p.distance(&p).0, 0.0);
            prop_assert_eq!(p.best_shift(&q).0, q.best_shift(&p).0);
            prop_assert!(p.bound(&q) <= p.best_shift(&q).0);
        }

        #[test]
        fn a_turn_by_whole_bins_changes_nothing(p in points(), bins in 0_usize..12) {
            let options = Options::default();
            let turn = bins as f64 * PI / options.n_theta as f64;
            let moved: Vec<_> = p.iter().map(|&q| Se2::new(0.0, 0.0, turn).act(q)).collect();
            let (distance, _) =
                Signature::from_points(&p, &options).distance(&Signature::from_points(&moved, &options));
            prop_assert!(distance < 0.01, "{distance}"); // only pairs on the border of two kernel steps may change
        }
    }

    #[test]
    fn empty_signatures_match_nothing() {
        let options = Options::default();
        let lone = Signature::from_points(&[Vector2::zeros()], &options);
        let far = Signature::from_points(&[Vector2::zeros(), Vector2::new(99.0, 0.0)], &options);
        let pair = Signature::from_points(&[Vector2::zeros(), Vector2::new(3.0, 0.0)], &options);
        assert!(lone.is_empty() && far.is_empty() && !pair.is_empty());
        assert_eq!(lone.distance(&lone).0, 1.0);
        assert_eq!(pair.distance(&far).0, 1.0);
        let other = Signature::from_points(&[Vector2::zeros(), Vector2::x()], &Options { n_rho: 32, ..options });
        assert_eq!(pair.distance(&other).0, 1.0);
    }
}

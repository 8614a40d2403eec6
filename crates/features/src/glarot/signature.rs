//! One signature, and how far two are apart.

use super::difference::{Line, l1_in_parts, lines, to_lines};
use super::halves::words;
use super::kernel::{Circular, Linear};
use super::options::{MOST_DIRECTIONS, Options};
use nalgebra::Vector2;
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::PI;

/// Sum of the bins of a signature, at most: two of them still fit a `u16`, so that a distance cannot overflow.
const FULL: f64 = 32767.0;

/// How two signatures differ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// 0 to 1.
    pub distance: f64,
    /// The rotation that takes the points of the first onto those of the second, in `[0, pi)`: known up to half a turn [rad].
    pub rotation: f64,
}

/// The histogram of the pairs of a set of landmarks, in whole parts of about 1/32767.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    pub(super) n_theta: usize,
    pub(super) n_rho: usize,
    /// Rows of equal direction, `n_rho` bins each.
    pub(super) bins: Vec<Line>,
    /// The same in half the bins.
    pub(super) halves: Vec<u64>,
    /// Sums over the directions: they do not change when the set is turned.
    pub(super) marginal: Vec<Line>,
    /// Whether no pair counted.
    empty: bool,
}

impl Signature {
    /// The signature of landmarks at `points` [m]; the options are assumed valid (see [`Options::validate`]).
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
        let marginal: Vec<u16> = (0..n_rho).map(|r| bins.iter().skip(r).step_by(n_rho).sum()).collect();
        Self {
            n_theta,
            n_rho,
            bins: to_lines(&bins, n_rho),
            halves: words(&bins, n_rho),
            marginal: to_lines(&marginal, n_rho),
            empty: total == 0.0,
        }
    }

    /// How this signature differs from another. Signatures made with other bins, or empty ones, are at distance 1.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Difference {
        let (l1, rotation) = self.compare(other);
        Difference { distance: share(l1), rotation }
    }

    /// Whether no pair counted.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.empty
    }

    /// Least sum of absolute differences over all shifts of the directions, and the rotation that goes with it.
    pub(super) fn compare(&self, other: &Self) -> (u16, f64) {
        if self.is_comparable(other) { Arch::new().dispatch(Compare(self, other)) } else { (u16::MAX, 0.0) }
    }

    /// Whether both have pairs, over the same bins.
    pub(super) fn is_comparable(&self, other: &Self) -> bool {
        let same_bins = self.n_theta == other.n_theta && self.n_rho == other.n_rho;
        same_bins && !self.is_empty() && !other.is_empty()
    }

    /// Sum of absolute differences at one shift.
    #[inline(always)]
    pub(super) fn at_shift(&self, other: &Self, shift: usize) -> u16 {
        let cut = shift * lines(self.n_rho);
        let (low, high) = self.bins.split_at(self.bins.len() - cut);
        l1_in_parts([(low, &other.bins[cut..]), (high, &other.bins[..cut])])
    }
}

/// The search over all shifts, compiled for each instruction set.
struct Compare<'a>(&'a Signature, &'a Signature);

impl WithSimd for Compare<'_> {
    type Output = (u16, f64);

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> (u16, f64) {
        let Self(a, b) = self;
        let (n, mut best, mut differences) = (a.n_theta, (u16::MAX, 0), [0; MOST_DIRECTIONS]);
        for (shift, difference) in differences[..n].iter_mut().enumerate() {
            *difference = a.at_shift(b, shift);
            best = best.min((*difference, shift));
        }
        let (here, shift) = best;
        let around = [differences[(shift + n - 1) % n], here, differences[(shift + 1) % n]];
        (here, rotation(n, shift, around))
    }
}

/// The rotation that goes with the best shift of `n_theta`, refined by a parabola through the differences before, at and after it.
pub(super) fn rotation(n_theta: usize, shift: usize, differences: [u16; 3]) -> f64 {
    let [before, here, after] = differences.map(f64::from);
    let curvature = before - 2.0 * here + after;
    let offset = if curvature > 0.0 { 0.5 * (before - after) / curvature } else { 0.0 };
    ((shift as f64 + offset) * PI / n_theta as f64).rem_euclid(PI)
}

/// Share of the pairs that differ.
pub(super) fn share(l1: u16) -> f64 {
    (0.5 * f64::from(l1) / FULL).min(1.0)
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
            let Difference { distance, rotation } =
                Signature::from_points(&p, &options).difference(&Signature::from_points(&moved, &options));
            let error = (rotation - turn + PI / 2.0).rem_euclid(PI) - PI / 2.0;
            prop_assert!(distance < 0.35, "{distance}");
            prop_assert!(error.abs() < 0.6 * PI / options.n_theta as f64, "{error}");
        }

        #[test]
        fn is_a_symmetric_distance(p in points(), q in points()) {
            let (p, q) = (Signature::from_points(&p, &Options::default()), Signature::from_points(&q, &Options::default()));
            prop_assert_eq!(p.difference(&p).distance, 0.0);
            prop_assert_eq!(p.compare(&q).0, q.compare(&p).0);
            prop_assert!(crate::glarot::difference::l1(&p.marginal, &q.marginal) <= p.compare(&q).0);
        }

        #[test]
        fn a_turn_by_whole_bins_changes_nothing(p in points(), bins in 0_usize..12) {
            let options = Options::default();
            let turn = bins as f64 * PI / options.n_theta as f64;
            let moved: Vec<_> = p.iter().map(|&q| Se2::new(0.0, 0.0, turn).act(q)).collect();
            let Difference { distance, .. } =
                Signature::from_points(&p, &options).difference(&Signature::from_points(&moved, &options));
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
        assert_eq!(lone.difference(&lone).distance, 1.0);
        assert_eq!(pair.difference(&far).distance, 1.0);
        let other = Signature::from_points(&[Vector2::zeros(), Vector2::x()], &Options { n_rho: 32, ..options });
        assert_eq!(pair.difference(&other).distance, 1.0);
    }
}

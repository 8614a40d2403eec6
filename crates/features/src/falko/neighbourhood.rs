//! The points around a beam.
//!
//! In the frame of beam i (origin at its point, x along the beam) neighbour `i +- k` of range rho_j is at
//! `(rho_j cos(k d) - rho_i, +- rho_j sin(k d))`, hence
//!
//! ```text
//! |p_j - p_i| <= r   <=>   rho_j (rho_j - 2 rho_i cos(k d)) <= r^2 - rho_i^2
//! ```
//!
//! which is four operations and no point.

use super::layout::{Layout, PaddedRanges};
use nalgebra::Vector2;

/// Most numbers in a vector.
pub(super) const LANES: usize = 8;

pub(super) type Lanes = [f64; LANES];

/// Whether the neighbour at range `rho_j` is within the radius: `twice_along` = 2 rho_i cos(k d), `slack` = r^2 - rho_i^2.
#[inline(always)]
fn is_near(rho_j: f64, twice_along: f64, slack: f64) -> bool {
    rho_j * (rho_j - twice_along) <= slack
}

/// The neighbours of one beam in its own frame, each side from near to far.
#[derive(Clone, Debug, Default)]
pub(super) struct Arms {
    pub left: Arm,
    pub right: Arm,
}

/// One side of a corner, coordinates apart.
#[derive(Clone, Debug, Default)]
pub(super) struct Arm {
    /// Coordinates; what is beyond `points` is left over from other beams.
    x: Vec<f64>,
    y: Vec<f64>,
    points: usize,
    sum: Vector2<f64>,
}

impl Arm {
    /// Number of points.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.points
    }

    /// Coordinates of the points.
    #[inline(always)]
    pub fn points(&self) -> (&[f64], &[f64]) {
        (&self.x[..self.points], &self.y[..self.points])
    }

    /// Pairs of points.
    #[inline(always)]
    fn pairs(&self) -> u64 {
        (self.points * self.points.saturating_sub(1) / 2) as u64
    }

    /// The farthest point by index; the origin where there is none.
    #[inline(always)]
    fn last(&self) -> Vector2<f64> {
        let (x, y) = self.points();
        Vector2::new(x.last().copied().unwrap_or(0.0), y.last().copied().unwrap_or(0.0))
    }

    /// Mean of the points.
    #[inline(always)]
    pub fn mean(&self) -> Vector2<f64> {
        self.sum / self.points as f64
    }

    /// No points yet, with room for `most`.
    #[inline(always)]
    fn clear(&mut self, most: usize) {
        (self.points, self.sum) = (0, Vector2::zeros());
        if self.x.len() < most + 1 {
            self.x.resize(most + 1, 0.0);
            self.y.resize(most + 1, 0.0);
        }
    }

    /// Add a point if it is `near`, without a branch: else the next one takes its place.
    #[inline(always)]
    fn offer(&mut self, x: f64, y: f64, near: bool) {
        (self.x[self.points], self.y[self.points]) = (x, y);
        self.points += usize::from(near);
        self.sum.x += if near { x } else { 0.0 };
        self.sum.y += if near { y } else { 0.0 };
    }

    #[cfg(test)]
    pub fn of(points: &[(f64, f64)]) -> Self {
        let mut arm = Self::default();
        arm.clear(points.len());
        points.iter().for_each(|p| arm.offer(p.0, p.1, true));
        arm
    }
}

impl Arms {
    /// Collect the neighbours of beam `i` out to index distance `reach`.
    #[inline(always)]
    pub fn gather(&mut self, ranges: &PaddedRanges, i: usize, radius: f64, reach: usize, layout: &Layout) {
        let (ahead, behind, rho) = (ranges.at_and_after(i), ranges.before(i), ranges.at(i));
        let (twice, slack) = (2.0 * rho, radius * radius - rho * rho);
        let (ahead, behind) = (&ahead[..reach + 1], &behind[behind.len() - reach..]);
        let (cos, sin) = (&layout.cos[..reach + 1], &layout.sin[..reach + 1]);
        self.left.clear(reach);
        self.right.clear(reach);
        for k in 1..=reach {
            let (right, left, twice_along) = (ahead[k], behind[reach - k], twice * cos[k]);
            self.right.offer(right * cos[k] - rho, right * sin[k], is_near(right, twice_along, slack));
            self.left.offer(left * cos[k] - rho, -(left * sin[k]), is_near(left, twice_along, slack));
        }
    }

    /// Pairs of points of one arm.
    #[inline(always)]
    pub fn pairs(&self) -> u64 {
        self.left.pairs() + self.right.pairs()
    }

    /// Squared height of the beam's own point over the line through the first and the last neighbour [m^2].
    #[inline(always)]
    pub fn height_sq(&self) -> f64 {
        let (first, last) = (self.left.last(), self.right.last());
        let twice_area = first.perp(&last);
        twice_area * twice_area / (last - first).norm_squared()
    }

    /// Direction into which the corner opens, not normalised.
    #[inline(always)]
    pub fn opening(&self) -> Vector2<f64> {
        self.left.mean() + self.right.mean()
    }
}

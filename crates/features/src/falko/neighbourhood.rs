//! The points around a beam, and whether they stand as a corner's triangle.
//!
//! In the frame of beam i (origin at its point, x along the beam) neighbour `i +- k` of range rho_j is at
//! `(rho_j cos(k d) - rho_i, +- rho_j sin(k d))`, hence
//!
//! ```text
//! |p_j - p_i| <= r   <=>   rho_j (rho_j - 2 rho_i cos(k d)) <= r^2 - rho_i^2
//! ```
//!
//! which is four operations and no point. The triangle needs the first and the last neighbour only, so the sweep keeps,
//! for several beams side by side, the largest k that passed on either side.

use super::layout::{Layout, PaddedRanges};
use nalgebra::Vector2;

/// Beams swept side by side.
pub(super) const LANES: usize = 8;

type Lanes = [f64; LANES];

/// Furthest neighbour of each beam of a group, as an index distance; 0 where there is none.
pub(super) struct Furthest {
    pub left: Lanes,
    pub right: Lanes,
}

/// Whether the neighbour at range `rho_j` is within the radius: `twice_along` = 2 rho_i cos(k d), `slack` = r^2 - rho_i^2.
#[inline(always)]
fn is_near(rho_j: f64, twice_along: f64, slack: f64) -> bool {
    rho_j * (rho_j - twice_along) <= slack
}

/// Sweep the neighbourhoods of the beams `first .. first + LANES` out to index distance `reach`.
///
/// `slack` is r^2 - rho^2 of each beam, minus infinity to leave a beam out.
#[inline]
pub(super) fn sweep(ranges: &PaddedRanges, first: usize, slack: &Lanes, reach: usize, layout: &Layout) -> Furthest {
    let mut furthest = Furthest { left: [0.0; LANES], right: [0.0; LANES] };
    let (ahead, behind) = (ranges.at_and_after(first), ranges.before(first + LANES));
    let Some(own) = ahead.first_chunk::<LANES>() else { return furthest };
    let twice: Lanes = own.map(|rho| 2.0 * rho);
    for k in 1..=reach {
        let along = layout.cos[k];
        let (Some(right), Some(left)) =
            (ahead[k..].first_chunk::<LANES>(), behind[..behind.len() - k].last_chunk::<LANES>())
        else {
            break;
        };
        for lane in 0..LANES {
            let twice_along = twice[lane] * along;
            let distance = k as f64;
            let at_right = if is_near(right[lane], twice_along, slack[lane]) { distance } else { 0.0 };
            let at_left = if is_near(left[lane], twice_along, slack[lane]) { distance } else { 0.0 };
            furthest.right[lane] = if at_right > furthest.right[lane] { at_right } else { furthest.right[lane] };
            furthest.left[lane] = if at_left > furthest.left[lane] { at_left } else { furthest.left[lane] };
        }
    }
    furthest
}

/// Whether base and height of the triangle (first, own, last) reach `least`: squared, so without a root.
pub(super) fn is_corner(first: Vector2<f64>, last: Vector2<f64>, least: f64) -> bool {
    let (base, twice_area) = (last - first, last.perp(&first));
    let (least_sq, base_sq) = (least * least, base.norm_squared());
    base_sq >= least_sq && twice_area * twice_area >= least_sq * base_sq
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
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

impl Arm {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Mean of the points.
    pub fn mean(&self) -> Vector2<f64> {
        Vector2::new(self.x.iter().sum(), self.y.iter().sum()) / self.len() as f64
    }

    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
    }

    fn push(&mut self, p: Vector2<f64>) {
        self.x.push(p.x);
        self.y.push(p.y);
    }
}

impl Arms {
    /// Collect the neighbours of beam `i` out to index distance `reach`.
    pub fn gather(&mut self, ranges: &PaddedRanges, i: usize, radius: f64, reach: usize, layout: &Layout) {
        let (ahead, behind, rho) = (ranges.at_and_after(i), ranges.before(i), ranges.at(i));
        let slack = radius * radius - rho * rho;
        self.left.clear();
        self.right.clear();
        for k in 1..=reach {
            let twice_along = 2.0 * rho * layout.cos[k];
            let (right, left) = (ahead[k], behind[behind.len() - k]);
            if is_near(right, twice_along, slack) {
                self.right.push(relative(right, rho, k, layout));
            }
            if is_near(left, twice_along, slack) {
                let p = relative(left, rho, k, layout);
                self.left.push(Vector2::new(p.x, -p.y));
            }
        }
    }

    /// Direction into which the corner opens, not normalised.
    pub fn opening(&self) -> Vector2<f64> {
        self.left.mean() + self.right.mean()
    }
}

/// The point `k` beams on, at range `rho_j`, in the frame of a beam of range `rho_i`.
pub(super) fn relative(rho_j: f64, rho_i: f64, k: usize, layout: &Layout) -> Vector2<f64> {
    Vector2::new(rho_j * layout.cos[k] - rho_i, rho_j * layout.sin[k])
}

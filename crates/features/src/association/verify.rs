//! How many landmarks of b a motion puts onto landmarks of a.

use super::Options;
use crate::rigid_fit::{RigidFit, rigid_fit};
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Rounds of pairing and fitting.
const ROUNDS: usize = 4;
/// The first round pairs out to this multiple of the tolerance: a motion from two landmarks is off elsewhere.
const FIRST_GATE: f64 = 2.0;

/// Where a landmark of a is near: a bit per cell of a grid, set where any point of the cell may be within the tolerance.
pub(super) struct Neighbourhood {
    low: Vector2<f64>,
    per_metre: f64,
    columns: usize,
    rows: usize,
    near: Vec<bool>,
}

impl Neighbourhood {
    /// Cells half a tolerance wide, or wider where the set is so large that they would be too many.
    pub fn new(points: &[Vector2<f64>], tolerance: f64) -> Self {
        let margin = Vector2::repeat(2.0 * tolerance);
        let low = points.iter().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(p)) - margin;
        let extent = points.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p)) + margin - low;
        let cell = (0.5 * tolerance).max((extent.x * extent.y / 1e6).sqrt()).max(extent.amax() / 1e6);
        let size = extent.map(|x| (x / cell) as usize + 1);
        let mut grid =
            Self { low, per_metre: 1.0 / cell, columns: size.x, rows: size.y, near: vec![false; size.x * size.y] };
        points.iter().for_each(|p| grid.mark(*p, tolerance));
        grid
    }

    fn mark(&mut self, p: Vector2<f64>, tolerance: f64) {
        let at = (p - self.low) * self.per_metre;
        let (reach, corner) = (tolerance * self.per_metre, 0.5_f64.sqrt());
        let range = |x: f64, n: usize| (x - reach).max(0.0) as usize..=((x + reach) as usize).min(n - 1);
        for row in range(at.y, self.rows) {
            for column in range(at.x, self.columns) {
                let centre = Vector2::new(column as f64 + 0.5, row as f64 + 0.5);
                let within = (centre - at).norm() <= reach + corner;
                self.near[row * self.columns + column] |= within;
            }
        }
    }

    /// How many points of b the motion puts near a point of a: never fewer than its one-to-one pairs.
    pub fn count(&self, motion: &Se2, b: &[Vector2<f64>]) -> usize {
        let near = |p: &&Vector2<f64>| {
            let at = (motion.act(**p) - self.low) * self.per_metre;
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64 && at.y < self.rows as f64;
            inside && self.near[at.y as usize * self.columns + at.x as usize]
        };
        b.iter().filter(near).count()
    }
}

/// The two sets, a sorted by x so that what is near a point is a short stretch.
pub(super) struct Sets<'a, F> {
    a: &'a [Vector2<f64>],
    b: &'a [Vector2<f64>],
    by_x: Vec<usize>,
    compatible: F,
}

/// A motion refined: pairs `(a, b)` sorted, and the fit to them.
pub(super) type Refined = (Vec<(usize, usize)>, RigidFit);

impl<'a, F: Fn(usize, usize, &Se2) -> bool> Sets<'a, F> {
    /// `compatible` says which pairs may be formed under which motion.
    pub fn new(a: &'a [Vector2<f64>], b: &'a [Vector2<f64>], compatible: F) -> Self {
        let mut by_x: Vec<usize> = (0..a.len()).collect();
        by_x.sort_by(|&i, &j| a[i].x.total_cmp(&a[j].x));
        Self { a, b, by_x, compatible }
    }

    /// Pair and fit in turns, from a wide gate to the tolerance; none where too few pairs remain.
    pub fn refine(&self, start: &Se2, options: &Options) -> Option<Refined> {
        let (mut motion, mut before) = (*start, Vec::new());
        for round in 0..ROUNDS {
            let gate = if round == 0 { FIRST_GATE * options.tolerance } else { options.tolerance };
            let pairs = self.pair(&motion, gate);
            if pairs.len() < options.min_pairs {
                return None;
            }
            let points: Vec<_> = pairs.iter().map(|&(i, j)| (self.a[i], self.b[j])).collect();
            let fit = rigid_fit(&points, options.point_noise * std::f64::consts::SQRT_2)?;
            if pairs == before || round + 1 == ROUNDS {
                return Some((pairs, fit));
            }
            (motion, before) = (fit.transform, if round == 0 { Vec::new() } else { pairs });
        }
        None
    }

    /// One-to-one pairs within the gate, nearest first taken, sorted.
    fn pair(&self, motion: &Se2, gate: f64) -> Vec<(usize, usize)> {
        let mut near = Vec::new();
        for (j, b) in self.b.iter().enumerate() {
            let p = motion.act(*b);
            let start = self.by_x.partition_point(|&i| self.a[i].x < p.x - gate);
            let stretch = self.by_x[start..].iter().take_while(|&&i| self.a[i].x <= p.x + gate);
            let distances = stretch.map(|&i| ((self.a[i] - p).norm_squared(), i, j));
            near.extend(distances.filter(|&(d, i, j)| d <= gate * gate && (self.compatible)(i, j, motion)));
        }
        near.sort_unstable_by(|s, t| s.0.total_cmp(&t.0).then((s.1, s.2).cmp(&(t.1, t.2))));
        let (mut free_a, mut free_b) = (vec![true; self.a.len()], vec![true; self.b.len()]);
        near.retain(|&(_, i, j)| {
            let free = free_a[i] && free_b[j];
            (free_a[i], free_b[j]) = (free_a[i] && !free, free_b[j] && !free);
            free
        });
        let mut pairs: Vec<_> = near.into_iter().map(|(_, i, j)| (i, j)).collect();
        pairs.sort_unstable();
        pairs
    }
}

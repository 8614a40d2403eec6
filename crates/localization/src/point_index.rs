//! Points of the plane in square cells, for the question which lie near a place.
//!
//! Built once; the points of a cell stand side by side. The number of cells is bound by the number of points, so that a
//! landmark a thousand kilometres off costs no memory, only width of the cells.

use nalgebra::Vector2;

/// Least width of a cell [m].
const CELL: f64 = 1.0;
/// Cells, at most: this many a point, and this many besides.
const MOST_CELLS: (f64, f64) = (16.0, 1024.0);

/// An index of points that do not move.
#[derive(Clone, Debug, Default)]
pub(crate) struct PointIndex {
    origin: Vector2<f64>,
    per_cell: f64,
    width: usize,
    height: usize,
    /// Where the points of each cell begin in `ids`; one more than cells.
    starts: Vec<u32>,
    ids: Vec<u32>,
    points: Vec<Vector2<f64>>,
}

impl PointIndex {
    /// The index of finite points.
    pub fn new(points: &[Vector2<f64>]) -> Self {
        let Some(first) = points.first() else { return Self::default() };
        let (low, high) = points.iter().fold((*first, *first), |(low, high), p| (low.inf(p), high.sup(p)));
        let extent = high - low;
        let most = MOST_CELLS.0 * points.len() as f64 + MOST_CELLS.1;
        let side = (extent.x.max(CELL) * extent.y.max(CELL) / most).sqrt().max(extent.max() / most).max(CELL);
        let count = |length: f64| (length / side) as usize + 1;
        let (width, height) = (count(extent.x), count(extent.y));
        let mut index = Self { origin: low, per_cell: 1.0 / side, width, height, ..Self::default() };
        index.fill(points);
        index
    }

    fn fill(&mut self, points: &[Vector2<f64>]) {
        let mut counts = vec![0_u32; self.width * self.height + 1];
        let cells: Vec<usize> = points.iter().map(|p| self.cell(*p)).collect();
        cells.iter().for_each(|c| counts[c + 1] += 1);
        for c in 1..counts.len() {
            counts[c] += counts[c - 1];
        }
        let mut next = counts.clone();
        self.ids = vec![0; points.len()];
        for (id, c) in cells.iter().enumerate() {
            self.ids[next[*c] as usize] = id as u32;
            next[*c] += 1;
        }
        self.points = self.ids.iter().map(|id| points[*id as usize]).collect();
        self.starts = counts;
    }

    /// The cell of a point, the nearest one where it lies outside.
    fn cell(&self, p: Vector2<f64>) -> usize {
        let at = (p - self.origin) * self.per_cell;
        let clamp = |v: f64, n: usize| (v.max(0.0) as usize).min(n - 1);
        clamp(at.y, self.height) * self.width + clamp(at.x, self.width)
    }

    /// Calls `visit` with every point within `radius` of `p`, and its squared distance.
    pub fn within(&self, p: Vector2<f64>, radius: f64, mut visit: impl FnMut(usize, f64)) {
        if self.ids.is_empty() || !(p.x.is_finite() && p.y.is_finite()) {
            return;
        }
        let (low, high) = (self.cell(p.add_scalar(-radius)), self.cell(p.add_scalar(radius)));
        let (x_low, x_high) = (low % self.width, high % self.width);
        for y in low / self.width..=high / self.width {
            let cells = (y * self.width + x_low, y * self.width + x_high);
            for k in self.starts[cells.0] as usize..self.starts[cells.1 + 1] as usize {
                let sq = (self.points[k] - p).norm_squared();
                if sq <= radius * radius {
                    visit(self.ids[k] as usize, sq);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn found(index: &PointIndex, p: Vector2<f64>, radius: f64) -> Vec<usize> {
        let mut ids = Vec::new();
        index.within(p, radius, |id, _| ids.push(id));
        ids.sort_unstable();
        ids
    }

    proptest! {
        #[test]
        fn equals_brute_force(
            set in prop::collection::vec((-40.0..40.0_f64, -3.0..90.0_f64), 0..80),
            x in -60.0..60.0_f64, y in -60.0..120.0_f64, radius in 0.0..30.0_f64,
        ) {
            let points: Vec<_> = set.iter().map(|&(x, y)| Vector2::new(x, y)).collect();
            let p = Vector2::new(x, y);
            let plain: Vec<usize> = (0..points.len()).filter(|&k| (points[k] - p).norm_squared() <= radius * radius).collect();
            prop_assert_eq!(found(&PointIndex::new(&points), p, radius), plain);
        }
    }

    #[test]
    fn a_point_far_away_costs_no_memory() {
        let index = PointIndex::new(&[Vector2::zeros(), Vector2::new(1e9, -1e9), Vector2::new(0.5, 0.0)]);
        assert!(index.starts.len() < 4000);
        assert_eq!(found(&index, Vector2::new(0.2, 0.0), 1.0), [0, 2]);
        assert_eq!(found(&index, Vector2::new(1e9, -1e9), 1.0), [1]);
        assert_eq!(found(&index, Vector2::new(f64::NAN, 0.0), 1.0), [] as [usize; 0]);
    }
}

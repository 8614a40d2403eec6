//! Up to eight neighbouring rows of the triangle, column by column, so that loops over rows are loops over lanes.
//!
//! Column j of a panel holds the entries of its rows in that column: eight numbers side by side; lanes without a row and
//! entries beyond the diagonal are zero, and stay zero under [`Panel::sweep`] by themselves.

use super::Real;
use nalgebra::DMatrix;

/// Rows of a panel.
pub(super) const LANES: usize = 8;

/// Rows `first..first + rows` of a unit lower triangle.
#[derive(Clone, Debug)]
pub(super) struct Panel<T> {
    rows: usize,
    columns: Vec<[T; LANES]>,
}

impl<T: Real> Panel<T> {
    pub fn new(first: usize, rows: usize, value: impl Fn(usize, usize) -> T) -> Self {
        let column = |c: usize| std::array::from_fn(|l| if l < rows { value(l, c) } else { T::zero() });
        Self { rows, columns: (0..first + rows).map(column).collect() }
    }

    pub fn first(&self) -> usize {
        self.columns.len() - self.rows
    }

    /// Copies what this panel has of rows `first..`, as far as there is room for it.
    pub fn copy_rows(&self, first: usize, into: &mut DMatrix<T>) {
        for lane in 0..self.rows {
            let row = self.first() + lane;
            if row < first || row >= first + into.nrows() {
                continue;
            }
            for (c, column) in self.columns.iter().enumerate().take(into.ncols().min(row + 1)) {
                into[(row - first, c)] = column[lane];
            }
        }
    }

    /// Adds `h_i L_i` of every row of this panel to the sums: row i of the measurement has the coefficients
    /// `coefficients[i - first]`, one a scalar measurement.
    pub fn project<const R: usize>(&self, coefficients: &[[T; R]], sums: &mut [[T; R]]) {
        for (column, sum) in self.columns.iter().zip(sums) {
            for (lane, h) in coefficients.iter().enumerate() {
                for r in 0..R {
                    sum[r] += h[r] * column[lane];
                }
            }
        }
    }

    /// Bierman's inner loop for R scalar measurements in one pass, from the last column to the first:
    /// `(u, b_r) <- (u + lambda_r b_r, b_r + u v_r)`, r after r. Returns the `b_r` of every row: its gains, unscaled.
    pub fn sweep<const R: usize>(&mut self, lambda: &[[T; R]], v: &[[T; R]]) -> [[T; LANES]; R] {
        let mut b = [[T::zero(); LANES]; R];
        for ((column, lambda), v) in self.columns.iter_mut().zip(lambda).zip(v).rev() {
            let mut u = *column;
            for r in 0..R {
                for lane in 0..LANES {
                    let before = u[lane];
                    u[lane] += lambda[r] * b[r][lane];
                    b[r][lane] += before * v[r];
                }
            }
            *column = u;
        }
        b
    }

    pub fn rows(&self) -> usize {
        self.rows
    }
}

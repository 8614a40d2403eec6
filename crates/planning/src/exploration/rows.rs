//! Three rows of many numbers, each row of one piece, so that what the search does most runs over whole rows.
//!
//! A product of 3 x 3 blocks, one after the other or by a general matrix product, takes eight times as long.

use nalgebra::{DMatrix, Matrix3, Matrix3x2};

/// A matrix of three rows.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    rows: [Vec<f64>; 3],
}

impl Rows {
    /// Of a symmetric matrix, the three rows from `first` on less those from `second` on.
    pub fn difference(symmetric: &DMatrix<f64>, first: usize, second: usize) -> Self {
        let row = |i: usize| {
            let (a, b) = (symmetric.column(first + i), symmetric.column(second + i));
            a.iter().zip(b.iter()).map(|(a, b)| a - b).collect()
        };
        Self { rows: [row(0), row(1), row(2)] }
    }

    /// Three columns.
    pub fn block(&self, first: usize) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.rows[i][first + j])
    }

    /// Adds to the first three columns.
    pub fn add_to_first(&mut self, block: &Matrix3<f64>) {
        for (i, row) in self.rows.iter_mut().enumerate() {
            row.iter_mut().zip(block.row(i).iter()).for_each(|(value, more)| *value += more);
        }
    }

    /// `self - weight other`.
    pub fn subtract(&mut self, weight: &Matrix3<f64>, other: &Self) {
        let [a, b, c] = &other.rows;
        for (i, row) in self.rows.iter_mut().enumerate() {
            let (wa, wb, wc) = (weight[(i, 0)], weight[(i, 1)], weight[(i, 2)]);
            let columns = row.iter_mut().zip(a).zip(b).zip(c);
            columns.for_each(|(((value, a), b), c)| *value -= wa * a + wb * b + wc * c);
        }
    }

    /// `lower self`, `lower` without anything above its diagonal.
    pub fn times(&mut self, lower: &Matrix3<f64>) {
        let [a, b, c] = &mut self.rows;
        for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
            *c = lower[(2, 0)] * *a + lower[(2, 1)] * *b + lower[(2, 2)] * *c;
            *b = lower[(1, 0)] * *a + lower[(1, 1)] * *b;
            *a *= lower[(0, 0)];
        }
    }

    /// Two columns that what stands at `(x, y)` has in its position: `dp = (xi_x - xi_theta y, xi_y + xi_theta x)`.
    pub fn position(&self, first: usize, x: f64, y: f64) -> Matrix3x2<f64> {
        let at = |i: usize, j: usize| self.rows[i][first + j];
        Matrix3x2::from_fn(|i, j| if j == 0 { at(i, 0) - at(i, 2) * y } else { at(i, 1) + at(i, 2) * x })
    }
}

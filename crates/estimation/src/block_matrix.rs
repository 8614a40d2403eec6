//! A symmetric sparse matrix of B x B blocks whose pattern is fixed once and whose values change.
//!
//! Only the diagonal and the upper blocks are stored: block `(i, j)` with `i < j`; block `(j, i)` is its transpose.

use nalgebra::{DMatrix, SMatrix, SVector};

/// A symmetric matrix in blocks.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockMatrix<const B: usize> {
    /// The blocks `(i, i)`; both triangles of each are filled.
    pub diagonal: Vec<SMatrix<f64, B, B>>,
    /// The blocks `(i, j)` of [`Self::pairs`], in its order.
    pub upper: Vec<SMatrix<f64, B, B>>,
    pairs: Vec<(usize, usize)>,
}

impl<const B: usize> BlockMatrix<B> {
    /// A zero matrix of `blocks` block rows in which the blocks named by `pairs` may be non-zero. A pair may come in
    /// either order and more than once; pairs on the diagonal or outside the matrix are left out.
    #[must_use]
    pub fn zeros(blocks: usize, pairs: impl IntoIterator<Item = (usize, usize)>) -> Self {
        let ordered = pairs.into_iter().map(|(i, j)| (i.min(j), i.max(j)));
        let mut pairs: Vec<_> = ordered.filter(|&(i, j)| i != j && j < blocks).collect();
        pairs.sort_unstable();
        pairs.dedup();
        Self { diagonal: vec![SMatrix::zeros(); blocks], upper: vec![SMatrix::zeros(); pairs.len()], pairs }
    }

    /// The upper blocks that may be non-zero, `(i, j)` with `i < j`, sorted.
    #[must_use]
    pub fn pairs(&self) -> &[(usize, usize)] {
        &self.pairs
    }

    /// Number of block rows.
    #[must_use]
    pub fn blocks(&self) -> usize {
        self.diagonal.len()
    }

    /// Where block `(i, j)`, `i < j`, stands in [`Self::upper`].
    #[must_use]
    pub fn slot(&self, i: usize, j: usize) -> Option<usize> {
        self.pairs.binary_search(&(i, j)).ok()
    }

    /// Sets every value to zero and keeps the pattern.
    pub fn clear(&mut self) {
        self.diagonal.fill(SMatrix::zeros());
        self.upper.fill(SMatrix::zeros());
    }

    /// The product `A x`, with x in blocks and as many of them as block rows.
    #[must_use]
    pub fn multiply(&self, x: &[SVector<f64, B>]) -> Vec<SVector<f64, B>> {
        let mut product: Vec<_> = self.diagonal.iter().zip(x).map(|(block, x)| block * x).collect();
        for (&(i, j), block) in self.pairs.iter().zip(&self.upper) {
            product[i] += block * x[j];
            product[j] += block.tr_mul(&x[i]);
        }
        product
    }

    /// The same matrix, dense.
    #[must_use]
    pub fn to_dense(&self) -> DMatrix<f64> {
        let n = self.blocks() * B;
        let mut dense = DMatrix::zeros(n, n);
        for (i, block) in self.diagonal.iter().enumerate() {
            dense.fixed_view_mut::<B, B>(i * B, i * B).copy_from(block);
        }
        for (&(i, j), block) in self.pairs.iter().zip(&self.upper) {
            dense.fixed_view_mut::<B, B>(i * B, j * B).copy_from(block);
            dense.fixed_view_mut::<B, B>(j * B, i * B).copy_from(&block.transpose());
        }
        dense
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pattern_is_sorted_unique_and_above_the_diagonal() {
        let m = BlockMatrix::<2>::zeros(4, [(3, 1), (0, 2), (1, 3), (2, 2), (0, 9)]);
        assert_eq!(m.pairs(), [(0, 2), (1, 3)]);
        assert_eq!((m.slot(1, 3), m.slot(3, 1), m.slot(0, 1)), (Some(1), None, None));
    }
}

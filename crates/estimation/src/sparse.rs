//! Symmetric positive-definite sparse systems `A x = b` by Cholesky: `P A P^T = L L^T`.
//!
//! `P` is an approximate-minimum-degree ordering of the blocks (Amestoy, Davis, Duff 1996), so the scalars of a block
//! stay together. The analysis of the pattern is done once ([`Cholesky::analyze`]); the numbers may then change as often
//! as needed ([`Cholesky::factorize`]). The factor is kept in supernodes: runs of columns with one pattern, each a dense
//! panel, whose arithmetic is dense. Single threaded, so equal input gives equal bytes.
//!
//! Not for indefinite systems, and nothing pivots: an unconstrained direction is an error which names its block.
//! This is the only file that names faer, whose interface changes with every release.

use crate::selected_inverse::{SelectedInverse, Supernode};
use crate::{BlockMatrix, Error};
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::{LltError, LltRegularization};
use faer::sparse::linalg::{SymbolicSupernodalParams, amd, cholesky::simplicial, cholesky::supernodal};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par};
use nalgebra::{SMatrix, SVector};

/// The Cholesky factor of a matrix with a known pattern.
pub struct Cholesky<const B: usize> {
    /// Place of each block in the elimination order, and the block at each place.
    place: Vec<usize>,
    block_at: Vec<usize>,
    lower: Pattern,
    pairs: Vec<(usize, usize)>,
    /// For each upper block of the matrix: where its column panel stands in `values`, and whether it is transposed.
    targets: Vec<Target>,
    symbolic: supernodal::SymbolicSupernodalCholesky<usize>,
    values: Vec<f64>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

/// Block columns of one triangle of the permuted matrix, in scalars: every scalar column of a block column holds the
/// whole diagonal block, so all have one length.
struct Pattern {
    block_start: Vec<usize>,
    col_ptr: Vec<usize>,
    row_idx: Vec<usize>,
}

#[derive(Clone, Copy)]
struct Target {
    first: usize,
    stride: usize,
    transposed: bool,
}

impl<const B: usize> Cholesky<B> {
    /// Orders the blocks and finds the pattern of the factor. The values of `matrix` do not matter.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`].
    pub fn analyze(matrix: &BlockMatrix<B>) -> Result<Self, Error> {
        let (n, unknowns) = (matrix.blocks(), matrix.blocks() * B);
        let fail = |_: FaerError| Error::OutOfMemory { unknowns };
        let (block_at, place) = order(n, matrix.pairs()).map_err(fail)?;
        let placed: Vec<_> = matrix.pairs().iter().map(|&(i, j)| (place[i], place[j])).collect();
        let lower = Pattern::new::<B>(n, placed.iter().map(|&(p, q)| (p.max(q), p.min(q))));
        let upper = Pattern::new::<B>(n, placed.iter().map(|&(p, q)| (p.min(q), p.max(q))));
        let symbolic = supernodes(unknowns, &upper).map_err(fail)?;
        let targets = placed.iter().map(|&(p, q)| lower.target::<B>(p, q)).collect();
        let scratch =
            supernodal::factorize_supernodal_numeric_llt_scratch::<usize, f64>(&symbolic, Par::Seq, Default::default())
                .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        let memory = MemBuffer::try_new(scratch).map_err(|_| Error::OutOfMemory { unknowns })?;
        let (values, factor) = (vec![0.0; lower.row_idx.len()], vec![0.0; symbolic.len_val()]);
        Ok(Self { place, block_at, lower, pairs: matrix.pairs().to_vec(), targets, symbolic, values, factor, memory })
    }

    /// Computes the factor of `matrix`, which must have the pattern that was analysed.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::OtherPattern`], [`Error::NotPositiveDefinite`] with the block where it shows.
    pub fn factorize(&mut self, matrix: &BlockMatrix<B>) -> Result<(), Error> {
        self.check_pattern(matrix)?;
        self.fill(matrix);
        let n = self.place.len() * B;
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, &self.lower.col_ptr, None, &self.lower.row_idx);
        supernodal::factorize_supernodal_numeric_llt(
            &mut self.factor,
            SparseColMatRef::new(pattern, &self.values),
            LltRegularization::default(),
            &self.symbolic,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        )
        .map_err(|LltError::NonPositivePivot { index }| self.not_definite(index))?;
        Ok(())
    }

    /// The solution x of `A x = b` with the last factor, in blocks.
    ///
    /// # Errors
    /// [`Error::Size`].
    pub fn solve(&mut self, b: &[SVector<f64, B>]) -> Result<Vec<SVector<f64, B>>, Error> {
        let n = self.place.len();
        if b.len() != n {
            return Err(Error::Size { what: "right-hand side (blocks)", expected: n, got: b.len() });
        }
        let mut x: Vec<f64> = self.block_at.iter().flat_map(|&block| b[block].iter().copied()).collect();
        supernodal::SupernodalLltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut x, n * B, 1),
            Par::Seq,
            MemStack::new(&mut self.memory),
        );
        Ok(self.place.iter().map(|&p| SVector::from_column_slice(&x[p * B..(p + 1) * B])).collect())
    }

    /// The blocks of `A^-1` on the pattern of A: marginal covariances and those of coupled pairs when A is an
    /// information matrix.
    #[must_use]
    pub fn selected_inverse(&self) -> BlockMatrix<B> {
        let supernodes: Vec<_> = (0..self.symbolic.n_supernodes()).map(|s| self.supernode(s)).collect();
        let inverse = SelectedInverse::new(&supernodes);
        let mut selected = BlockMatrix::zeros(self.place.len(), self.pairs.iter().copied());
        for (block, &p) in selected.diagonal.iter_mut().zip(&self.place) {
            *block = inverse.block(p, p);
        }
        for (block, &(i, j)) in selected.upper.iter_mut().zip(&self.pairs) {
            *block = inverse.block(self.place[i], self.place[j]);
        }
        selected
    }

    /// Number of stored entries of L, zeros of the panels included.
    #[must_use]
    pub fn stored(&self) -> usize {
        self.factor.len()
    }

    fn supernode(&self, s: usize) -> Supernode<'_> {
        let (start, end) = (self.symbolic.supernode_begin()[s], self.symbolic.supernode_end()[s]);
        let values = self.symbolic.col_ptr_for_val();
        let rows = self.symbolic.supernode(s).pattern();
        Supernode { start, columns: end - start, rows, values: &self.factor[values[s]..values[s + 1]] }
    }

    fn fill(&mut self, matrix: &BlockMatrix<B>) {
        for (block, &p) in matrix.diagonal.iter().zip(&self.place) {
            self.lower.diagonal_target::<B>(p).write(&mut self.values, block);
        }
        for (block, target) in matrix.upper.iter().zip(&self.targets) {
            target.write(&mut self.values, block);
        }
    }

    fn check_pattern(&self, matrix: &BlockMatrix<B>) -> Result<(), Error> {
        let (expected, got) = (self.place.len(), matrix.blocks());
        if expected != got {
            return Err(Error::Size { what: "matrix (block rows)", expected, got });
        }
        if self.pairs != matrix.pairs() {
            return Err(Error::OtherPattern);
        }
        Ok(())
    }

    fn not_definite(&self, scalar: usize) -> Error {
        Error::NotPositiveDefinite { block: self.block_at.get(scalar / B).copied().unwrap_or(0) }
    }
}

impl Target {
    fn write<const B: usize>(self, values: &mut [f64], block: &SMatrix<f64, B, B>) {
        for c in 0..B {
            for r in 0..B {
                values[self.first + c * self.stride + r] = if self.transposed { block[(c, r)] } else { block[(r, c)] };
            }
        }
    }
}

impl Pattern {
    /// The pattern with the diagonal and the blocks `(row, column)`.
    fn new<const B: usize>(blocks: usize, off_diagonal: impl Iterator<Item = (usize, usize)>) -> Self {
        let mut entries: Vec<_> = off_diagonal.map(|(row, column)| (column, row)).collect();
        entries.extend((0..blocks).map(|k| (k, k)));
        entries.sort_unstable();
        let mut block_start = vec![0; blocks + 1];
        for &(column, _) in &entries {
            block_start[column + 1] += 1;
        }
        for k in 0..blocks {
            block_start[k + 1] += block_start[k];
        }
        let (mut col_ptr, mut row_idx) = (vec![0], Vec::with_capacity(entries.len() * B * B));
        for rows in entries.chunk_by(|a, b| a.0 == b.0) {
            for _ in 0..B {
                row_idx.extend(rows.iter().flat_map(|&(_, row)| row * B..(row + 1) * B));
                col_ptr.push(row_idx.len());
            }
        }
        Self { block_start, col_ptr, row_idx }
    }

    /// Where upper block `(i, j)` of the matrix goes when its blocks i and j stand at places p and q.
    fn target<const B: usize>(&self, p: usize, q: usize) -> Target {
        let (row, column) = (p.max(q), p.min(q));
        let rows = &self.row_idx[self.col_ptr[column * B]..self.col_ptr[column * B + 1]];
        let offset = rows.partition_point(|&r| r < row * B);
        Target { first: self.col_ptr[column * B] + offset, stride: rows.len(), transposed: p < q }
    }

    fn diagonal_target<const B: usize>(&self, p: usize) -> Target {
        let stride = (self.block_start[p + 1] - self.block_start[p]) * B;
        Target { first: self.block_start[p] * B * B, stride, transposed: false }
    }
}

/// The approximate-minimum-degree order of the blocks: the block at each place, and the place of each block.
fn order(n: usize, pairs: &[(usize, usize)]) -> Result<(Vec<usize>, Vec<usize>), FaerError> {
    let graph = Pattern::new::<1>(n, pairs.iter().copied());
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &graph.col_ptr, None, &graph.row_idx);
    let mut memory = buffer(amd::order_scratch::<usize>(n, graph.row_idx.len()))?;
    let (mut block_at, mut place) = (vec![0; n], vec![0; n]);
    amd::order(&mut block_at, &mut place, pattern, amd::Control::default(), MemStack::new(&mut memory))?;
    Ok((block_at, place))
}

/// The supernodes of the factor of a permuted matrix given by its upper triangle.
fn supernodes(n: usize, upper: &Pattern) -> Result<supernodal::SymbolicSupernodalCholesky<usize>, FaerError> {
    let pattern = SymbolicSparseColMatRef::new_checked(n, n, &upper.col_ptr, None, &upper.row_idx);
    let mut memory = buffer(
        simplicial::prefactorize_symbolic_cholesky_scratch::<usize>(n, upper.row_idx.len())
            .or(supernodal::factorize_supernodal_symbolic_cholesky_scratch::<usize>(n)),
    )?;
    let stack = MemStack::new(&mut memory);
    let (mut tree, mut counts) = (vec![0; n], vec![0; n]);
    let tree = simplicial::prefactorize_symbolic_cholesky::<usize>(&mut tree, &mut counts, pattern, stack);
    supernodal::factorize_supernodal_symbolic_cholesky(
        pattern,
        tree,
        &counts,
        stack,
        SymbolicSupernodalParams::default(),
    )
}

fn buffer(request: StackReq) -> Result<MemBuffer, FaerError> {
    MemBuffer::try_new(request).map_err(|_| FaerError::OutOfMemory)
}

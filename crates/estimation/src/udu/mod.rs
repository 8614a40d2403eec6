//! A covariance kept as factors, `P = U D U^T`: never indefinite, at any precision.
//!
//! U is unit upper triangular and D diagonal and not negative when the states are listed *robot first*:
//! `x = (robot, newest block, ..., oldest block)`. Plain and Joseph forms of a Kalman filter lose their sign once
//! `sigma_prior / sigma_measurement` nears `1/sqrt(eps)` (1e3 in f32, 1e8 in f64); here d is a product of numbers that are
//! not negative. The order makes what happens often cheap, for n states:
//!
//! | | cost | |
//! |---|---|---|
//! | [`Udu::predict`] | O(1), O(n) with a transition | only the rows of the robot change |
//! | [`Udu::birth`] | O(n) | rows are appended, a small Gram-Schmidt joins them |
//! | [`Udu::innovation_covariance`] | O(n) | rows of U that the measurement touches |
//! | [`Udu::update`] | O(n^2) | one pass over U for up to six scalar rows |
//!
//! Memory holds the states in the opposite order (oldest block first, robot last), so that a state keeps its index for
//! ever: block k that was born is found at the index that [`Udu::birth`] returned. The *head* are the blocks given at the
//! start (robot last); [`Udu::head`] tells where it stands now. Rows are kept in panels of up to eight, column by column,
//! so that the inner loop runs over eight rows at once ([`panel`]).
//!
//! Source: Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977), chapters V and VI; Thornton,
//! Bierman, JPL TM 33-798 (1977). Generic over f32 and f64; needs no square roots but those of the caller's noise.

mod gram_schmidt;
mod measurement;
mod panel;

use crate::Error;
use gram_schmidt::{Factors, gram_schmidt};
pub use measurement::{Correction, Rows};
use nalgebra::{DMatrix, DMatrixView, RealField};
use panel::{LANES, Panel};

/// What the numbers may be: f32 or f64.
pub trait Real: RealField + Copy {}
impl<T: RealField + Copy> Real for T {}

/// A covariance of blocks that were born one after the other, and of a head.
#[derive(Clone, Debug)]
pub struct Udu<T: Real> {
    /// Panels of the blocks born, then those of the head.
    panels: Vec<Panel<T>>,
    /// D, in the order of memory.
    d: Vec<T>,
    /// Sizes of the blocks of the head, robot last.
    head: Vec<usize>,
}

impl<T: Real> Udu<T> {
    /// Independent blocks of the head, each by a square root S of its covariance `S S^T` (rows the states, any number of
    /// columns, none for an exact block). The last block is the one that [`Self::predict`] moves.
    #[must_use]
    pub fn new(roots: &[DMatrix<T>]) -> Self {
        let mut udu = Self { panels: vec![], d: vec![], head: vec![] };
        for root in roots {
            let factors = gram_schmidt(root.clone(), &vec![T::one(); root.ncols()]);
            udu.append(&DMatrix::zeros(root.nrows(), udu.d.len()), &factors);
            udu.head.push(root.nrows());
        }
        udu
    }

    /// Number of states.
    #[must_use]
    pub fn len(&self) -> usize {
        self.d.len()
    }

    /// Whether there is no state.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.d.is_empty()
    }

    /// Index of the first state of block `k` of the head; it moves by the size of each block born.
    #[must_use]
    pub fn head(&self, k: usize) -> usize {
        self.len() - self.head[k..].iter().sum::<usize>()
    }

    /// The variances D of the factors, in the order of memory: none is ever negative.
    #[must_use]
    pub fn d(&self) -> &[T] {
        &self.d
    }

    /// Block `(i.., j..)` of the covariance, `rows x columns`: O(n) an entry.
    #[must_use]
    pub fn covariance_block(&self, i: usize, j: usize, rows: usize, columns: usize) -> DMatrix<T> {
        let common = (i + rows).min(j + columns);
        let mut left = self.rows(i, rows, common);
        for (mut column, d) in left.column_iter_mut().zip(&self.d) {
            column *= *d;
        }
        left * self.rows(j, columns, common).transpose()
    }

    /// The whole covariance: O(n^3).
    #[must_use]
    pub fn covariance(&self) -> DMatrix<T> {
        self.covariance_block(0, 0, self.len(), self.len())
    }

    /// The last block of the head after `x' = F x + w`, `w ~ N(0, S S^T)`; no F means the identity.
    ///
    /// Thornton's update by modified weighted Gram-Schmidt, of the robot's rows alone.
    ///
    /// # Errors
    /// [`Error::Size`] when F or S has not as many rows as the block.
    pub fn predict(&mut self, transition: Option<&DMatrix<T>>, noise_root: &DMatrix<T>) -> Result<(), Error> {
        let size = self.head.last().copied().unwrap_or(0);
        check("process noise (rows)", size, noise_root.nrows())?;
        let first = self.len() - size;
        let mut rows = self.rows(first, size, self.len());
        if let Some(f) = transition {
            check("transition (rows)", size, f.nrows())?;
            check("transition (columns)", size, f.ncols())?;
            rows = f * rows;
        }
        let factors = joined(&[(&rows.columns(first, size), &self.d[first..])], noise_root);
        self.drop_rows(first);
        self.append(&rows.columns(0, first).into_owned(), &factors);
        Ok(())
    }

    /// A block `x_new = sum_k G_k x_head_k + e`, `e ~ N(0, S S^T)`, one G a block of the head (empty for none). Returns
    /// the index of its first state, which stays.
    ///
    /// # Errors
    /// [`Error::Size`] when a G or S has a wrong number of rows, or a G of columns.
    pub fn birth(&mut self, gains: &[Option<DMatrix<T>>], noise_root: &DMatrix<T>) -> Result<usize, Error> {
        let (size, first) = (noise_root.nrows(), self.head(0));
        let total = self.len() - first;
        check("gains (blocks)", self.head.len(), gains.len())?;
        let mut gain = DMatrix::zeros(size, total);
        for (k, block) in gains.iter().enumerate() {
            let Some(block) = block else { continue };
            check("gain (rows)", size, block.nrows())?;
            check("gain (columns)", self.head[k], block.ncols())?;
            gain.view_mut((0, self.head(k) - first), (size, self.head[k])).copy_from(block);
        }
        let head = self.rows(first, total, self.len());
        let born = &gain * &head;
        let stacked = stack(&born, &head);
        let own = stacked.columns(first, total).into_owned();
        let mut noise = DMatrix::zeros(size + total, noise_root.ncols());
        noise.rows_mut(0, size).copy_from(noise_root);
        let factors = joined(&[(&own.as_view(), &self.d[first..])], &noise);
        self.replace_head(first, size, &stacked.columns(0, first).into_owned(), &factors);
        Ok(first)
    }

    /// Puts a born block and the head behind the first `first` states.
    fn replace_head(&mut self, first: usize, size: usize, known: &DMatrix<T>, factors: &Factors<T>) {
        self.drop_rows(first);
        let mut at = 0;
        for rows in std::iter::once(size).chain(self.head.clone()) {
            // Columns of this block: the old states, the blocks of this call that stand before it, its own.
            let before = factors.unit.view((at, 0), (rows, at));
            let own = Factors {
                unit: factors.unit.view((at, at), (rows, rows)).into_owned(),
                d: factors.d[at..at + rows].to_vec(),
            };
            let mut columns = known.rows(at, rows).into_owned().resize_horizontally(first + at, T::zero());
            columns.columns_mut(first, at).copy_from(&before);
            self.append(&columns, &own);
            at += rows;
        }
    }

    /// Rows `first..` as a dense matrix of their first `columns` columns.
    fn rows(&self, first: usize, count: usize, columns: usize) -> DMatrix<T> {
        let mut rows = DMatrix::zeros(count, columns);
        for panel in &self.panels {
            panel.copy_rows(first, &mut rows);
        }
        rows
    }

    /// Rows behind all others: `known` in the columns that exist, the factors in their own.
    fn append(&mut self, known: &DMatrix<T>, own: &Factors<T>) {
        let (size, before) = (own.d.len(), self.d.len());
        for at in (0..size).step_by(LANES) {
            let rows = LANES.min(size - at);
            let value = |row: usize, column: usize| {
                if column < before { known[(at + row, column)] } else { own.unit[(at + row, column - before)] }
            };
            self.panels.push(Panel::new(before + at, rows, value));
        }
        self.d.extend_from_slice(&own.d);
    }

    fn drop_rows(&mut self, first: usize) {
        self.panels.retain(|panel| panel.first() < first);
        self.d.truncate(first);
    }
}

/// Factors of `A diag(a) A^T + S S^T`.
fn joined<T: Real>(parts: &[(&DMatrixView<'_, T>, &[T])], noise_root: &DMatrix<T>) -> Factors<T> {
    let columns: usize = parts.iter().map(|(a, _)| a.ncols()).sum();
    let mut stacked = DMatrix::zeros(noise_root.nrows(), columns + noise_root.ncols());
    let mut weights = Vec::with_capacity(stacked.ncols());
    for (a, d) in parts {
        stacked.columns_mut(weights.len(), a.ncols()).copy_from(a);
        weights.extend_from_slice(d);
    }
    stacked.columns_mut(columns, noise_root.ncols()).copy_from(noise_root);
    weights.resize(stacked.ncols(), T::one());
    gram_schmidt(stacked, &weights)
}

fn stack<T: Real>(top: &DMatrix<T>, bottom: &DMatrix<T>) -> DMatrix<T> {
    let mut stacked = DMatrix::zeros(top.nrows() + bottom.nrows(), top.ncols());
    stacked.rows_mut(0, top.nrows()).copy_from(top);
    stacked.rows_mut(top.nrows(), bottom.nrows()).copy_from(bottom);
    stacked
}

fn check(what: &'static str, expected: usize, got: usize) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::Size { what, expected, got }) }
}

//! Entries of `Z = (L L^T)^-1` on the pattern of L, without the rest of the inverse.
//!
//! From `Z L = L^-T`, supernode by supernode from the last to the first. With columns s, rows R below them,
//! `Y = L_Rs L_ss^-1`:
//!
//! ```text
//! Z_Rs = -Z_RR Y
//! Z_ss = (L_ss L_ss^T)^-1 - Y^T Z_Rs
//! ```
//!
//! `Z_RR` is already known, for every row pattern is a clique of the eliminated graph. The cost is that of about two
//! factorisations. Source: Takahashi, Fagan, Chen 1973; Erisman, Tinney, CACM 18 (1975) 177.

use nalgebra::{DMatrix, DMatrixView, SMatrix};

/// A supernode of the factor: columns `start..start + columns` of L, on and below the diagonal.
pub(crate) struct Supernode<'a> {
    /// First column.
    pub start: usize,
    /// Number of columns.
    pub columns: usize,
    /// Rows below the diagonal panel, sorted.
    pub rows: &'a [usize],
    /// `(columns + rows.len()) x columns` numbers, column-major.
    pub values: &'a [f64],
}

/// The entries of Z, a panel a supernode: `Z_ss` over `Z_Rs`.
pub(crate) struct SelectedInverse<'a> {
    supernodes: &'a [Supernode<'a>],
    /// The supernode of each column.
    owner: Vec<usize>,
    panels: Vec<DMatrix<f64>>,
}

impl<'a> SelectedInverse<'a> {
    pub(crate) fn new(supernodes: &'a [Supernode<'a>]) -> Self {
        let columns = supernodes.last().map_or(0, |s| s.start + s.columns);
        let mut owner = vec![0; columns];
        for (s, node) in supernodes.iter().enumerate() {
            owner[node.start..node.start + node.columns].fill(s);
        }
        let mut panels = vec![DMatrix::zeros(0, 0); supernodes.len()];
        for (s, node) in supernodes.iter().enumerate().rev() {
            let known = gather(node, supernodes, &panels, &owner);
            panels[s] = panel(node, &known);
        }
        Self { supernodes, owner, panels }
    }

    /// Block `(p, q)` in the order of elimination; it must lie on the pattern of `L + L^T`.
    pub(crate) fn block<const B: usize>(&self, p: usize, q: usize) -> SMatrix<f64, B, B> {
        SMatrix::from_fn(|r, c| {
            let (row, column) = (p * B + r, q * B + c);
            self.entry(row.max(column), row.min(column))
        })
    }

    fn entry(&self, row: usize, column: usize) -> f64 {
        let s = self.owner[column];
        let node = &self.supernodes[s];
        self.panels[s][(local(node, row), column - node.start)]
    }
}

/// `Z_ss` over `Z_Rs`, from the known `Z_RR`.
fn panel(node: &Supernode<'_>, known: &DMatrix<f64>) -> DMatrix<f64> {
    let (m, k) = (node.columns, node.rows.len());
    let factor = DMatrixView::from_slice(node.values, m + k, m);
    let mut inverse = DMatrix::identity(m, m);
    let _ = factor.rows(0, m).solve_lower_triangular_mut(&mut inverse);
    let y = factor.rows(m, k) * &inverse;
    let mut panel = DMatrix::zeros(m + k, m);
    panel.rows_mut(m, k).gemm(-1.0, known, &y, 0.0);
    let corner = inverse.tr_mul(&inverse) - y.tr_mul(&panel.rows(m, k));
    panel.rows_mut(0, m).copy_from(&corner);
    panel
}

/// `Z_RR` of a supernode, out of the panels of its ancestors.
fn gather(node: &Supernode<'_>, all: &[Supernode<'_>], panels: &[DMatrix<f64>], owner: &[usize]) -> DMatrix<f64> {
    let rows = node.rows;
    let mut known = DMatrix::zeros(rows.len(), rows.len());
    let mut first = 0;
    while first < rows.len() {
        let ancestor = owner[rows[first]];
        let places: Vec<usize> = locate(&all[ancestor], &rows[first..]);
        let own = rows[first..].iter().take_while(|&&r| owner[r] == ancestor).count();
        for b in 0..own {
            for a in b..places.len() {
                let value = panels[ancestor][(places[a], places[b])];
                known[(first + a, first + b)] = value;
                known[(first + b, first + a)] = value;
            }
        }
        first += own;
    }
    known
}

/// Where sorted `rows` stand in a panel whose rows hold them all.
fn locate(node: &Supernode<'_>, rows: &[usize]) -> Vec<usize> {
    let end = node.start + node.columns;
    let mut at = 0;
    let place = |&row: &usize| {
        if row < end {
            return row - node.start;
        }
        while node.rows[at] < row {
            at += 1;
        }
        node.columns + at
    };
    rows.iter().map(place).collect()
}

/// Where one row stands in a panel.
fn local(node: &Supernode<'_>, row: usize) -> usize {
    let below = || node.columns + node.rows.partition_point(|&r| r < row);
    if row < node.start + node.columns { row - node.start } else { below() }
}

//! Measurements `y = H x + v`, `v ~ N(0, R)`: Bierman's scalar updates, up to six in one pass over U.
//!
//! The rows are whitened (`R = C C^T`, `H <- C^-1 H`, `y <- C^-1 y`, r = 1) and taken in turn. With `f = U^T h`, `v = D f`,
//! and the states in U's order (`a_0 = r`):
//!
//! ```text
//! a_j = a_{j-1} + f_j v_j,   d_j <- d_j a_{j-1} / a_j,   lambda_j = -f_j / a_{j-1},   K = b / a_n
//! (U_ij, b_i) <- (U_ij + lambda_j b_i, b_i + U_ij v_j)     i < j,   b_j = v_j
//! ```
//!
//! *One pass.* All but the last line needs f alone. The next row's f must be that of the updated U, whose columns are
//! `u_j + lambda_j sum_{k<j} u_k v_k`; so `f'_j <- f'_j + lambda_j sum_{k<j} v_k f'_k`, which needs no U either. Hence lambda
//! and v of all rows are found in O(n) each, and one sweep over U does the rest.
//!
//! H is given by the states that it touches. R must be positive definite. Gates are the caller's: see
//! [`Udu::innovation_covariance`].

use super::panel::Panel;
use super::{Real, Udu, check};
use crate::Error;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Most scalar rows that go through U in one pass; more are taken in several.
const MOST: usize = 6;

/// A measurement matrix by blocks: the columns of H from each index on; all others are zero.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows<T: Real> {
    /// Index of the first state of a block, and the columns of H there.
    pub blocks: Vec<(usize, DMatrix<T>)>,
}

/// What a measurement did.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction<T: Real> {
    /// What to add to the states, `K (y - H x)` of all rows.
    pub step: DVector<T>,
    /// `y^T S^-1 y`, chi-square with as many degrees of freedom as rows when all is well.
    pub nis: T,
}

/// What a pass over U needs of R rows, and the gains it leaves.
struct Pass<T, const R: usize> {
    lambda: Vec<[T; R]>,
    v: Vec<[T; R]>,
    /// `a_n`: the variance of the innovation, whitened.
    variance: [T; R],
}

impl<T: Real> Udu<T> {
    /// `S = H P H^T + R`, the covariance of the innovation: O(n).
    ///
    /// # Errors
    /// [`Error::Size`] when H reaches beyond the states or its rows are not those of R.
    pub fn innovation_covariance(&self, h: &Rows<T>, noise: &DMatrix<T>) -> Result<DMatrix<T>, Error> {
        self.check_rows(h, noise.nrows())?;
        let mut f = DMatrix::zeros(noise.nrows(), self.len());
        for first in (0..noise.nrows()).step_by(MOST) {
            let count = MOST.min(noise.nrows() - first);
            for (j, f_j) in self.project::<MOST>(&pieces(h, first, count)).iter().enumerate() {
                f.view_mut((first, j), (count, 1)).copy_from_slice(&f_j[..count]);
            }
        }
        let mut weighted = f.clone();
        weighted.column_iter_mut().zip(&self.d).for_each(|(mut column, d)| column *= *d);
        Ok(weighted * f.transpose() + noise)
    }

    /// Takes in `innovation = y - H x` with noise R and returns the step of the states.
    ///
    /// # Errors
    /// [`Error::Size`] as above, [`Error::NotPositiveDefinite`] for an R that is not, [`Error::NotFinite`] for an
    /// innovation or an H that is not; nothing is changed then.
    pub fn update(&mut self, h: &Rows<T>, innovation: &DVector<T>, noise: &DMatrix<T>) -> Result<Correction<T>, Error> {
        self.check_rows(h, innovation.len())?;
        check("noise (rows)", innovation.len(), noise.nrows())?;
        let root = Cholesky::new(noise.clone()).ok_or(Error::NotPositiveDefinite { block: 0 })?.l();
        let (h, y) = whitened(h, innovation, &root)?;
        let mut total = Correction { step: DVector::zeros(self.len()), nis: T::zero() };
        for first in (0..y.len()).step_by(MOST) {
            let count = MOST.min(y.len() - first);
            let part = (pieces(&h, first, count), y.rows(first, count).into_owned());
            match count {
                1 => self.pass::<1>(&part.0, &part.1, &mut total),
                2 | 3 => self.pass::<3>(&part.0, &part.1, &mut total),
                _ => self.pass::<6>(&part.0, &part.1, &mut total),
            }
        }
        Ok(total)
    }

    fn check_rows(&self, h: &Rows<T>, rows: usize) -> Result<(), Error> {
        for (first, block) in &h.blocks {
            check("measurement matrix (rows)", rows, block.nrows())?;
            if first + block.ncols() > self.len() {
                return Err(Error::Size {
                    what: "measurement matrix (columns)",
                    expected: self.len(),
                    got: first + block.ncols(),
                });
            }
        }
        Ok(())
    }

    /// One pass over U for up to R rows.
    fn pass<const R: usize>(&mut self, h: &Rows<T>, y: &DVector<T>, total: &mut Correction<T>) {
        let f = self.project::<R>(h);
        let pass = factors(f, &mut self.d);
        let mut gains = Vec::with_capacity(self.d.len());
        for panel in &mut self.panels {
            let b = panel.sweep(&pass.lambda, &pass.v);
            gains.extend((0..panel.rows()).map(|lane| b.map(|lanes| lanes[lane])));
        }
        for r in 0..y.len() {
            let moved: T = h.blocks.iter().fold(T::zero(), |sum, (first, block)| {
                sum + (block.row(r) * total.step.rows(*first, block.ncols()))[0]
            });
            let left = y[r] - moved;
            total.nis += left * left / pass.variance[r];
            let scale = left / pass.variance[r];
            total.step.iter_mut().zip(&gains).for_each(|(x, gain)| *x += gain[r] * scale);
        }
    }

    /// `f = U^T h` of each row.
    fn project<const R: usize>(&self, h: &Rows<T>) -> Vec<[T; R]> {
        let mut sums = vec![[T::zero(); R]; self.len()];
        for panel in &self.panels {
            if let Some(coefficients) = coefficients(panel, h) {
                panel.project(&coefficients, &mut sums);
            }
        }
        sums
    }
}

/// The coefficients of the rows of a panel; nothing when the measurement does not touch it.
fn coefficients<T: Real, const R: usize>(panel: &Panel<T>, h: &Rows<T>) -> Option<Vec<[T; R]>> {
    let (first, rows) = (panel.first(), panel.rows());
    let mut found = None;
    for (at, block) in &h.blocks {
        for c in 0..block.ncols() {
            let state = at + c;
            if state < first || state >= first + rows {
                continue;
            }
            let all = found.get_or_insert_with(|| vec![[T::zero(); R]; rows]);
            for r in 0..block.nrows() {
                all[state - first][r] += block[(r, c)];
            }
        }
    }
    found
}

/// The new D, and lambda, v, `a_n` of all rows. U's order runs from the last index of memory to the first.
fn factors<T: Real, const R: usize>(mut f: Vec<[T; R]>, d: &mut [T]) -> Pass<T, R> {
    let n = d.len();
    let mut pass = Pass { lambda: vec![[T::zero(); R]; n], v: vec![[T::zero(); R]; n], variance: [T::one(); R] };
    for r in 0..R {
        let mut carried = [T::zero(); R];
        let mut a = T::one();
        for j in (0..n).rev() {
            let (own, v) = (f[j][r], d[j] * f[j][r]);
            let lambda = -own / a;
            let sum = a + own * v;
            d[j] *= a / sum;
            a = sum;
            (pass.lambda[j][r], pass.v[j][r]) = (lambda, v);
            for k in r + 1..R {
                let before = f[j][k];
                f[j][k] += lambda * carried[k];
                carried[k] += v * before;
            }
        }
        pass.variance[r] = a;
    }
    pass
}

/// Rows `first..first + count` of H.
fn pieces<T: Real>(h: &Rows<T>, first: usize, count: usize) -> Rows<T> {
    Rows { blocks: h.blocks.iter().map(|(at, block)| (*at, block.rows(first, count).into_owned())).collect() }
}

fn whitened<T: Real>(h: &Rows<T>, y: &DVector<T>, root: &DMatrix<T>) -> Result<(Rows<T>, DVector<T>), Error> {
    let solve = |m: &DMatrix<T>| root.solve_lower_triangular(m).ok_or(Error::NotPositiveDefinite { block: 0 });
    let y = root.solve_lower_triangular(y).ok_or(Error::NotPositiveDefinite { block: 0 })?;
    let blocks = h.blocks.iter().map(|(at, block)| Ok((*at, solve(block)?))).collect::<Result<Vec<_>, Error>>()?;
    let finite = y.iter().chain(blocks.iter().flat_map(|(_, b)| b.iter())).all(|v| v.is_finite());
    if finite { Ok((Rows { blocks }, y)) } else { Err(Error::NotFinite { what: "a measurement" }) }
}

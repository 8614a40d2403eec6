//! Thornton's factorisation: `W diag(w) W^T = L diag(d) L^T`, L unit lower triangular, without forming the product.
//!
//! Modified weighted Gram-Schmidt, for the rows w_j from the first to the last:
//!
//! ```text
//! d_j = w_j . w_j,   L_ij = w_i . w_j / d_j,   w_i <- w_i - L_ij w_j   (i > j),   a . b = sum_k a_k weight_k b_k
//! ```
//!
//! A row without length (an exact state) gives `d_j = 0`, and nothing depends on it. L is the U of the reversed order.
//! Source: Thornton, Bierman, JPL TM 33-798 (1977); Bjorck, BIT 7 (1967) 1 on why the modified form is stable.

use super::Real;
use nalgebra::{DMatrix, RowDVector};

/// A unit lower triangle and a diagonal.
pub(super) struct Factors<T: Real> {
    pub unit: DMatrix<T>,
    pub d: Vec<T>,
}

pub(super) fn gram_schmidt<T: Real>(mut rows: DMatrix<T>, weights: &[T]) -> Factors<T> {
    let n = rows.nrows();
    let (mut unit, mut d) = (DMatrix::identity(n, n), vec![T::zero(); n]);
    for j in 0..n {
        let row = rows.row(j).into_owned();
        let weighted = RowDVector::from_iterator(row.len(), row.iter().zip(weights).map(|(&a, &w)| a * w));
        d[j] = weighted.dot(&row);
        if d[j] <= T::zero() {
            d[j] = T::zero();
            continue;
        }
        for i in j + 1..n {
            let share = rows.row(i).dot(&weighted) / d[j];
            unit[(i, j)] = share;
            rows.row_mut(i).zip_apply(&row, |a, b| *a -= share * b);
        }
    }
    Factors { unit, d }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_give_the_product_back() {
        let w = DMatrix::from_fn(4, 7, |i, k| ((i * 7 + k * k) % 11) as f64 - 4.0);
        let weights = [1.0, 0.5, 2.0, 0.0, 3.0, 1e-3, 10.0];
        let product = &w * DMatrix::from_diagonal(&weights.to_vec().into()) * w.transpose();
        let f = gram_schmidt(w, &weights);
        let back = &f.unit * DMatrix::from_diagonal(&f.d.into()) * f.unit.transpose();
        assert!((back - &product).amax() < 1e-13 * product.amax());
    }

    #[test]
    fn an_exact_row_stays_exact() {
        let f = gram_schmidt(DMatrix::from_row_slice(2, 2, &[0.0, 0.0, 3.0, 4.0]), &[1.0, 1.0]);
        assert_eq!((f.d, f.unit), (vec![0.0, 25.0], DMatrix::identity(2, 2)));
    }
}

//! Residuals of all motions, made white, and the normal equations of a Gauss-Newton step.
//!
//! The covariance of all residuals is block tridiagonal, for neighbours share a scan. Its Cholesky factor has blocks
//!
//! ```text
//! L_k L_k^T = S_k - M_k M_k^T,   M_k = C_k-1^T L_k-1^-T          S_k block k, C_k-1 covariance of k - 1 and k
//! y_k = L_k^-1 (r_k - M_k y_k-1),  and the rows of the design alike
//! N = sum W_k^T W_k,   g = sum W_k^T y_k,   step: N dx = g
//! ```
//!
//! Weights come after: y given what was before is what an outlier makes large, and what a weight makes small.

use super::motions::{Motions, Segments};
use super::noise::Scatter;
use super::parameters::{Full, FullSquare, Layout, Vehicle};
use super::prediction::{self, Matrix3x9, Prediction};
use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SymmetricEigen, Vector3};

/// Eigenvalues at this share of the largest are rounding.
const ROUNDING: f64 = 1e-13;

/// A residual and minus its derivative by all parameters.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Residual.
    pub residual: Vector3<f64>,
    /// Design.
    pub design: Matrix3x9,
}

/// Predictions and rows of all motions. A motion without steps (a delay drove it off the log) says nothing.
#[must_use]
pub fn rows(vehicle: &Vehicle, segments: &Segments, motions: &Motions) -> (Vec<Prediction>, Vec<Row>) {
    let one = |(k, m): (usize, &super::Motion)| {
        let prediction = prediction::predict(vehicle, segments.steps(k));
        if segments.steps(k).is_empty() {
            return (prediction, Row { residual: Vector3::zeros(), design: Matrix3x9::zeros() });
        }
        let residual = prediction::residual(&m.motion, &prediction.motion);
        (prediction, Row { residual, design: prediction::design(&prediction, &residual) })
    };
    motions.motions.iter().enumerate().map(one).unzip()
}

/// Residuals only.
#[must_use]
pub fn residuals(vehicle: &Vehicle, segments: &Segments, motions: &Motions) -> Vec<Vector3<f64>> {
    let one = |(k, m): (usize, &super::Motion)| match segments.steps(k) {
        [] => Vector3::zeros(),
        steps => prediction::residual(&m.motion, &prediction::motion(vehicle, steps)),
    };
    motions.motions.iter().enumerate().map(one).collect()
}

/// The Cholesky factor of a block tridiagonal covariance.
#[derive(Clone, Debug)]
pub struct Whitener {
    inverses: Vec<Matrix3<f64>>,
    lower: Option<Vec<Matrix3<f64>>>,
}

impl Whitener {
    /// Nothing when the covariance is not positive definite.
    #[must_use]
    pub fn new(scatter: &Scatter) -> Option<Self> {
        let Some(couplings) = &scatter.couplings else {
            let inverse = |s: &Matrix3<f64>| inverse_factor(s);
            if let (true, Some(block)) = (scatter.common, scatter.blocks.first()) {
                return Some(Self { inverses: vec![inverse(block)?; scatter.blocks.len()], lower: None });
            }
            return Some(Self { inverses: scatter.blocks.iter().map(inverse).collect::<Option<_>>()?, lower: None });
        };
        let mut inverses: Vec<Matrix3<f64>> = Vec::with_capacity(scatter.blocks.len());
        let mut lower = vec![Matrix3::zeros()];
        for (k, block) in scatter.blocks.iter().enumerate() {
            if let (Some(before), Some(c)) = (inverses.last(), k.checked_sub(1).map(|j| couplings[j])) {
                lower.push(c.transpose() * before.transpose());
            }
            inverses.push(inverse_factor(&(block - lower[k] * lower[k].transpose()))?);
        }
        Some(Self { inverses, lower: Some(lower) })
    }

    /// White rows.
    #[must_use]
    pub fn rows(&self, rows: &[Row]) -> Vec<Row> {
        let mut white: Vec<Row> = Vec::with_capacity(rows.len());
        for (k, row) in rows.iter().enumerate() {
            let Row { mut residual, mut design } = *row;
            if let Some((lower, before)) = self.lower.as_ref().zip(white.last()) {
                residual -= lower[k] * before.residual;
                design -= lower[k] * before.design;
            }
            white.push(Row { residual: self.inverses[k] * residual, design: self.inverses[k] * design });
        }
        white
    }

    /// White columns of any number.
    #[must_use]
    pub fn columns<const N: usize>(&self, columns: &[SMatrix<f64, 3, N>]) -> Vec<SMatrix<f64, 3, N>> {
        let mut white: Vec<SMatrix<f64, 3, N>> = Vec::with_capacity(columns.len());
        for (k, column) in columns.iter().enumerate() {
            let before = self.lower.as_ref().zip(white.last());
            let own = before.map_or(*column, |(lower, before)| column - lower[k] * before);
            white.push(self.inverses[k] * own);
        }
        white
    }
}

fn inverse_factor(block: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    block.cholesky()?.l().try_inverse()
}

impl Row {
    /// The row with a weight.
    #[must_use]
    pub fn weighted(&self, weight: f64) -> Self {
        let root = weight.sqrt();
        Self { residual: self.residual * root, design: self.design * root }
    }
}

/// Normal equations over all parameters.
#[must_use]
pub fn normal(white: &[Row]) -> (FullSquare, Full) {
    let (mut n, mut g) = (FullSquare::zeros(), Full::zeros());
    for row in white {
        n += row.design.tr_mul(&row.design);
        g += row.design.tr_mul(&row.residual);
    }
    (n, g)
}

/// The step of the free parameters, zero along directions that the data do not hold.
#[must_use]
pub fn step(layout: &Layout, at: &Full, normal: &FullSquare, gradient: &Full) -> DVector<f64> {
    let (information, gradient) = (layout.reduced(normal), layout.reduced_vector(gradient));
    let units = layout.useless(at);
    let axes = Axes::new(&information, &units);
    axes.pseudo_inverse(|value| value > 0.0) * gradient
}

/// Principal axes of an information matrix in units in which parameters compare.
#[derive(Clone, Debug)]
pub struct Axes {
    /// Information along the axes; what is rounding is zero.
    pub values: DVector<f64>,
    /// The axes as columns.
    pub vectors: DMatrix<f64>,
    units: DVector<f64>,
}

impl Axes {
    /// Of an information matrix, in units of `units` a parameter.
    #[must_use]
    pub fn new(information: &DMatrix<f64>, units: &DVector<f64>) -> Self {
        let scaled = DMatrix::from_fn(units.len(), units.len(), |r, c| information[(r, c)] * units[r] * units[c]);
        let finite = scaled.iter().all(|v| v.is_finite());
        let eigen = SymmetricEigen::new(if finite { scaled } else { DMatrix::zeros(units.len(), units.len()) });
        let rounding = ROUNDING * eigen.eigenvalues.amax();
        let values = eigen.eigenvalues.map(|v| if v > rounding { v } else { 0.0 });
        Self { values, vectors: eigen.eigenvectors, units: units.clone() }
    }

    /// Inverse over the axes whose information passes.
    #[must_use]
    pub fn pseudo_inverse(&self, passes: impl Fn(f64) -> bool) -> DMatrix<f64> {
        let n = self.units.len();
        let mut inverse = DMatrix::zeros(n, n);
        for (value, axis) in self.values.iter().zip(self.vectors.column_iter()).filter(|(v, _)| passes(**v)) {
            let axis = axis.component_mul(&self.units);
            inverse += &axis * axis.transpose() / *value;
        }
        inverse
    }
}

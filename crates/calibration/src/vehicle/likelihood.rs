//! Residuals of all motions, and the normal equations of a Gauss-Newton step.
//!
//! ```text
//! N = sum W_k^T W_k,   g = sum W_k^T y_k,   step: N dx = g       y, W residual and design, whitened
//! ```
//!
//! They are whitened first ([`super::whitener`]). Weights come after: y given what was before is what an outlier makes large,
//! and what a weight makes small.

use super::motions::{Motions, Segments};
use super::parameters::{Full, FullSquare, Layout, Vehicle};
use super::prediction::{self, Matrix3x9};
use nalgebra::{DMatrix, DVector, SymmetricEigen, Vector3};

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

/// Rows of all motions. A motion without steps (a delay drove it off the log) says nothing.
#[must_use]
pub fn rows(vehicle: &Vehicle, segments: &Segments, motions: &Motions) -> Vec<Row> {
    let one = |(k, m): (usize, &super::Motion)| {
        if segments.steps(k).is_empty() {
            return Row { residual: Vector3::zeros(), design: Matrix3x9::zeros() };
        }
        let prediction = prediction::predict(vehicle, segments.steps(k));
        let residual = prediction::residual(&m.motion, &prediction.motion);
        Row { residual, design: prediction::design(&prediction, &residual) }
    };
    motions.motions.iter().enumerate().map(one).collect()
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

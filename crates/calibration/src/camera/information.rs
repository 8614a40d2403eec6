//! Information of the views about the parameters: information with the poses eliminated, covariance, weak directions, views that
//! tell most.

use super::adjust::{State, blocks, reduced};
use super::normal::{Block, MAX};
use super::view::View;
use groma_models::Token;
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix};

/// Share of the largest eigenvalue of the scaled information at which a direction counts as not determined.
const WEAK: f64 = 1e-14;

/// What is known of the parameters at a state.
#[derive(Clone, Debug)]
pub(super) struct Knowledge {
    pub blocks: Vec<Block>,
    /// Covariance of the parameters for residuals of variance 1.
    pub covariance: DMatrix<f64>,
}

/// Knowledge, or the direction that is not determined.
pub(super) fn knowledge(state: &State, views: &[View]) -> Option<Result<Knowledge, DVector<f64>>> {
    let blocks = blocks(state, views)?;
    let count = state.camera.count();
    let information = total(&blocks, count)?;
    Some(invert(&information).map(|covariance| Knowledge { blocks, covariance }))
}

fn total(blocks: &[Block], count: usize) -> Option<DMatrix<f64>> {
    let mut sum = SMatrix::<f64, MAX, MAX>::zeros();
    for block in blocks {
        sum += reduced(block)?;
    }
    Some(sum.view((0, 0), (count, count)).into_owned())
}

/// The inverse, by eigenvalues of the matrix scaled to a diagonal of ones.
fn invert(information: &DMatrix<f64>) -> Result<DMatrix<f64>, DVector<f64>> {
    let scale = information.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
    let scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| information[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.symmetric_eigen();
    let (largest, mut covariance) = (eigen.eigenvalues.max(), DMatrix::zeros(scale.len(), scale.len()));
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        let direction = axis.component_mul(&scale);
        if *value <= WEAK * largest {
            return Err(direction.normalize());
        }
        covariance += &direction * direction.transpose() / *value;
    }
    Ok(covariance)
}

/// Covariances of the pose of a view for residuals of variance 1: from its corners alone, and with the share of the
/// parameters.
pub(super) fn pose_covariances(block: &Block, covariance: &DMatrix<f64>) -> Option<(Matrix6<f64>, Matrix6<f64>)> {
    let white = block.pose.try_inverse()?;
    let by_parameters = (white * block.cross.transpose()).columns(0, covariance.nrows()).into_owned();
    let shared = &by_parameters * covariance * by_parameters.transpose();
    Some((white, white + shared.fixed_view::<6, 6>(0, 0)))
}

/// The views that together tell most, greedily by the determinant of the information, at most so many, in their order.
pub(super) fn most_telling(state: &State, views: &[View], most: usize, token: &Token) -> Option<Vec<usize>> {
    let count = state.camera.count();
    let shares: Vec<DMatrix<f64>> = blocks(state, views)?
        .iter()
        .map(|block| Some(reduced(block)?.view((0, 0), (count, count)).into_owned()))
        .collect::<Option<_>>()?;
    let all: DMatrix<f64> = shares.iter().sum();
    let mut sum = DMatrix::from_diagonal(&(all.diagonal() * 1e-6));
    let mut chosen = vec![];
    while chosen.len() < most.min(views.len()) {
        token.check().ok()?;
        let gain = |k: &usize| determinant(&(&sum + &shares[*k]));
        let rest = (0..views.len()).filter(|k| !chosen.contains(k));
        let best = rest.map(|k| (gain(&k), k)).max_by(|a, b| a.0.total_cmp(&b.0))?.1;
        sum += &shares[best];
        chosen.push(best);
    }
    chosen.sort_unstable();
    Some(chosen)
}

/// Logarithm of the determinant.
fn determinant(information: &DMatrix<f64>) -> f64 {
    let factor = information.clone().cholesky();
    factor.map_or(f64::NEG_INFINITY, |f| f.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>())
}

//! Least squares and what belongs to it: dense and sparse solvers, robust losses, gates, marginal covariances.

pub mod block_matrix;
pub mod error;
mod selected_inverse;
pub mod sparse;

pub use block_matrix::BlockMatrix;
pub use error::Error;
pub use sparse::Cholesky;

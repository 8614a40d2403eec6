//! Least squares and what belongs to it: dense and sparse solvers, robust losses, gates, marginal covariances.

pub mod block_matrix;
pub mod chi_square;
pub mod error;
pub mod least_squares;
pub mod levenberg_marquardt;
pub mod loss;
pub mod random;
pub mod robust;
pub mod root;
mod selected_inverse;
pub mod sparse;
pub mod streams;
pub mod student;
pub mod udu;

pub use block_matrix::BlockMatrix;
pub use error::Error;
pub use loss::Loss;
pub use sparse::Cholesky;
pub use student::Student;
pub use udu::Udu;

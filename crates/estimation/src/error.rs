//! What may go wrong in an estimate, as values.

use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// A block of unknowns is not determined by the data (or the matrix is indefinite there).
    #[error("the system is not positive definite at block {block}: it is unconstrained")]
    NotPositiveDefinite {
        /// Index of the block of unknowns where the factorisation stopped.
        block: usize,
    },
    /// A number is NaN or infinite.
    #[error("{what} is not finite")]
    NotFinite {
        /// Where the number stood.
        what: &'static str,
    },
    /// Two arguments that belong together differ in size.
    #[error("{what}: expected {expected}, got {got}")]
    Size {
        /// Which argument.
        what: &'static str,
        /// The size that fits.
        expected: usize,
        /// The size that came.
        got: usize,
    },
    /// A sparse matrix has not the pattern that was analysed.
    #[error("the matrix has another pattern than the one that was analysed")]
    OtherPattern,
    /// There is not enough memory for the factor.
    #[error("not enough memory for the factor of a system of {unknowns} unknowns")]
    OutOfMemory {
        /// Order of the system.
        unknowns: usize,
    },
}

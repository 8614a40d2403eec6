//! What may go wrong with a network, as values.

use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// The numerical part failed.
    #[error(transparent)]
    Estimation(#[from] groma_estimation::Error),
    /// There is nothing to estimate from.
    #[error("{0}")]
    NoData(String),
}

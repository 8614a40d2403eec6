//! What may go wrong with a network, as values.

use groma_models::Cancelled;
use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// The numerical part failed.
    #[error(transparent)]
    Estimation(#[from] groma_estimation::Error),
    /// A setting is out of range.
    #[error("{name} = {value}: {rule}")]
    Setting {
        /// Its path.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// There is nothing to estimate from.
    #[error("{0}")]
    NoData(String),
}

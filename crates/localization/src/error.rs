//! What may go wrong, as values.

use crate::map::InvalidMap;
use crate::options::InvalidOption;
use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// A setting is out of range.
    #[error(transparent)]
    Option(#[from] InvalidOption),
    /// The map cannot be used.
    #[error(transparent)]
    Map(#[from] InvalidMap),
    /// A motion ends before the one before.
    #[error("time goes back: a motion ends at {stamp} s, after one that ended at {before} s")]
    TimeGoesBack {
        /// When it ends [s].
        stamp: f64,
        /// When the one before ended [s].
        before: f64,
    },
    /// A number is NaN or infinite, or a covariance is none.
    #[error("{what} is not finite, or its covariance is not symmetric and positive")]
    Unusable {
        /// Of what.
        what: &'static str,
    },
}

//! What may go wrong in a calibration, as values.

use groma_models::{Cancelled, wheel_log};
use thiserror::Error;

/// The one error of this part.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// The wheel log is none.
    #[error(transparent)]
    Log(#[from] wheel_log::Error),
    /// A motion is NaN, ends before it starts, or has a covariance that is none.
    #[error("motion {index} {why}")]
    Motion {
        /// Which, from 0.
        index: usize,
        /// What is wrong with it.
        why: &'static str,
    },
    /// Motions and their couplings differ in number.
    #[error("{motions} motions need {} couplings, not {couplings}", motions.saturating_sub(1))]
    Couplings {
        /// Number of motions.
        motions: usize,
        /// Number of couplings.
        couplings: usize,
    },
    /// Log and model do not go together.
    #[error("the model {model} needs a log {needs}")]
    Kind {
        /// Name of the model.
        model: &'static str,
        /// What the log lacks.
        needs: &'static str,
    },
    /// Too few motions lie within the log.
    #[error("{within} of {all} motions lie within the wheel log: calibration needs {needs} at least")]
    TooFew {
        /// Motions within the log.
        within: usize,
        /// Motions there are.
        all: usize,
        /// Motions needed.
        needs: usize,
    },
    /// A parameter cannot be free, or has no sense.
    #[error("{0}")]
    Parameter(String),
    /// Nothing moved, or nothing turned: the closed form has no solution.
    #[error("{0}")]
    Degenerate(&'static str),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

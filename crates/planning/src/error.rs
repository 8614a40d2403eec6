//! What can be wrong with a request for a plan.

use groma_models::Cancelled;
use thiserror::Error;

/// Why there is no plan.
#[derive(Debug, Error, PartialEq)]
pub enum Error {
    /// A number is out of range.
    #[error("{name} = {value}: {rule}")]
    Setting {
        /// What it is called.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// A graph that is none, or an arrival that contradicts what was seen before.
    #[error("{0}")]
    Graph(String),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// What was requested cannot be reached by any plan.
    #[error("{0}")]
    Unreachable(String),
}

impl Error {
    /// Refuses a value that does not hold `rule`.
    pub(crate) fn unless(holds: bool, name: &'static str, value: f64, rule: &'static str) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::Setting { name, value, rule }) }
    }
}

//! What can be wrong with a noun that somebody describes in numbers.

use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ModelError {
    /// A setting is out of range.
    #[error("{name} = {value}: {rule}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// Parts of a vehicle do not belong together.
    #[error("{0}")]
    Vehicle(String),
    /// A lens takes another number of parameters.
    #[error("a {lens} camera has {expected} parameters ({names}), not {got}")]
    Parameters {
        /// Name of the lens.
        lens: &'static str,
        /// How many it takes.
        expected: usize,
        /// Their names.
        names: String,
        /// How many came.
        got: usize,
    },
    /// Nothing is to be seen.
    #[error("the target has no panel")]
    NoPanel,
    /// Two panels cannot be distinguished.
    #[error("panels {0:?} and {1:?} share tags or name: give each its own")]
    SamePanels(String, String),
}

/// The value, or an error that names the rule it breaks.
pub(crate) fn require(name: &'static str, value: f64, holds: bool, rule: &'static str) -> Result<(), ModelError> {
    if holds && value.is_finite() { Ok(()) } else { Err(ModelError::Setting { name, value, rule }) }
}

//! What is said of a setting that cannot work.

use thiserror::Error;

/// A setting outside its range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name} = {value}: it must be {rule}")]
pub struct InvalidOption {
    /// Name of the setting.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
    /// What it must be.
    pub rule: &'static str,
}

/// An error unless `holds`.
///
/// # Errors
/// What the setting must be, if it is not.
pub fn require(holds: bool, name: &'static str, value: f64, rule: &'static str) -> Result<(), InvalidOption> {
    if holds { Ok(()) } else { Err(InvalidOption { name, value, rule }) }
}

//! What keeps an image from being looked at.

use thiserror::Error;

/// The one error of this crate.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum VisionError {
    /// Nobody has drawn these tags.
    #[error("no family of tags is called {name:?}: there are {known}")]
    UnknownFamily {
        /// What was requested.
        name: String,
        /// The names there are.
        known: String,
    },
    /// The family is drawn with one border only.
    #[error("tags of {family} have a border of 1 module, not of {border}")]
    Border {
        /// Name of the family.
        family: &'static str,
        /// What was requested.
        border: u32,
    },
    /// The pixels do not fill the image.
    #[error("{got} pixels do not make an image of {width} x {height}")]
    Size {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Pixels given.
        got: usize,
    },
    /// The library has no memory left.
    #[error("not enough memory to look for tags in an image of {width} x {height}")]
    Memory {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
}

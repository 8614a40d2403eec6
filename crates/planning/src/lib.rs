//! Where to drive such that what is calibrated or mapped becomes as accurate as required in the least distance.

pub mod camera;
pub mod error;
pub mod exploration;
pub mod vehicle;

pub use error::Error;

//! Settings of mapping. One set of defaults serves all recordings; what depends on the scanner or the wheels is learned.

use groma_features::{InvalidOption, falko, reflector, require};
use serde::{Deserialize, Serialize};

/// Settings of [`Mapper`](crate::mapper::Mapper).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Cell of the occupancy map [m].
    pub resolution: f64,
    /// Messages up to this late are put into the order of their stamps before they are used; what comes later is left out [s].
    pub lateness: f64,
    /// Each pose uses only what was seen before it; otherwise all of the recording.
    pub online: bool,
    /// Corner features.
    pub corners: falko::Options,
    /// Reflectors, where the scans have intensities.
    pub reflectors: reflector::Options,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            resolution: 0.05,
            lateness: 0.0,
            online: false,
            corners: falko::Options::default(),
            reflectors: reflector::Options::default(),
        }
    }
}

/// Largest cell of a map [m].
const LARGEST_CELL: f64 = 1.0;
/// Longest wait for late messages [s].
const LONGEST_WAIT: f64 = 60.0;

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let cell = self.resolution;
        require(cell > 0.0 && cell <= LARGEST_CELL, "resolution", cell, "above 0 m, at most 1 m")?;
        let wait = self.lateness;
        require((0.0..=LONGEST_WAIT).contains(&wait), "lateness", wait, "0 to 60 s")?;
        self.corners.validate()?;
        self.reflectors.validate()
    }
}

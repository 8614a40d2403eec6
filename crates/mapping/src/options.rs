//! Settings of mapping. One set of defaults serves all recordings; what depends on the scanner or the wheels is learned.

use groma_features::{falko, reflector};
use serde::{Deserialize, Serialize};

/// Settings of [`Mapper`](crate::mapper::Mapper).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Cell of the occupancy map [m].
    pub resolution: f64,
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
            online: false,
            corners: falko::Options::default(),
            reflectors: reflector::Options::default(),
        }
    }
}

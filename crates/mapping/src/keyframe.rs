//! A scan that the map is built of.

use groma_features::Keypoint;
use groma_features::reflector::Reflector;
use groma_tracking::Tracked;

/// A tracked scan and the corners and reflectors in it.
#[derive(Clone, Debug)]
pub struct Keyframe {
    /// The scan and where the tracker saw it.
    pub tracked: Tracked,
    /// Corners, in the vehicle frame.
    pub corners: Vec<Keypoint>,
    /// Reflectors, in the vehicle frame.
    pub reflectors: Vec<Reflector>,
}

impl From<Tracked> for Keyframe {
    /// Nothing is found in it yet.
    fn from(tracked: Tracked) -> Self {
        Self { tracked, corners: Vec::new(), reflectors: Vec::new() }
    }
}

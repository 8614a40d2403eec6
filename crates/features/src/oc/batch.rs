//! Many scans of one scanner at once, over threads.

use super::{Detector, Options};
use crate::Keypoint;
use groma_models::BeamGeometry;
use rayon::prelude::*;

/// The keypoints of every scan, in the order of the scans whatever the number of threads.
#[must_use]
pub fn detect_all(geometry: BeamGeometry, scans: &[&[f64]], options: Options) -> Vec<Vec<Keypoint>> {
    let detect = |cached: &mut Option<(usize, Detector)>, ranges: &&[f64]| {
        if cached.as_ref().is_none_or(|(beams, _)| *beams != ranges.len()) {
            *cached = None;
        }
        let (_, detector) =
            cached.get_or_insert_with(|| (ranges.len(), Detector::new(geometry, ranges.len(), options)));
        let mut keypoints = Vec::new();
        detector.detect(ranges, &mut keypoints);
        keypoints
    };
    scans.par_iter().map_init(|| None, detect).collect()
}

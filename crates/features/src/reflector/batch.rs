//! Many scans of one scanner at once, over threads.

use super::{Options, Reflector, detect};
use groma_models::BeamGeometry;
use rayon::prelude::*;

/// The reflectors of every scan `(ranges, intensities)`, in the order of the scans whatever the number of threads.
#[must_use]
pub fn detect_all(geometry: &BeamGeometry, scans: &[(&[f64], &[f64])], options: &Options) -> Vec<Vec<Reflector>> {
    scans.par_iter().map(|(ranges, intensities)| detect(ranges, intensities, geometry, options)).collect()
}

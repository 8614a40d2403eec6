//! From what a robot and the cameras recorded to the map of the network.
//!
//! Messages may come in any order, late and twice: they are sorted and distinguished by what they say, so the same set of
//! messages gives the same map. [`Survey::finish`] may be called at any time, for a map of what has come so far.
//!
//! ```text
//! detections -> stops (the robot stands) -> one averaged sighting a camera and stop -> filter, gates -> batch -> map
//! ```

mod alarm;
#[cfg(test)]
mod common_loop;
mod filtering;
mod judged;
mod lens;
mod refine;
pub mod result;
mod stops;

pub use alarm::{Moved, Slip};
pub use judged::{Judged, Verdict};
pub use lens::lens;
pub use result::{CameraResult, NetworkMap, WeakDirection};
pub use stops::{Halt, Seen};

use crate::batch::Lens;
use crate::{Error, options::Options};
use groma_geometry::Se2;
use groma_models::{Camera, Target, Token};
use nalgebra::{DMatrix, Vector2};

/// A camera of the network, as it is known before the survey.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownCamera {
    /// Its name.
    pub name: String,
    /// Its intrinsics.
    pub camera: Camera,
    /// Covariance of its parameters; nothing when it is not known.
    pub covariance: Option<DMatrix<f64>>,
}

/// Corners of one panel in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Time of the exposure [s].
    pub stamp: f64,
    /// Number of the camera.
    pub camera: usize,
    /// Number of the panel in the target.
    pub panel: usize,
    /// The stop that it was taken at, when it is known.
    pub stop: Option<u64>,
    /// Numbers of the corners.
    pub ids: Vec<u32>,
    /// Where they are [pixel].
    pub pixels: Vec<Vector2<f64>>,
    /// Standard deviation of a coordinate [pixel].
    pub sigmas: Vec<f64>,
}

/// A survey: what has been recorded so far.
#[derive(Clone, Debug)]
pub struct Survey {
    target: Target,
    cameras: Vec<KnownCamera>,
    odometry: Vec<(f64, Se2)>,
    detections: Vec<Detection>,
}

impl Survey {
    /// Nothing recorded yet.
    ///
    /// # Errors
    /// [`Error::NoData`] for a target that makes no sense or a covariance of a wrong size.
    pub fn new(target: Target, cameras: Vec<KnownCamera>) -> Result<Self, Error> {
        target.check().map_err(|e| Error::NoData(e.to_string()))?;
        for known in &cameras {
            let n = known.camera.count();
            if known.covariance.as_ref().is_some_and(|c| c.shape() != (n, n)) {
                return Err(Error::NoData(format!("{}: its covariance must be {n} x {n}", known.name)));
            }
        }
        Ok(Self { target, cameras, odometry: vec![], detections: vec![] })
    }

    /// The cameras, as they are known before the survey.
    #[must_use]
    pub fn cameras(&self) -> &[KnownCamera] {
        &self.cameras
    }

    /// A pose of the odometry; false when it is not finite and was left out.
    pub fn push_odometry(&mut self, stamp: f64, pose: Se2) -> bool {
        let taken = stamp.is_finite() && pose.to_vector().iter().all(|v| v.is_finite());
        if taken {
            self.odometry.push((stamp, pose));
        }
        taken
    }

    /// What a camera saw; false when it makes no sense (another camera, panel or number of values, a value that is not
    /// finite, a sigma that is not positive) and was left out.
    pub fn push_detection(&mut self, detection: Detection) -> bool {
        let d = &detection;
        let known = d.camera < self.cameras.len() && d.panel < self.target.panels.len();
        let counts = d.ids.len() == d.pixels.len() && d.ids.len() == d.sigmas.len();
        let finite = d.stamp.is_finite() && d.pixels.iter().all(|p| p.x.is_finite() && p.y.is_finite());
        let taken = known && counts && finite && d.sigmas.iter().all(|s| s.is_finite() && *s > 0.0);
        if taken {
            self.detections.push(detection);
        }
        taken
    }

    /// The map of what has been recorded.
    ///
    /// # Errors
    /// [`Error::Setting`]; [`Error::NoData`] when no camera saw the target while the odometry ran; [`Error::Cancelled`]; what
    /// the batch says.
    pub fn finish(&self, options: &Options, token: &Token) -> Result<NetworkMap, Error> {
        options.check()?;
        let lenses: Vec<Lens> = self.cameras.iter().map(|known| lens(known, options)).collect();
        let halts = stops::halts(self, options, token)?;
        let filtered = filtering::run(self, &lenses, &halts, options, token)?;
        let refined = refine::run(&lenses, &halts, &filtered, options, token)?;
        Ok(result::assemble(self, &lenses, &halts, &filtered, refined))
    }
}

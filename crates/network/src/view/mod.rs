//! From corners in an image to a view of the target: its pose, what is uncertain about it, and what else it could be.

pub mod corners;
pub mod fit;
pub mod start;

pub use corners::{Corner, average};
pub use fit::{Fit, Normal, by_twist, fit, normal};

use crate::View;
use groma_geometry::{LieGroup, Se3};
use groma_models::Camera;
use nalgebra::DMatrix;

/// Two fits are the same pose when they differ by less, in metres and radians together.
const SAME: f64 = 1e-3;
/// A pose is the right one of two when its cost is lower by this much: a likelihood ratio of a million.
const DECIDED: f64 = 27.6;

/// The poses that explain the corners of one camera at one stop, the best first.
#[derive(Clone, Debug, PartialEq)]
pub struct Sighting {
    /// One pose, or two when a single panel at small tilt leaves both possible.
    pub fits: Vec<Fit>,
}

impl Sighting {
    /// Fits the pose of the target to corners: from each panel's two planar solutions, refined over all corners of all
    /// panels. Nothing when no panel has enough corners or no fit converges.
    #[must_use]
    pub fn new(camera: &Camera, basis: &DMatrix<f64>, corners: &[Corner]) -> Option<Self> {
        let mut fits: Vec<Fit> =
            start::poses(camera, corners).iter().filter_map(|pose| fit(camera, basis, corners, pose)).collect();
        fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let best = fits.first()?.clone();
        let other = fits.into_iter().skip(1).find(|f| f.pose.minus(&best.pose).norm() > SAME);
        let possible = other.filter(|f| f.cost - best.cost < DECIDED);
        Some(Self { fits: std::iter::once(best).chain(possible).collect() })
    }

    /// Whether one pose alone explains the corners.
    #[must_use]
    pub fn is_decided(&self) -> bool {
        self.fits.len() == 1
    }
}

impl Fit {
    /// The fit as a measurement; `slack` is the standard deviation of what no corner noise explains, position [m] and
    /// rotation [rad], `used` the calibration states that the camera was made with.
    #[must_use]
    pub fn view(&self, slack: [f64; 2], used: &nalgebra::DVector<f64>) -> View {
        let [metres, radians] = slack.map(|s| s * s);
        let floor = nalgebra::Vector6::new(metres, metres, metres, radians, radians, radians);
        View {
            pose: self.pose,
            covariance: self.covariance + nalgebra::Matrix6::from_diagonal(&floor),
            sensitivity: self.sensitivity.clone(),
            calibration: used.clone(),
        }
    }

    /// How far two poses are apart, in metres and radians together.
    #[must_use]
    pub fn distance(&self, pose: &Se3) -> f64 {
        self.pose.minus(pose).norm()
    }
}

//! Covariances of the residuals: of the motions, plus what slip and unseen steering add.
//!
//! Where motions have no covariance, one matrix for all is estimated, which then stands for everything.

use super::motions::{Motions, Segments};
use super::options::Options;
use super::parameters::Vehicle;
use super::prediction::{self, Prediction};
use nalgebra::Matrix3;

/// Standard deviations of a motion of which nothing is known, to begin with: a millimetre, a milliradian.
const UNKNOWN: f64 = 1e-3;

/// What the residuals scatter like.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Covariance of every residual, up to the factor that is estimated.
    pub blocks: Vec<Matrix3<f64>>,
    /// Covariance of a residual and the next.
    pub couplings: Option<Vec<Matrix3<f64>>>,
    /// Whether all blocks are one matrix, to be estimated.
    pub common: bool,
}

impl Scatter {
    /// For a vehicle and its predictions.
    #[must_use]
    pub fn new(
        motions: &Motions,
        vehicle: &Vehicle,
        segments: &Segments,
        predictions: &[Prediction],
        options: &Options,
    ) -> Self {
        let Some(stated) = &motions.covariances else {
            return Self {
                blocks: vec![Matrix3::identity() * UNKNOWN.powi(2); motions.motions.len()],
                couplings: None,
                common: true,
            };
        };
        let wheels = |k: usize| {
            prediction::wheel_noise(vehicle, segments.steps(k), &predictions[k], options.slip, options.steering)
        };
        let blocks = stated.iter().enumerate().map(|(k, stated)| stated + wheels(k)).collect();
        Self { blocks, couplings: motions.couplings.clone(), common: false }
    }
}

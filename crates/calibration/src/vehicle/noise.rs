//! Covariances of the residuals: of the motions, plus what slip and unmeasured steering add.
//!
//! Where motions have no covariance, one matrix for all is estimated, which then represents everything.

use super::motions::{Motion, Motions, Segments};
use super::options::Options;
use super::parameters::Vehicle;
use super::wheel_process::WheelProcess;
use groma_models::WheelNoise;
use nalgebra::{Matrix3, Vector3};

/// Standard deviations of a motion of which nothing is known, to begin with: a millimetre, a milliradian.
const UNKNOWN: f64 = 1e-3;

/// What the residuals scatter like.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Covariance of every residual, up to the factor that is estimated, given the steering error at its start.
    pub blocks: Vec<Matrix3<f64>>,
    /// Covariance of a residual and the next.
    pub couplings: Option<Vec<Matrix3<f64>>>,
    /// The steering error that all residuals share; nothing where there is none.
    pub steering: Option<SharedSteering>,
    /// Whether all blocks are one matrix, to be estimated.
    pub common: bool,
}

/// A steering error that goes on from motion to motion.
#[derive(Clone, Debug, PartialEq)]
pub struct SharedSteering {
    /// Variance of the error at any time [rad^2].
    pub variance: f64,
    /// How it enters every motion and goes on to the next.
    pub links: Vec<SteeringLink>,
}

/// A motion and its steering error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteeringLink {
    /// Derivative of the residual by the steering error at the start of the motion.
    pub by_start: Vector3<f64>,
    /// Residual of that error at the start of the next motion.
    pub keep: f64,
    /// Variance of what has come to it by then [rad^2].
    pub fresh: f64,
    /// Covariance of the residual and the error at the start of the next motion, given that at the start of this one.
    pub with_next: Vector3<f64>,
}

impl Scatter {
    /// For a vehicle.
    #[must_use]
    pub fn new(motions: &Motions, vehicle: &Vehicle, segments: &Segments, options: &Options) -> Self {
        let Some(stated) = &motions.covariances else {
            return Self {
                blocks: vec![Matrix3::identity() * UNKNOWN.powi(2); motions.motions.len()],
                couplings: None,
                steering: None,
                common: true,
            };
        };
        let noise = options.noise;
        let of_wheels: Vec<WheelProcess> =
            (0..stated.len()).map(|k| WheelProcess::new(vehicle, segments.steps(k), &noise)).collect();
        let blocks = stated.iter().zip(&of_wheels).map(|(stated, own)| stated + own.covariance).collect();
        let steering = SharedSteering::new(&motions.motions, &of_wheels, &noise);
        Self { blocks, couplings: motions.couplings.clone(), steering, common: false }
    }
}

impl SharedSteering {
    /// Nothing where no steering error enters.
    fn new(motions: &[Motion], of_wheels: &[WheelProcess], noise: &WheelNoise) -> Option<Self> {
        if of_wheels.iter().all(|own| own.by_start == Vector3::zeros()) || noise.steering == 0.0 {
            return None;
        }
        let link = |(k, own): (usize, &WheelProcess)| {
            let next = motions.get(k + 1).map_or(motions[k].end, |next| next.start);
            let left = noise.kept(next - motions[k].start);
            SteeringLink {
                by_start: own.by_start,
                keep: left,
                fresh: noise.fresh(left),
                with_next: own.with_end * noise.kept(next - motions[k].end),
            }
        };
        let links = of_wheels.iter().enumerate().map(link).collect();
        Some(Self { variance: noise.steering.powi(2), links })
    }
}

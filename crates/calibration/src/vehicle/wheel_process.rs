//! What wheels do beside what they read during a motion: slip, and a steering error that the encoder does not see.
//!
//! ```text
//! slip       white noise on the path of every driven wheel, of variance slip^2 |path|
//! steering   e: Ornstein-Uhlenbeck, standard deviation s, memory tau:  Cov(e(t), e(t + d)) = s^2 exp(-|d|/tau)
//! ```
//!
//! Over a step of the wheels with motion `T_j` of the base, u the motion by path of a wheel and w that by angle, both of the
//! perturbation `T exp(xi)`, the error of the base and of the steering go on as
//!
//! ```text
//! e <- exp(-dt/tau) e + fresh,        xi <- Ad(T_j^-1) xi + w e + u slip
//! ```
//!
//! so that `xi = G e_start + n` at the end of the motion. G, Cov(n), Cov(n, e_end) are carried along; [`super::likelihood`]
//! joins the motions by e. A steering error far longer than a motion bends it in one way, a shorter one in several.
//!
//! Assumes that e is constant over half a step; steps longer than a share of the memory are taken in parts of equal
//! steering. Source: the adjoint, as in `groma-geometry`; Ornstein, Uhlenbeck, Phys. Rev. 36 (1930).

use super::parameters::Vehicle;
use groma_models::wheel_log::Step;
use groma_models::{Drive, WheelMotion, WheelNoise};
use nalgebra::{Matrix3, Vector3};

/// A step is taken in parts no longer than this share of the memory.
const SHARE: f64 = 0.25;
/// Parts of a step, at most: after so many memories a steering error has long averaged out.
const PARTS: f64 = 64.0;

/// Errors of one motion of the laser by its wheels, in its frame at the end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelProcess {
    /// Covariance of the motion, given the steering error at its start.
    pub covariance: Matrix3<f64>,
    /// Derivative of the motion by the steering error at its start.
    pub by_start: Vector3<f64>,
    /// Covariance of the motion and the steering error at its end, given that at its start.
    pub with_end: Vector3<f64>,
}

impl WheelProcess {
    /// For the steps of a motion.
    #[must_use]
    pub fn new(vehicle: &Vehicle, steps: &[Step], noise: &WheelNoise) -> Self {
        let mut base = Base::default();
        for step in steps {
            let parts = parts(vehicle, step, noise);
            (0..parts.0).for_each(|_| base.step(&vehicle.drive, &parts.1, noise));
        }
        let to_laser = vehicle.laser.inverse().adjoint();
        Self {
            covariance: to_laser * base.covariance * to_laser.transpose(),
            by_start: to_laser * base.by_start,
            with_end: to_laser * base.with_error,
        }
    }

    /// Covariance of the motion where nothing is known of the steering error at its start.
    #[must_use]
    pub fn marginal(&self, noise: &WheelNoise) -> Matrix3<f64> {
        self.covariance + self.by_start * self.by_start.transpose() * noise.steering.powi(2)
    }
}

/// A step in equal parts, short against the memory: their number and one of them.
fn parts(vehicle: &Vehicle, step: &Step, noise: &WheelNoise) -> (usize, Step) {
    let count = (step.duration / (SHARE * noise.memory)).ceil().clamp(1.0, PARTS);
    let mut part = Step { duration: step.duration / count, ..*step };
    part.input.x /= count;
    if matches!(vehicle.drive, Drive::Differential(_)) {
        part.input.y /= count;
    }
    (count as usize, part)
}

/// The errors of base and steering so far; `kept` of the steering error at the start is left.
struct Base {
    covariance: Matrix3<f64>,
    by_start: Vector3<f64>,
    with_error: Vector3<f64>,
    kept: f64,
    fresh: f64,
}

impl Default for Base {
    fn default() -> Self {
        let zero = Vector3::zeros();
        Self { covariance: Matrix3::zeros(), by_start: zero, with_error: zero, kept: 1.0, fresh: 0.0 }
    }
}

impl Base {
    fn step(&mut self, drive: &Drive, step: &Step, noise: &WheelNoise) {
        let own = WheelMotion::new(drive, step.input);
        let steers = own.by_angle;
        self.forget(step.duration / 2.0, noise);
        let carried = own.motion.inverse().adjoint();
        let across = carried * self.with_error * steers.transpose();
        self.covariance = carried * self.covariance * carried.transpose() + across + across.transpose();
        self.covariance += steers * steers.transpose() * self.fresh;
        self.covariance += own.slip(noise);
        self.by_start = carried * self.by_start + steers * self.kept;
        self.with_error = carried * self.with_error + steers * self.fresh;
        self.forget(step.duration / 2.0, noise);
    }

    /// The steering error goes on for a time.
    fn forget(&mut self, time: f64, noise: &WheelNoise) {
        let kept = noise.kept(time);
        self.kept *= kept;
        self.with_error *= kept;
        self.fresh = kept.powi(2) * self.fresh + noise.fresh(kept);
    }
}

//! From what the wheels say in a step to a motion with its noise.
//!
//! ```text
//! Q = G diag(var u) G^T + |path| diag(slip)          G = derivative of the motion's right perturbation by the inputs
//! tricycle       var u = ( travel |path| / scale^2, steering^2 )
//! differential   var u = travel |path of the wheel| / radius^2 of each wheel
//! ```
//!
//! Noise of a path grows with the path, that of a steering angle is one of each reading. What lasts, an error of calibration,
//! is no noise: it belongs to the [`CalibrationCovariance`](crate::CalibrationCovariance).

use crate::joint::Motion;
use groma_models::Drive;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// How much wheels are to be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WheelNoise {
    /// Variance of the path of a driven wheel per metre [m].
    pub travel: f64,
    /// Standard deviation of a steering angle [rad].
    pub steering: f64,
    /// Variance of the motion by slip per metre: along, across [m], turn [rad^2/m].
    pub slip: [f64; 3],
}

impl Default for WheelNoise {
    fn default() -> Self {
        Self { travel: 1e-4, steering: 0.2_f64.to_radians(), slip: [1e-6, 1e-6, 1e-6] }
    }
}

impl Motion {
    /// The motion of a step: counts and steering angle of a tricycle, counts left and right of a differential drive.
    #[must_use]
    pub fn of_wheels(drive: &Drive, input: Vector2<f64>, noise: &WheelNoise) -> Self {
        let increment = drive.increment(input);
        let variance = match drive {
            Drive::Tricycle(t) => {
                let path = (t.scale * input.x).abs();
                Vector2::new(noise.travel * path / (t.scale * t.scale), noise.steering * noise.steering)
            }
            Drive::Differential(d) => {
                Vector2::new(noise.travel * (input.x / d.left).abs(), noise.travel * (input.y / d.right).abs())
            }
        };
        let path = drive.path_and_turn(input).x.abs();
        let slip = Matrix3::from_diagonal(&Vector3::from(noise.slip)) * path;
        let by_input = increment.by_input;
        let covariance = by_input * Matrix2::from_diagonal(&variance) * by_input.transpose() + slip;
        Self { motion: increment.motion, covariance, by_drive: increment.by_parameter }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::{Differential, Tricycle};

    #[test]
    fn noise_grows_with_the_path_alone() {
        let tricycle = Drive::Tricycle(Tricycle::from_parameters([2.5e-4, 1.5, 1.0, 0.0, 0.0]));
        let noise = WheelNoise { steering: 0.0, ..WheelNoise::default() };
        let straight = |counts: f64| Motion::of_wheels(&tricycle, Vector2::new(counts, 0.0), &noise);
        let (one, four) = (straight(4000.0), straight(-16000.0));
        assert!((one.motion.x() - 1.0).abs() < 1e-12 && (four.motion.x() + 4.0).abs() < 1e-12);
        assert!((one.covariance.m11 - 1.01e-4).abs() < 1e-12 && (four.covariance.m11 - 4.04e-4).abs() < 1e-12);
        assert_eq!(straight(0.0).covariance, Matrix3::zeros());
    }

    #[test]
    fn wheels_that_differ_turn_the_vehicle() {
        let drive = Drive::Differential(Differential { left: 1e-3, right: 1e-3, axle: 0.5 });
        let motion = Motion::of_wheels(&drive, Vector2::new(1000.0, 1000.0), &WheelNoise::default());
        // The turn is the difference of two paths of a metre over the axle.
        assert!((motion.covariance.m33 - (2.0 * 1e-4 / 0.25 + 1e-6)).abs() < 1e-9, "{}", motion.covariance.m33);
    }
}

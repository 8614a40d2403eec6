//! From what the wheels say in a step to a motion of the filter, with its noise.
//!
//! ```text
//! Q = Q_wheels + |path| diag(floor)^2
//! ```
//!
//! Q_wheels is the noise of [`groma_models::wheel_motion`], for steps that are assumed to be independent. The floor is what the
//! model of a vehicle on a plane leaves out, per metre: steps of the steering encoder, which last as long as the steering is
//! held, play, uneven floors, wheels that slip sideways. It also pays for something that is no error of the wheels: the errors
//! of a corner in neighbouring scans have much in common, and the filter takes them for independent. With the noise of the
//! wheels alone, twelve metres in the simulated warehouse without a map have a NEES per degree of freedom of 2.7 (the true slip)
//! to 5.4 (the usual one); with the floor 1.6.
//!
//! A lasting error, one of calibration, is no noise: it belongs to the
//! [`CalibrationCovariance`](crate::CalibrationCovariance).

use crate::joint::Motion;
use groma_models::{Drive, WheelMotion, WheelNoise};
use nalgebra::{Matrix3, Vector2, Vector3};

/// Standard deviation of what the model leaves out after one metre: along, across [m], heading [rad].
const FLOOR: Vector3<f64> = Vector3::new(3e-3, 2e-3, 1e-3);

impl Motion {
    /// The motion of a step of `duration` [s]: counts and steering angle of a tricycle, counts left and right of a
    /// differential drive.
    #[must_use]
    pub fn of_wheels(drive: &Drive, input: Vector2<f64>, duration: f64, noise: &WheelNoise) -> Self {
        let step = WheelMotion::new(drive, input);
        let path = drive.path_and_turn(input).x.abs();
        let floor = Matrix3::from_diagonal(&FLOOR.component_mul(&FLOOR)) * path;
        Self { motion: step.motion, covariance: step.covariance(duration, noise) + floor, by_drive: step.by_drive }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::{Differential, Tricycle};

    #[test]
    fn noise_grows_with_the_path_whichever_way() {
        let fork = Drive::Tricycle(Tricycle::from_parameters([2.5e-4, 1.5, 1.0, 0.0, 0.0]));
        let noise = WheelNoise { slip: 2e-3, ..WheelNoise::default() };
        let straight = |counts: f64, dt| Motion::of_wheels(&fork, Vector2::new(counts, 0.0), dt, &noise);
        let (one, four) = (straight(4000.0, 1.0), straight(-16000.0, 4.0));
        assert!((one.motion.x() - 1.0).abs() < 1e-12 && (four.motion.x() + 4.0).abs() < 1e-12);
        assert!((four.covariance.m11 / one.covariance.m11 - 4.0).abs() < 1e-9);
        assert!(one.covariance.m11 > 4e-6 && one.covariance.m22 > 1e-6, "slip, and nothing is exact across");
        assert_eq!(straight(0.0, 1.0).covariance, Matrix3::zeros());
    }

    #[test]
    fn a_wheel_that_slips_turns_a_differential_drive() {
        let drive = Drive::Differential(Differential { left: 1e-3, right: 1e-3, axle: 0.5 });
        let turn = |slip: f64| {
            let noise = WheelNoise { slip, ..WheelNoise::default() };
            Motion::of_wheels(&drive, Vector2::new(1000.0, 1000.0), 1.0, &noise).covariance.m33
        };
        // The difference of two paths of a metre over the axle.
        assert!((turn(0.01) - turn(0.0) - 2.0 * 1e-4 / 0.25).abs() < 1e-9);
    }

    #[test]
    fn a_wheel_that_is_larger_than_known_moves_the_vehicle_farther() {
        let motion = |left: f64, axle: f64| {
            let drive = Drive::Differential(Differential { left, right: 1e-3, axle });
            Motion::of_wheels(&drive, Vector2::new(900.0, 1000.0), 1.0, &WheelNoise::default())
        };
        let known = motion(1e-3, 0.5);
        for (column, changed, by) in [(0, motion(1e-3 + 1e-9, 0.5), 1e-9), (2, motion(1e-3, 0.5 + 1e-6), 1e-6)] {
            let moved = changed.motion.minus(&known.motion) / by;
            assert!((known.by_drive.column(column) - moved).norm() < 1e-3 * moved.norm(), "{column}");
        }
    }
}

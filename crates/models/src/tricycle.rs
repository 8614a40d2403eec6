//! A tricycle: one steered and driven wheel ahead of, or behind, two fixed wheels that roll freely.
//!
//! The base is midway between the fixed wheels, x forward; the steered wheel is at `(wheelbase, 0)`. With n counts of
//! the drive wheel and the encoder of the steering at a:
//!
//! ```text
//! d     = scale n                path of the wheel [m]
//! delta = gain a + offset        offset of the direction: forward for d >= 0, backward else
//! u     = (d cos delta, d sin delta / wheelbase)
//! ```
//!
//! Source: Kallasi et al., "A novel calibration method for industrial AGVs", Robotics and Autonomous Systems 94 (2017),
//! whose asymmetric model has the two offsets; gain and wheelbase are additions.

use crate::increment::{Matrix2x5, PARAMETERS, Twist};
use nalgebra::{Matrix2, Vector2};

/// Parameters of a tricycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tricycle {
    /// Path of the drive wheel per count [m], or its radius [m] where the log has radians.
    pub scale: f64,
    /// From the axle of the fixed wheels to the steered wheel [m], negative where that is behind.
    pub wheelbase: f64,
    /// Angle of the wheel per angle of the encoder.
    pub gain: f64,
    /// Angle of the wheel where the encoder shows zero, driving forward [rad].
    pub offset_forward: f64,
    /// The same, driving backward [rad].
    pub offset_backward: f64,
}

impl Tricycle {
    /// Names of the parameters in the order of every derivative.
    pub const NAMES: [&'static str; PARAMETERS] =
        ["drive_scale", "wheelbase", "steering_gain", "steering_offset_forward", "steering_offset_backward"];

    /// From numbers in the order of [`Self::NAMES`].
    #[must_use]
    pub fn from_parameters(p: [f64; PARAMETERS]) -> Self {
        let [scale, wheelbase, gain, offset_forward, offset_backward] = p;
        Self { scale, wheelbase, gain, offset_forward, offset_backward }
    }

    /// The parameters in the order of [`Self::NAMES`].
    #[must_use]
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        [self.scale, self.wheelbase, self.gain, self.offset_forward, self.offset_backward]
    }

    /// Angle of the wheel [rad] for counts of either direction.
    #[must_use]
    pub fn steering_angle(&self, counts: f64, encoder: f64) -> f64 {
        self.gain * encoder + if self.scale * counts < 0.0 { self.offset_backward } else { self.offset_forward }
    }

    /// Path [m] and turn [rad] of a step: `(counts, encoder angle)`.
    #[must_use]
    pub fn path_and_turn(&self, input: Vector2<f64>) -> Vector2<f64> {
        let (sin, cos) = self.steering_angle(input.x, input.y).sin_cos();
        self.scale * input.x * Vector2::new(cos, sin / self.wheelbase)
    }

    /// The same with derivatives by input and parameters.
    #[must_use]
    pub fn twist(&self, input: Vector2<f64>) -> Twist {
        let (n, a, l) = (input.x, input.y, self.wheelbase);
        let (sin, cos) = self.steering_angle(n, a).sin_cos();
        let d = self.scale * n;
        let by_angle = Vector2::new(-d * sin, d * cos / l);
        let by_counts = Vector2::new(cos, sin / l);
        let side = if d < 0.0 { [0.0, 1.0] } else { [1.0, 0.0] };
        Twist {
            value: by_counts * d,
            by_input: Matrix2::from_columns(&[by_counts * self.scale, by_angle * self.gain]),
            by_parameter: Matrix2x5::from_columns(&[
                by_counts * n,
                Vector2::new(0.0, -d * sin / (l * l)),
                by_angle * a,
                by_angle * side[0],
                by_angle * side[1],
            ]),
        }
    }
}

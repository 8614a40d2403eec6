//! A differential drive: two driven wheels on one axle, the base midway, x forward.
//!
//! With counts l and r of the left and the right wheel:
//!
//! ```text
//! u = ((left l + right r)/2, (right r - left l)/axle)
//! ```
//!
//! Source: Censi et al., "Simultaneous calibration of odometry and sensor parameters for mobile robots", IEEE T-RO 29
//! (2013), equations (1)-(3).

use crate::increment::{Matrix2x5, PARAMETERS, Twist};
use nalgebra::{Matrix2, Vector2};

/// Parameters of a differential drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Differential {
    /// Path of the left wheel per count [m], or its radius [m] where the log has radians.
    pub left: f64,
    /// The same of the right wheel.
    pub right: f64,
    /// Distance of the wheels [m].
    pub axle: f64,
}

impl Differential {
    /// Names of the parameters in the order of every derivative.
    pub const NAMES: [&'static str; 3] = ["left_radius", "right_radius", "axle"];

    /// From numbers in the order of [`Self::NAMES`]; the rest is not used.
    #[must_use]
    pub fn from_parameters(p: [f64; PARAMETERS]) -> Self {
        Self { left: p[0], right: p[1], axle: p[2] }
    }

    /// The parameters in the order of [`Self::NAMES`], then zeros.
    #[must_use]
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        [self.left, self.right, self.axle, 0.0, 0.0]
    }

    /// Path [m] and turn [rad] of a step: counts of the left and the right wheel.
    #[must_use]
    pub fn path_and_turn(&self, input: Vector2<f64>) -> Vector2<f64> {
        let (left, right) = (self.left * input.x, self.right * input.y);
        Vector2::new((left + right) / 2.0, (right - left) / self.axle)
    }

    /// The same with derivatives by input and parameters.
    #[must_use]
    pub fn twist(&self, input: Vector2<f64>) -> Twist {
        let (value, b) = (self.path_and_turn(input), self.axle);
        let mut by_parameter = Matrix2x5::zeros();
        by_parameter.set_column(0, &(Vector2::new(0.5, -1.0 / b) * input.x));
        by_parameter.set_column(1, &(Vector2::new(0.5, 1.0 / b) * input.y));
        by_parameter.set_column(2, &Vector2::new(0.0, -value.y / b));
        let by_input = Matrix2::new(self.left / 2.0, self.right / 2.0, -self.left / b, self.right / b);
        Twist { value, by_input, by_parameter }
    }
}

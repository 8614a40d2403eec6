//! The motion that wheels make in one step, at a constant rate of wheels and steering: an arc of a circle, exactly.
//!
//! ```text
//! u = (forward, turn)             path of the base along its own x [m], turn [rad]
//! T = exp(forward, 0, turn)       from the base before to the base after
//! dT: T exp(d),  d = Jr (du_1, 0, du_2)
//! ```
//!
//! Inputs are two numbers a step: wheel increment and steering angle of a tricycle, increments left and right of a
//! differential drive. Source: Sola et al. (see `groma-geometry`), equations (161)-(163). Assumes that the wheels do
//! not slip sideways.

use groma_geometry::Se2;
use nalgebra::{Matrix2, Matrix3x2, SMatrix, Vector2, Vector3};

/// Parameters of a drive, at most.
pub const PARAMETERS: usize = 5;

/// Derivatives of something with two rows by the parameters of a drive.
pub type Matrix2x5 = SMatrix<f64, 2, PARAMETERS>;
/// Derivatives of a motion by the parameters of a drive.
pub type Matrix3x5 = SMatrix<f64, 3, PARAMETERS>;

/// Path and turn of a step, with derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twist {
    /// Path along x of the base [m], negative backward; turn [rad].
    pub value: Vector2<f64>,
    /// Derivative by the two inputs.
    pub by_input: Matrix2<f64>,
    /// Derivative by the parameters of the drive; columns that it does not have are zero.
    pub by_parameter: Matrix2x5,
}

/// The motion of a step, with derivatives of the right perturbation `T exp(d)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Increment {
    /// `T_before_after`.
    pub motion: Se2,
    /// Derivative by the two inputs.
    pub by_input: Matrix3x2<f64>,
    /// Derivative by the parameters of the drive.
    pub by_parameter: Matrix3x5,
}

/// The motion of a path and a turn.
#[must_use]
pub fn arc(path_and_turn: Vector2<f64>) -> Se2 {
    Se2::exp(Vector3::new(path_and_turn.x, 0.0, path_and_turn.y))
}

impl Twist {
    /// The motion along the arc.
    #[must_use]
    pub fn increment(&self) -> Increment {
        let xi = Vector3::new(self.value.x, 0.0, self.value.y);
        let j = Se2::right_jacobian(xi);
        let by_twist = Matrix3x2::from_columns(&[j.column(0), j.column(2)]);
        Increment {
            motion: Se2::exp(xi),
            by_input: by_twist * self.by_input,
            by_parameter: by_twist * self.by_parameter,
        }
    }
}

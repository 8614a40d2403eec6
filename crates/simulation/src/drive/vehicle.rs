//! What the wheels do when the vehicle moves, and back: exact for a step of constant speed and turn rate.
//!
//! A step moves the base along an arc of length `delta` that turns by `phi`: `T <- T exp((delta, 0, phi))`.
//!
//! ```text
//! differential   r_l turn_l = delta - phi b / 2,  r_r turn_r = delta + phi b / 2
//! tricycle       r turn cos(alpha) = delta,       r turn sin(alpha) / L = phi,   alpha = steering + steering_offset
//! ```
//!
//! The tricycle has one steered and driven wheel, the base frame sits at the middle of the fixed axle.
//! A standing tricycle keeps its steering angle. Wheels roll without slip here; slip is an error of the readings.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Kind and size of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Vehicle {
    /// Two driven wheels on one axle.
    Differential {
        /// Radius of the left wheel [m].
        left_radius: f64,
        /// Radius of the right wheel [m].
        right_radius: f64,
        /// Distance between the wheels [m].
        separation: f64,
    },
    /// One steered, driven wheel in front of a fixed axle.
    Tricycle {
        /// Radius of the driven wheel [m].
        radius: f64,
        /// Distance of the driven wheel from the fixed axle [m].
        wheelbase: f64,
        /// Angle of the wheel when the steering encoder reads zero [rad].
        steering_offset: f64,
    },
}

/// The two joints of a vehicle over one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheels {
    /// Turn of the left wheel, or of the driven wheel [rad].
    pub first: f64,
    /// Turn of the right wheel [rad], or the steering angle held during the step [rad].
    pub second: f64,
}

impl Vehicle {
    /// Names of the two joints.
    #[must_use]
    pub fn joint_names(&self) -> [&'static str; 2] {
        match self {
            Self::Differential { .. } => ["left_wheel_joint", "right_wheel_joint"],
            Self::Tricycle { .. } => ["traction_joint", "steering_joint"],
        }
    }

    /// Whether it can turn without moving forward.
    #[must_use]
    pub fn turns_on_the_spot(&self) -> bool {
        matches!(self, Self::Differential { .. })
    }

    /// What the joints do while the base moves by `(delta, phi)` [m, rad]; `held` is the step before.
    #[must_use]
    pub fn wheels(&self, delta: f64, phi: f64, held: Wheels) -> Wheels {
        match *self {
            Self::Differential { left_radius, right_radius, separation } => Wheels {
                first: (delta - phi * separation / 2.0) / left_radius,
                second: (delta + phi * separation / 2.0) / right_radius,
            },
            Self::Tricycle { .. } if delta == 0.0 && phi == 0.0 => Wheels { first: 0.0, ..held },
            Self::Tricycle { radius, wheelbase, steering_offset } => {
                let side = phi * wheelbase;
                let backwards = if delta < 0.0 { -1.0 } else { 1.0 };
                Wheels {
                    first: backwards * delta.hypot(side) / radius,
                    second: (backwards * side).atan2(backwards * delta) - steering_offset,
                }
            }
        }
    }

    /// Motion of the base `(delta, 0, phi)` [m, m, rad] when the joints do `wheels`.
    #[must_use]
    pub fn motion(&self, wheels: Wheels) -> Vector3<f64> {
        match *self {
            Self::Differential { left_radius, right_radius, separation } => {
                let (left, right) = (left_radius * wheels.first, right_radius * wheels.second);
                Vector3::new((left + right) / 2.0, 0.0, (right - left) / separation)
            }
            Self::Tricycle { radius, wheelbase, steering_offset } => {
                let (sin, cos) = (wheels.second + steering_offset).sin_cos();
                let travel = radius * wheels.first;
                Vector3::new(travel * cos, 0.0, travel * sin / wheelbase)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vehicles() -> [Vehicle; 2] {
        [
            Vehicle::Differential { left_radius: 0.1, right_radius: 0.11, separation: 0.5 },
            Vehicle::Tricycle { radius: 0.12, wheelbase: 1.2, steering_offset: 0.03 },
        ]
    }

    proptest! {
        #[test]
        fn wheels_tell_the_motion(delta in -1.0..1.0_f64, phi in -1.0..1.0_f64) {
            for vehicle in vehicles() {
                let wheels = vehicle.wheels(delta, phi, Wheels { first: 0.0, second: 0.0 });
                prop_assert!((vehicle.motion(wheels) - Vector3::new(delta, 0.0, phi)).norm() < 1e-12);
            }
        }
    }
}

//! Any of the drives, for code that does not care which.

use crate::differential::Differential;
use crate::increment::{Increment, PARAMETERS, Twist, arc};
use crate::tricycle::Tricycle;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// A drive with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Drive {
    /// One steered, driven wheel.
    Tricycle(Tricycle),
    /// Two driven wheels.
    Differential(Differential),
}

impl Drive {
    /// Names of the parameters in the order of every derivative.
    #[must_use]
    pub fn names(&self) -> &'static [&'static str] {
        match self {
            Self::Tricycle(_) => &Tricycle::NAMES,
            Self::Differential(_) => &Differential::NAMES,
        }
    }

    /// The parameters in the order of [`Self::names`], then zeros.
    #[must_use]
    pub fn parameters(&self) -> [f64; PARAMETERS] {
        match self {
            Self::Tricycle(t) => t.parameters(),
            Self::Differential(d) => d.parameters(),
        }
    }

    /// The same drive with other parameters.
    #[must_use]
    pub fn with_parameters(&self, p: [f64; PARAMETERS]) -> Self {
        match self {
            Self::Tricycle(_) => Self::Tricycle(Tricycle::from_parameters(p)),
            Self::Differential(_) => Self::Differential(Differential::from_parameters(p)),
        }
    }

    /// Path [m] and turn [rad] of a step.
    #[must_use]
    pub fn path_and_turn(&self, input: Vector2<f64>) -> Vector2<f64> {
        match self {
            Self::Tricycle(t) => t.path_and_turn(input),
            Self::Differential(d) => d.path_and_turn(input),
        }
    }

    /// Path and turn of a step with derivatives.
    #[must_use]
    pub fn twist(&self, input: Vector2<f64>) -> Twist {
        match self {
            Self::Tricycle(t) => t.twist(input),
            Self::Differential(d) => d.twist(input),
        }
    }

    /// The motion of a step, `T_before_after`.
    #[must_use]
    pub fn motion(&self, input: Vector2<f64>) -> Se2 {
        arc(self.path_and_turn(input))
    }

    /// The motion of a step with derivatives.
    #[must_use]
    pub fn increment(&self, input: Vector2<f64>) -> Increment {
        self.twist(input).increment()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRICYCLE: Drive = Drive::Tricycle(Tricycle {
        scale: 2.5e-4,
        wheelbase: 1.5,
        gain: 1.01,
        offset_forward: -0.012,
        offset_backward: -0.014,
    });
    const DIFFERENTIAL: Drive = Drive::Differential(Differential { left: 0.0209, right: 0.0211, axle: 0.089 });

    fn cases() -> Vec<(Drive, Vector2<f64>)> {
        let steered = [(8000.0, 0.4), (-9000.0, -0.3), (4000.0, 1.5), (500.0, 0.012 / 1.01), (-3.0, 0.2)];
        let wheels = [(2.0, 3.0), (-2.0, 3.0), (-40.0, -41.0), (5.0, 5.0 * 0.0209 / 0.0211), (0.0, 1.0)];
        let to_case = |drive: Drive| move |(a, b): (f64, f64)| (drive, Vector2::new(a, b));
        steered.into_iter().map(to_case(TRICYCLE)).chain(wheels.into_iter().map(to_case(DIFFERENTIAL))).collect()
    }

    /// Derivative of the right perturbation by differences.
    fn difference(f: impl Fn(f64) -> Se2, h: f64) -> nalgebra::Vector3<f64> {
        f(h).minus(&f(-h)) / (2.0 * h)
    }

    #[test]
    fn derivatives_equal_differences() {
        for (drive, input) in cases() {
            let increment = drive.increment(input);
            for k in 0..2 {
                let h = 1e-5 * input[k].abs().max(0.1);
                let moved = |d: f64| drive.motion(input + Vector2::ith(k, d));
                let (numeric, exact) = (difference(moved, h), increment.by_input.column(k));
                assert!((numeric - exact).norm() < 1e-7 * (1.0 + exact.norm()), "{drive:?} input {k}");
            }
            for k in 0..drive.names().len() {
                let p = drive.parameters();
                let h = 1e-6 * p[k].abs();
                let moved = |d: f64| {
                    let mut p = p;
                    p[k] += d;
                    drive.with_parameters(p).motion(input)
                };
                let (numeric, exact) = (difference(moved, h), increment.by_parameter.column(k));
                let name = drive.names()[k];
                assert!((numeric - exact).norm() < 1e-6 * (1.0 + exact.norm()), "{name}: {numeric} {exact}");
            }
        }
    }

    /// The steered wheel, at the end of the wheelbase, turns about the same centre: the circle by plain geometry.
    #[test]
    fn a_tricycle_drives_on_the_circle_of_its_steering() {
        let Drive::Tricycle(t) = TRICYCLE else { return };
        for (n, a) in [(20_000.0, 0.5), (-20_000.0, -0.8)] {
            let delta = t.steering_angle(n, a);
            let radius = t.wheelbase / delta.tan();
            let turn = t.scale * n * delta.sin() / t.wheelbase;
            let motion = TRICYCLE.motion(Vector2::new(n, a));
            let expected = (radius * turn.sin(), radius * (1.0 - turn.cos()));
            assert!((motion.x() - expected.0).abs() < 1e-12 && (motion.y() - expected.1).abs() < 1e-12);
            let wheel_path = radius.hypot(t.wheelbase) * turn.abs();
            assert!((wheel_path - t.scale * n.abs()).abs() < 1e-12);
        }
    }

    #[test]
    fn steps_of_constant_steering_join_to_one() {
        for (drive, input) in cases() {
            let share = |s: f64| match drive {
                Drive::Tricycle(_) => Vector2::new(s * input.x, input.y),
                Drive::Differential(_) => s * input,
            };
            let two = drive.motion(share(0.3)) * drive.motion(share(0.7));
            assert!(two.minus(&drive.motion(input)).norm() < 1e-12);
        }
    }

    #[test]
    fn equal_wheels_spin_about_the_middle() {
        let even = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let spun = even.motion(Vector2::new(-2.5, 2.5));
        assert!(spun.translation.norm() < 1e-15 && (spun.theta() - 1.0).abs() < 1e-15);
    }
}

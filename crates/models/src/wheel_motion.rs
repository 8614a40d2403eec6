//! The motion of a step of the wheels, and what the noise of the wheels does to it: the one place where both are known.
//!
//! ```text
//! slip        the path p of every driven wheel is off by white noise of variance  slip^2 |p|
//! steering    the angle is off by e(t), Ornstein-Uhlenbeck:  Cov(e(t), e(t + d)) = steering^2 exp(-|d|/memory)
//! motion      T exp(xi),  xi = sum u_w n_w + w e       u_w = d xi/d path of wheel w,  w = d xi/d angle
//! ```
//!
//! Slip is new in every step. A steering error lasts, so its effect depends on the time considered:
//!
//! ```text
//! over motions   e is carried along with the motion:     e <- k e + fresh,  k = exp(-dt/memory), Var(fresh) = steering^2 (1 - k^2)
//! in a filter    steps are assumed to be independent:      Var(e) = 2 steering^2 memory/dt
//! ```
//!
//! The second is the white noise that bends a drive much longer than the memory as much as e does:
//! `integral Cov(e(0), e(d)) dd = 2 steering^2 memory = Var(e) dt`. Within a memory it overstates the error, by at most
//! `2 memory/t` in variance; it never understates it. An error that is constant over a drive is not noise but an error of the
//! parameters, and belongs to the covariance of the vehicle.
//!
//! Sources: Censi et al., IEEE T-RO 29 (2013), for slip that grows with the path; Uhlenbeck, Ornstein, Phys. Rev. 36 (1930).
//! Assumes that the fixed wheels do not slip sideways.

use crate::drive::Drive;
use crate::increment::{Matrix3x5, arc};
use crate::vehicle::{Vehicle, WheelNoise};
use crate::wheel_log::WheelKind;
use groma_geometry::Se2;
use nalgebra::{Matrix3, Matrix3x2, Vector2, Vector3};
use std::f64::consts::PI;

/// Where a tricycle has its offsets: an error of the angle moves both.
const OFFSET_FORWARD: usize = 3;
/// See [`OFFSET_FORWARD`].
const OFFSET_BACKWARD: usize = 4;
/// Variance of an angle of which nothing is known [rad^2].
const UNKNOWN_ANGLE: f64 = PI * PI / 3.0;

/// The path of a driven wheel in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelPath {
    /// Path [m], negative backward.
    pub path: f64,
    /// Perturbation of the motion by a metre more of it.
    pub by_path: Vector3<f64>,
}

/// The motion of a step, with the ways in which it can be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelMotion {
    /// `T_before_after`.
    pub motion: Se2,
    /// Perturbation `T exp(xi)` by the parameters of the drive; columns that it does not have are zero.
    pub by_drive: Matrix3x5,
    /// Perturbation by the two inputs.
    pub by_input: Matrix3x2<f64>,
    /// The driven wheels; a tricycle has one, its second does nothing.
    pub wheels: [WheelPath; 2],
    /// Perturbation by the angle of the steered wheel [1/rad]; zero where none is steered.
    pub by_angle: Vector3<f64>,
}

impl WheelMotion {
    /// The motion of a step: counts and steering angle of a tricycle, counts left and right of a differential drive.
    #[must_use]
    pub fn new(drive: &Drive, input: Vector2<f64>) -> Self {
        let increment = drive.increment(input);
        let by_input = increment.by_input;
        let none = WheelPath { path: 0.0, by_path: Vector3::zeros() };
        let wheel = |k: usize, scale: f64| {
            if scale == 0.0 { none } else { WheelPath { path: scale * input[k], by_path: by_input.column(k) / scale } }
        };
        let by = &increment.by_parameter;
        let (wheels, by_angle) = match drive {
            Drive::Tricycle(t) => ([wheel(0, t.scale), none], by.column(OFFSET_FORWARD) + by.column(OFFSET_BACKWARD)),
            Drive::Differential(d) => ([wheel(0, d.left), wheel(1, d.right)], Vector3::zeros()),
        };
        Self { motion: increment.motion, by_drive: increment.by_parameter, by_input, wheels, by_angle }
    }

    /// Covariance of the perturbation by slip.
    #[must_use]
    pub fn slip(&self, noise: &WheelNoise) -> Matrix3<f64> {
        let of_wheel = |w: &WheelPath| w.by_path * w.by_path.transpose() * (noise.slip * noise.slip * w.path.abs());
        of_wheel(&self.wheels[0]) + of_wheel(&self.wheels[1])
    }

    /// Covariance of the perturbation in a filter, whose steps, of `duration` [s], are independent.
    #[must_use]
    pub fn covariance(&self, duration: f64, noise: &WheelNoise) -> Matrix3<f64> {
        self.slip(noise) + self.by_angle * self.by_angle.transpose() * noise.white_steering(duration)
    }
}

impl WheelNoise {
    /// Residual of a steering error after a time [s].
    #[must_use]
    pub fn kept(&self, time: f64) -> f64 {
        (-time.max(0.0) / self.memory).exp()
    }

    /// Variance of what has come to a steering error of which the share `kept` is left [rad^2].
    #[must_use]
    pub fn fresh(&self, kept: f64) -> f64 {
        self.steering * self.steering * (1.0 - kept * kept)
    }

    /// Variance of a steering error that is another one in every step of `duration` [s], and does as much in the long run
    /// as the one that lasts [rad^2].
    #[must_use]
    pub fn white_steering(&self, duration: f64) -> f64 {
        let variance = 2.0 * self.steering * self.steering * self.memory / duration;
        if variance < UNKNOWN_ANGLE { variance } else { UNKNOWN_ANGLE }
    }
}

impl Vehicle {
    /// The motion of a step of the wheels.
    #[must_use]
    pub fn wheel_motion(&self, input: Vector2<f64>) -> WheelMotion {
        WheelMotion::new(self.drive(), input)
    }

    /// The poses that readings of the wheels tell, on exact arcs from one to the next: x, y [m] and heading [rad], turns
    /// counted. The first is zero; scanners and delay have no part in it. Where `is_broken` says so of a reading (by its
    /// index), it does not hang together with the one before: the vehicle stays where it was.
    #[must_use]
    pub fn dead_reckoning(&self, readings: &[Vector2<f64>], is_broken: impl Fn(usize) -> bool) -> Vec<Vector3<f64>> {
        let kind = self.wheels();
        let (mut pose, mut heading) = (Se2::IDENTITY, 0.0);
        let mut poses = vec![Vector3::zeros()];
        for (k, pair) in readings.windows(2).enumerate() {
            if !is_broken(k + 1) {
                let step = self.drive().path_and_turn(kind.input(pair[0], pair[1]));
                pose = pose * arc(step);
                heading += step.y;
            }
            poses.push(Vector3::new(pose.x(), pose.y(), heading));
        }
        poses.truncate(readings.len());
        poses
    }

    /// Which two numbers its wheels read.
    #[must_use]
    pub fn wheels(&self) -> WheelKind {
        match self.drive() {
            Drive::Tricycle(_) => WheelKind::Steered,
            Drive::Differential(_) => WheelKind::Differential,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Differential, Tricycle};

    const NOISE: WheelNoise = WheelNoise { slip: 2e-3, steering: 1e-3, memory: 2.0 };

    fn fork() -> Drive {
        Drive::Tricycle(Tricycle::from_parameters([-0.12, 1.4, 1.1, 0.02, -0.01]))
    }

    fn cart() -> Drive {
        Drive::Differential(Differential { left: 0.1, right: -0.11, axle: 0.5 })
    }

    /// The perturbation that a changed step makes, by differences.
    fn by_difference(
        drive: &Drive,
        input: Vector2<f64>,
        changed: impl Fn(f64) -> (Drive, Vector2<f64>),
    ) -> Vector3<f64> {
        let h = 1e-6;
        let moved = |h: f64| {
            let (drive, input) = changed(h);
            drive.motion(input)
        };
        (moved(h).minus(&drive.motion(input)) - moved(-h).minus(&drive.motion(input))) / (2.0 * h)
    }

    #[test]
    fn directions_equal_differences() {
        for input in [Vector2::new(3.0, 0.4), Vector2::new(-5.0, -0.7), Vector2::new(2.0, 1.3)] {
            let drive = fork();
            let Drive::Tricycle(t) = drive else { continue };
            let step = WheelMotion::new(&drive, input);
            let longer = |h: f64| (drive, input + Vector2::new(h / t.scale, 0.0));
            let turned = |h: f64| {
                let (offset_forward, offset_backward) = (t.offset_forward + h, t.offset_backward + h);
                (Drive::Tricycle(Tricycle { offset_forward, offset_backward, ..t }), input)
            };
            assert!((step.wheels[0].by_path - by_difference(&drive, input, longer)).norm() < 1e-7);
            assert!((step.by_angle - by_difference(&drive, input, turned)).norm() < 1e-7);
            assert!((step.wheels[0].path - t.scale * input.x).abs() < 1e-12 && step.wheels[1].path == 0.0);
        }
        for input in [Vector2::new(3.0, -4.0), Vector2::new(-2.0, -6.0)] {
            let drive = cart();
            let step = WheelMotion::new(&drive, input);
            for (k, scale) in [(0, 0.1), (1, -0.11)] {
                let longer = |h: f64| (drive, input + Vector2::ith(k, h / scale));
                assert!((step.wheels[k].by_path - by_difference(&drive, input, longer)).norm() < 1e-7);
                assert!((step.wheels[k].path - scale * input[k]).abs() < 1e-12);
            }
            assert_eq!(step.by_angle, Vector3::zeros());
        }
    }

    #[test]
    fn slip_grows_with_the_path_of_each_wheel_whatever_its_sign_and_unit() {
        let even = |radius: f64| Drive::Differential(Differential { left: radius, right: radius, axle: 0.5 });
        let spread = |drive: &Drive, metres: f64, radius: f64| {
            WheelMotion::new(drive, Vector2::repeat(metres / radius)).slip(&NOISE)
        };
        for (metres, radius) in [(1.0, 0.1), (-4.0, 0.1), (4.0, -2e-4)] {
            let q = spread(&even(radius), metres, radius);
            let variance = NOISE.slip.powi(2) * metres.abs();
            // Along: the mean of two wheels. Turn: their difference over the axle.
            assert!((q.m11 / (variance / 2.0) - 1.0).abs() < 1e-12);
            assert!((q.m33 / (2.0 * variance / 0.25) - 1.0).abs() < 1e-12);
        }
        assert_eq!(WheelMotion::new(&cart(), Vector2::zeros()).covariance(0.02, &NOISE), Matrix3::zeros());
    }

    /// The heading of a straight drive, bent by a lasting steering error, against that of independent steps.
    #[test]
    fn independent_steps_do_in_the_long_run_what_a_lasting_error_does() {
        let (dt, drive) = (0.05, Drive::Tricycle(Tricycle::from_parameters([0.1, 1.0, 1.0, 0.0, 0.0])));
        let step = WheelMotion::new(&drive, Vector2::new(0.5, 0.0));
        let per_angle = step.by_angle.z;
        let steps = 4000;
        let white = f64::from(steps) * step.covariance(dt, &WheelNoise { slip: 0.0, ..NOISE }).m33;
        // The same by the process, carried step by step: variance of e, its covariance with the heading, of the heading.
        let kept = NOISE.kept(dt);
        let (e, mut cross, mut heading) = (NOISE.steering.powi(2), 0.0, 0.0);
        for _ in 0..steps {
            heading += 2.0 * per_angle * cross + per_angle * per_angle * e;
            cross = kept * (cross + per_angle * e);
        }
        assert!((white / heading - 1.0).abs() < 0.02, "{white} {heading}");
        assert!((kept * kept * e + NOISE.fresh(kept) - e).abs() < 1e-18, "the process is stationary");
        let half = WheelMotion::new(&drive, Vector2::new(0.25, 0.0)).covariance(dt / 2.0, &NOISE);
        let whole = step.covariance(dt, &NOISE);
        assert!((2.0 * half.m33 / whole.m33 - 1.0).abs() < 1e-9, "steps of any length tell the same");
    }

    fn told(drive: Drive, readings: &[(f64, f64)]) -> Vec<Vector3<f64>> {
        let readings: Vec<_> = readings.iter().map(|(a, b)| Vector2::new(*a, *b)).collect();
        Vehicle::new(drive, Vec::new(), 0.3).unwrap().dead_reckoning(&readings, |_| false)
    }

    /// Readings of a tricycle whose steering is held, in steps of a tenth of a radian of the wheel.
    fn held(angle: f64, radians: f64) -> Vec<(f64, f64)> {
        (0..=100).map(|k| (7.0 + radians * f64::from(k) / 100.0, angle)).collect()
    }

    /// The circle of a tricycle by plain geometry: its radius is wheelbase/tan, its arc the wheel's path times cos.
    fn circle(radius_of_wheel: f64, wheelbase: f64, delta: f64, radians: f64) -> Vector3<f64> {
        let radius = wheelbase / delta.tan();
        let turn = radius_of_wheel * radians * delta.cos() / radius;
        Vector3::new(radius * turn.sin(), radius * (1.0 - turn.cos()), turn)
    }

    fn tricycle(wheelbase: f64, gain: f64, forward: f64, backward: f64) -> Drive {
        Drive::Tricycle(Tricycle::from_parameters([0.12, wheelbase, gain, forward, backward]))
    }

    #[test]
    fn a_tricycle_goes_round_the_circle_of_its_steering() {
        for (drive, encoder, delta, radians) in [
            (tricycle(1.4, 1.0, 0.0, 0.0), 0.5, 0.5, 60.0),
            (tricycle(1.4, 1.0, 0.0, 0.0), -0.5, -0.5, 60.0),
            (tricycle(1.4, 2.0, 0.05, -0.4), 0.3, 0.65, 60.0),
            (tricycle(1.4, 2.0, 0.05, -0.4), 0.3, 0.2, -60.0),
            (tricycle(1.4, -1.0, 0.0, 0.0), 0.5, -0.5, 60.0),
        ] {
            let end = told(drive, &held(encoder, radians))[100];
            assert!((end - circle(0.12, 1.4, delta, radians)).norm() < 1e-9, "{drive:?} {end}");
        }
        // Steered to the left: a wheel ahead turns the vehicle left, one behind turns it right.
        assert!(told(tricycle(1.4, 1.0, 0.0, 0.0), &held(0.3, 5.0))[100].z > 0.1);
        assert!(told(tricycle(-1.4, 1.0, 0.0, 0.0), &held(0.3, 5.0))[100].z < -0.1);
    }

    #[test]
    fn a_differential_drive_goes_round_the_circle_of_its_wheels() {
        let drive = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let readings = |left: f64, right: f64| -> Vec<_> {
            (0..=100).map(|k| (3.0 + left * f64::from(k) / 100.0, right * f64::from(k) / 100.0)).collect()
        };
        let end = told(drive, &readings(20.0, 30.0))[100];
        // Paths of 2 and 3 m: 2.5 m on a circle of 1.25 m.
        assert!((end - Vector3::new(1.25 * 2.0_f64.sin(), 1.25 * (1.0 - 2.0_f64.cos()), 2.0)).norm() < 1e-9);
        let swapped = told(drive, &readings(30.0, 20.0))[100];
        assert!(
            (swapped.z + end.z).abs() < 1e-9 && (swapped.y + end.y).abs() < 1e-9 && (swapped.x - end.x).abs() < 1e-9
        );
        let negated = Drive::Differential(Differential { left: 0.1, right: -0.1, axle: 0.5 });
        assert!((told(negated, &readings(20.0, -30.0))[100] - end).norm() < 1e-9);
        let millimetres = Drive::Differential(Differential { left: 100.0, right: 100.0, axle: 500.0 });
        assert!((told(millimetres, &readings(20.0, 30.0))[100].x - 1000.0 * end.x).abs() < 1e-6);
        assert!(told(drive, &[]).is_empty() && told(drive, &[(1.0, 2.0)]) == [Vector3::zeros()]);
    }

    #[test]
    fn after_a_turn_the_vehicle_drives_where_it_looks() {
        // A metre ahead, a quarter turn to the left on the spot, a metre ahead.
        let drive = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let turn = 0.25 * PI / 2.0 / 0.1;
        let end = told(drive, &[(0.0, 0.0), (10.0, 10.0), (10.0 - turn, 10.0 + turn), (20.0 - turn, 20.0 + turn)])[3];
        assert!((end - Vector3::new(1.0, 1.0, PI / 2.0)).norm() < 1e-9, "{end}");
    }

    #[test]
    fn of_a_steering_error_in_no_time_nothing_is_known() {
        // An angle that is drawn evenly from a whole turn has a variance of pi^2/3.
        assert!((NOISE.white_steering(0.0) - PI * PI / 3.0).abs() < 1e-12);
        assert!((NOISE.white_steering(1e-9) - PI * PI / 3.0).abs() < 1e-12);
    }

    #[test]
    fn a_reset_counter_moves_nothing() {
        let drive = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let readings = [100.0, 101.0, 102.0, 0.0, 1.0].map(Vector2::repeat);
        let poses = Vehicle::new(drive, Vec::new(), 0.0).unwrap().dead_reckoning(&readings, |k| k == 3);
        let along: Vec<f64> = poses.iter().map(|p| p.x).collect();
        assert!(along.iter().zip([0.0, 0.1, 0.2, 0.2, 0.3]).all(|(a, b)| (a - b).abs() < 1e-12), "{along:?}");
    }

    #[test]
    fn noise_stays_finite_for_any_duration() {
        let step = WheelMotion::new(&fork(), Vector2::new(1.0, 0.3));
        for duration in [0.0, 1e-300, 1e-9, 1e9] {
            assert!(step.covariance(duration, &NOISE).iter().all(|v| v.is_finite()));
        }
    }
}

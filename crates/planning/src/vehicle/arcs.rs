//! Arcs that a vehicle can drive, and the information of each about its parameters.
//!
//! ```text
//! path of the wheel  d = wheelbase turn/sin(delta)         tricycle
//! speed              v <= sqrt(a wheelbase/|sin cos|)      for a lateral acceleration a
//! information        J^T (S + S_wheels)^-1 J               J, S_wheels as in `groma-calibration`
//! ```
//!
//! A differential drive has the radius of its arc instead of a steering angle; a spin has radius 0.

use groma_calibration::vehicle::wheel_process::WheelProcess;
use groma_calibration::vehicle::{Layout, Vehicle, prediction};
use groma_models::bounds::Bound;
use groma_models::wheel_log::Step;
use groma_models::{Drive, ModelError, WheelNoise, increment};
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// Turn below which a steering angle counts as straight [rad].
const STRAIGHT: f64 = 1e-3;

/// One motion from standstill to standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arc {
    /// Angle of the steering encoder [rad]; the radius of the arc [m] for a differential drive, 0 for a spin, infinite
    /// for straight; to the left positive.
    pub steering: f64,
    /// Path of the drive wheel, or of the faster wheel, negative backward [m].
    pub path: f64,
    /// Speed of that wheel [m/s].
    pub speed: f64,
    /// Counts of the wheel and angle of the encoder, or counts left and right.
    pub input: Vector2<f64>,
}

/// What may be driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Least steering angle to either side [rad].
    pub angle_min: f64,
    /// Largest steering angle to either side [rad].
    pub angle_max: f64,
    /// Largest turn of the vehicle in one arc [rad].
    pub turn_max: f64,
    /// Longest path of a wheel in one arc [m].
    pub path_max: f64,
    /// Speed of the wheel [m/s].
    pub speed: f64,
    /// Largest lateral acceleration [m/s^2].
    pub acceleration_max: f64,
    /// Time that an arc takes beside driving: to stop, to steer, to scan, to get to its start [s].
    pub overhead: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            angle_min: 18_f64.to_radians(),
            angle_max: 50_f64.to_radians(),
            turn_max: 240_f64.to_radians(),
            path_max: 20.0,
            speed: 1.0,
            acceleration_max: 1.0,
            overhead: 8.0,
        }
    }
}

impl Limits {
    /// Refuses limits that no vehicle has.
    ///
    /// # Errors
    /// The first number that is not finite or out of its bound, by name.
    pub fn validate(&self) -> Result<(), ModelError> {
        let angle = Bound::new("angle", 0.0, 1.57, "must be from 0 to 1.57 rad");
        angle.check("angle_min", self.angle_min)?;
        angle.check("angle_max", self.angle_max)?;
        Bound::new("turn", 1e-3, 100.0, "must be from 0.001 to 100 rad").check("turn_max", self.turn_max)?;
        Bound::new("path", 1e-3, 1e3, "must be from 0.001 to 1000 m").check("path_max", self.path_max)?;
        let speed = Bound::new("speed", 1e-3, 1e3, "must be from 0.001 to 1000");
        speed.check("speed", self.speed)?;
        speed.check("acceleration_max", self.acceleration_max)?;
        Bound::new("overhead", 0.0, 1e5, "must be from 0 to 1e5 s").check("overhead", self.overhead)
    }
}

impl Noise {
    /// Refuses noise that is none.
    ///
    /// # Errors
    /// The first number that is not finite or out of its bound, by name.
    pub fn validate(&self) -> Result<(), ModelError> {
        let above = Bound::new("noise", 1e-9, 1e3, "must be from 1e-9 to 1e3");
        above.check("place", self.place)?;
        above.check("heading", self.heading)?;
        let any = Bound::new("noise", 0.0, 1e3, "must be from 0 to 1e3");
        any.check("slip", self.wheels.slip)?;
        any.check("steering", self.wheels.steering)?;
        Bound::new("memory", 1e-3, 1e6, "must be from 0.001 to 1e6 s").check("memory", self.wheels.memory)
    }
}

/// Standard deviations of a motion from standstill to standstill.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Noise {
    /// Of a coordinate of the laser's motion [m].
    pub place: f64,
    /// Of its turn [rad].
    pub heading: f64,
    /// What the wheels do beside.
    #[serde(flatten)]
    pub wheels: WheelNoise,
}

impl Default for Noise {
    fn default() -> Self {
        Self { place: 2e-3, heading: 0.03_f64.to_radians(), wheels: WheelNoise::default() }
    }
}

impl Arc {
    /// An arc of a steering angle (or radius) that turns by `turn`, forward or backward; nothing when it is too long.
    #[must_use]
    pub fn new(vehicle: &Vehicle, steering: f64, turn: f64, forward: bool, limits: &Limits) -> Option<Self> {
        let sign = if forward { 1.0 } else { -1.0 };
        let arc = match vehicle.drive {
            Drive::Tricycle(t) => {
                let sin = t.steering_angle(sign / t.scale, steering).sin().abs();
                let path = if sin > STRAIGHT { t.wheelbase.abs() * turn / sin } else { limits.path_max };
                Self::steered(vehicle, steering, sign * path, limits)
            }
            Drive::Differential(d) => {
                let reach = steering.abs() + d.axle / 2.0;
                let path = if steering.is_finite() { reach * turn } else { limits.path_max };
                Self::differential(vehicle, steering, sign * path, limits)
            }
        };
        (arc.path.abs() <= limits.path_max * (1.0 + 1e-9)).then_some(arc)
    }

    fn steered(vehicle: &Vehicle, steering: f64, path: f64, limits: &Limits) -> Self {
        let Drive::Tricycle(t) = vehicle.drive else { return Self::differential(vehicle, steering, path, limits) };
        let input = Vector2::new(path / t.scale, steering);
        let (sin, cos) = t.steering_angle(input.x, steering).sin_cos();
        let lateral = (limits.acceleration_max * t.wheelbase.abs() / (sin * cos).abs()).sqrt();
        Self { steering, path, speed: limits.speed.min(lateral), input }
    }

    fn differential(vehicle: &Vehicle, radius: f64, path: f64, limits: &Limits) -> Self {
        let Drive::Differential(d) = vehicle.drive else { return Self::steered(vehicle, radius, path, limits) };
        let half = d.axle / 2.0;
        let reach = radius.abs() + half;
        let inner = if radius.is_finite() { path * (radius.abs() - half) / reach } else { path };
        let left_turn = radius.is_sign_positive();
        let (left, right) = if left_turn { (inner, path) } else { (path, inner) };
        let lateral =
            if radius.abs() > 0.0 { (limits.acceleration_max / radius.abs()).sqrt() * reach } else { f64::INFINITY };
        let speed = if radius.is_finite() { limits.speed.min(lateral) } else { limits.speed };
        Self { steering: radius, path, speed, input: Vector2::new(left / d.left, right / d.right) }
    }

    fn step(&self) -> Step {
        Step { input: self.input, rate: Vector2::zeros(), duration: self.path.abs() / self.speed }
    }

    /// Path and turn of the base.
    #[must_use]
    pub fn path_and_turn(&self, vehicle: &Vehicle) -> Vector2<f64> {
        vehicle.drive.path_and_turn(self.input)
    }

    /// Motion of the base after a share of the arc.
    #[must_use]
    pub fn motion(&self, vehicle: &Vehicle, share: f64) -> groma_geometry::Se2 {
        increment::arc(self.path_and_turn(vehicle) * share)
    }

    /// Time it takes [s].
    #[must_use]
    pub fn time(&self, limits: &Limits) -> f64 {
        self.path.abs() / self.speed + limits.overhead
    }

    /// Its information about the free parameters.
    #[must_use]
    pub fn information(&self, vehicle: &Vehicle, layout: &Layout, noise: &Noise) -> DMatrix<f64> {
        let steps = [self.step()];
        let predicted = prediction::predict(vehicle, &steps);
        let of_scans = Vector3::new(noise.place, noise.place, noise.heading).map(|s| s * s);
        let of_wheels = WheelProcess::new(vehicle, &steps, &noise.wheels).marginal(&noise.wheels);
        let covariance = Matrix3::from_diagonal(&of_scans) + of_wheels;
        let inverse = covariance.try_inverse().unwrap_or_else(Matrix3::zeros);
        layout.reduced(&(predicted.jacobian.tr_mul(&(inverse * predicted.jacobian))))
    }
}

/// All arcs within the limits: steps of two degrees of steering and fifteen of turn, both sides, both ways, and straight.
#[must_use]
pub fn candidates(vehicle: &Vehicle, limits: &Limits) -> Vec<Arc> {
    let steerings = match vehicle.drive {
        Drive::Tricycle(_) => angles(limits),
        Drive::Differential(d) => vec![0.0, d.axle / 2.0, d.axle, 2.0 * d.axle, 4.0 * d.axle, 8.0 * d.axle],
    };
    let straight = if matches!(vehicle.drive, Drive::Tricycle(_)) { 0.0 } else { f64::INFINITY };
    let turns: Vec<f64> =
        (2..).map(|k| f64::from(k) * PI / 12.0).take_while(|t| *t <= limits.turn_max + 1e-9).collect();
    let mut arcs = Vec::new();
    for forward in [true, false] {
        for &steering in &steerings {
            let shapes = turns.iter().flat_map(|&turn| [(steering, turn), (-steering, turn)]);
            arcs.extend(shapes.filter_map(|(steering, turn)| Arc::new(vehicle, steering, turn, forward, limits)));
            if steering > 0.0 {
                arcs.extend(
                    [steering, -steering].iter().filter_map(|&s| as_long_as_allowed(vehicle, s, forward, limits)),
                );
            }
        }
        arcs.extend([0.25, 0.5, 1.0].iter().filter_map(|share| {
            let shorter = Limits { path_max: limits.path_max * share, ..*limits };
            Arc::new(vehicle, straight, 0.0, forward, &shorter).filter(|arc| arc.path != 0.0)
        }));
    }
    arcs
}

/// The arc that the longest path allows, where that turns by less than the largest turn.
fn as_long_as_allowed(vehicle: &Vehicle, steering: f64, forward: bool, limits: &Limits) -> Option<Arc> {
    let unit = Arc::new(vehicle, steering, 1.0, forward, &Limits { path_max: f64::INFINITY, ..*limits })?;
    let turn = limits.path_max / unit.path.abs();
    (turn > 0.0 && turn < limits.turn_max).then(|| Arc::new(vehicle, steering, turn, forward, limits)).flatten()
}

fn angles(limits: &Limits) -> Vec<f64> {
    let steps = ((limits.angle_max - limits.angle_min) / 2_f64.to_radians()).round().max(1.0) as usize;
    (0..=steps).map(|k| limits.angle_min + (limits.angle_max - limits.angle_min) * k as f64 / steps as f64).collect()
}

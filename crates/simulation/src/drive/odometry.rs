//! What the wheels report, and the odometry that a vehicle computes from it.
//!
//! Readings: joint turns of every step plus slip, `turn += slip sqrt(|travel|) n / r`, n standard normal, summed and cut
//! down to multiples of the encoder step (a steering angle is a reading of its own: cut down, not summed).
//! Odometry: the arcs of the readings, summed with the *believed* vehicle, whose radii, base and steering offset are
//! off by the systematic errors. All errors share one scale, which can be chosen such that the odometry ends at a
//! given distance from the truth (found by doubling and bisection, same random numbers throughout).
//!
//! A stall freezes the odometry that is reported, not the wheels: afterwards it is where it would have been.

use super::follower::Drive;
use super::vehicle::{Vehicle, Wheels};
use crate::error::SimulationError;
use groma_estimation::root;
use groma_estimation::streams::Random;
use groma_geometry::Se2;
use groma_models::Token;
use serde::{Deserialize, Serialize};

/// Smallest and largest scale that is tried for a final error.
const SCALES: (f64, f64) = (1e-3, 1e3);
/// Bisections: the scale is found to one part in 2^40.
const BISECTIONS: usize = 40;

/// What is wrong with the wheels and with their assumed values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WheelErrors {
    /// Relative errors of the radii: left and right, or the driven wheel (then the second is unused).
    pub radius: [f64; 2],
    /// Relative error of the wheel separation, or of the wheelbase.
    pub base: f64,
    /// Error of the steering offset [rad]; unused without a steered wheel.
    pub steering: f64,
    /// Standard deviation of a wheel's travel after one metre [m]; grows with the root of the distance.
    pub slip: f64,
    /// Step of the encoders [rad]; 0 for none.
    pub encoder_step: f64,
    /// If given, radius, base, steering and slip are scaled such that the odometry ends so far from the truth [m].
    pub final_error: Option<f64>,
}

impl Default for WheelErrors {
    fn default() -> Self {
        Self {
            radius: [0.0002, -0.0002],
            base: 0.01,
            steering: 0.001,
            slip: 0.002,
            encoder_step: std::f64::consts::TAU / 4096.0,
            final_error: None,
        }
    }
}

/// A time during which the reported odometry stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stall {
    /// Begin, after the start of the drive [s].
    pub start: f64,
    /// Duration [s].
    pub duration: f64,
}

/// What the wheels of a drive report at the steps of the drive.
#[derive(Clone, Debug)]
pub struct WheelReadings {
    /// Joint positions: sums of turns, or a steering angle as second [rad].
    pub positions: Vec<[f64; 2]>,
    /// `T_odom_base`, the identity at the start.
    pub odometry: Vec<Se2>,
}

impl WheelReadings {
    /// The readings of `vehicle` on `drive`.
    ///
    /// # Errors
    /// When no scale of the errors gives the final error requested, or the token cancels the work.
    pub fn of(
        drive: &Drive,
        vehicle: &Vehicle,
        errors: &WheelErrors,
        seed: &mut Random,
        token: &Token,
    ) -> Result<Self, SimulationError> {
        let turns = true_turns(drive, vehicle);
        let noise: Vec<[f64; 2]> = turns.iter().map(|_| [seed.normal(), seed.normal()]).collect();
        let run = |scale| integrate(&turns, &noise, vehicle, &scaled(errors, scale));
        let Some(target) = errors.final_error else { return Ok(run(1.0)) };
        let truth = drive.poses[0].between(&drive.poses[turns.len()]).translation;
        let error = |scale| {
            token.check()?;
            Ok(run(scale).odometry.last().map_or(0.0, |end| (end.translation - truth).norm()))
        };
        scale_for(target, error).map(run)
    }
}

/// The least power of two times the smallest scale that is wrong enough, bisected down to the target.
fn scale_for(target: f64, error: impl Fn(f64) -> Result<f64, SimulationError>) -> Result<f64, SimulationError> {
    let mut high = SCALES.0;
    while error(high)? < target {
        high *= 2.0;
        if high > SCALES.1 {
            return Err(SimulationError::FinalError(target));
        }
    }
    let (_, scale) = root::bisect((high / 2.0, high), BISECTIONS, |scale| error(scale).map(|e| e < target))?;
    Ok(scale)
}

fn scaled(errors: &WheelErrors, scale: f64) -> WheelErrors {
    WheelErrors {
        radius: errors.radius.map(|r| r * scale),
        base: errors.base * scale,
        steering: errors.steering * scale,
        slip: errors.slip * scale,
        ..errors.clone()
    }
}

fn true_turns(drive: &Drive, vehicle: &Vehicle) -> Vec<Wheels> {
    let mut held = Wheels { first: 0.0, second: 0.0 };
    let mut turn = |[v, w]: &[f64; 2]| {
        held = vehicle.wheels(v * drive.step, w * drive.step, held);
        held
    };
    drive.twists.iter().map(&mut turn).collect()
}

fn integrate(turns: &[Wheels], noise: &[[f64; 2]], vehicle: &Vehicle, errors: &WheelErrors) -> WheelReadings {
    let believed = believed(vehicle, errors);
    let (mut sum, mut pose) = ([0.0, 0.0], Se2::IDENTITY);
    let mut out = WheelReadings { positions: vec![[0.0, 0.0]], odometry: vec![pose] };
    let mut last = [0.0, 0.0];
    for (turn, n) in turns.iter().zip(noise) {
        let wheels = slipped(*turn, *n, vehicle, errors.slip);
        sum = summed(sum, wheels, vehicle);
        let position = sum.map(|x| cut(x, errors.encoder_step));
        pose = pose * Se2::exp(believed.motion(differences(last, position, vehicle)));
        out.positions.push(position);
        out.odometry.push(pose);
        last = position;
    }
    out
}

fn believed(vehicle: &Vehicle, errors: &WheelErrors) -> Vehicle {
    let (first, second, base) = (1.0 + errors.radius[0], 1.0 + errors.radius[1], 1.0 + errors.base);
    match *vehicle {
        Vehicle::Differential { left_radius, right_radius, separation } => Vehicle::Differential {
            left_radius: left_radius * first,
            right_radius: right_radius * second,
            separation: separation * base,
        },
        Vehicle::Tricycle { radius, wheelbase, steering_offset } => Vehicle::Tricycle {
            radius: radius * first,
            wheelbase: wheelbase * base,
            steering_offset: steering_offset + errors.steering,
        },
    }
}

fn slipped(turn: Wheels, n: [f64; 2], vehicle: &Vehicle, slip: f64) -> Wheels {
    let noisy = |turn: f64, r: f64, n: f64| turn + slip * (turn.abs() * r).sqrt() * n / r;
    match *vehicle {
        Vehicle::Differential { left_radius, right_radius, .. } => {
            Wheels { first: noisy(turn.first, left_radius, n[0]), second: noisy(turn.second, right_radius, n[1]) }
        }
        Vehicle::Tricycle { radius, .. } => Wheels { first: noisy(turn.first, radius, n[0]), ..turn },
    }
}

fn summed(sum: [f64; 2], wheels: Wheels, vehicle: &Vehicle) -> [f64; 2] {
    match vehicle {
        Vehicle::Differential { .. } => [sum[0] + wheels.first, sum[1] + wheels.second],
        Vehicle::Tricycle { .. } => [sum[0] + wheels.first, wheels.second],
    }
}

fn differences(last: [f64; 2], now: [f64; 2], vehicle: &Vehicle) -> Wheels {
    match vehicle {
        Vehicle::Differential { .. } => Wheels { first: now[0] - last[0], second: now[1] - last[1] },
        Vehicle::Tricycle { .. } => Wheels { first: now[0] - last[0], second: now[1] },
    }
}

fn cut(x: f64, step: f64) -> f64 {
    if step > 0.0 { (x / step).floor() * step } else { x }
}

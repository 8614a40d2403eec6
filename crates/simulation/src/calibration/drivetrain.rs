//! How the wheels of a vehicle move it in truth, slip and steering error included.
//!
//! ```text
//! tricycle      u = drive_scale n',  delta = steering_gain alpha + offset(sign of n') + e
//!               v = u cos(delta),    w = u sin(delta) / wheelbase
//! differential  v = (r_l n_l' + r_r n_r') / 2,  w = (r_r n_r' - r_l n_l') / axle
//! slip          u dt += slip sqrt(|u| dt) * normal
//! ```
//!
//! n' are the rates of the counters and alpha the reading of the steering encoder. `e` is an Ornstein-Uhlenbeck process:
//! steering error remembers. Written apart from the models that calibration uses, so that each checks the other.

use groma_estimation::streams::Random;
use groma_models::WheelNoise;
use serde::{Deserialize, Serialize};

/// Kind and parameters of a vehicle; lengths per radian of the counters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Drivetrain {
    /// One steered, driven wheel in front of a fixed axle.
    Tricycle {
        /// Travel of the wheel per radian of its counter [m].
        drive_scale: f64,
        /// Distance of the driven wheel from the fixed axle [m].
        wheelbase: f64,
        /// Angle of the wheel per radian of the steering encoder.
        steering_gain: f64,
        /// Angle of the wheel at reading zero, driving forward [rad].
        steering_offset_forward: f64,
        /// The same, driving backward [rad].
        steering_offset_backward: f64,
    },
    /// Two driven wheels on one axle.
    Differential {
        /// Travel of the left wheel per radian [m].
        left_radius: f64,
        /// Travel of the right wheel per radian [m].
        right_radius: f64,
        /// Distance between the wheels [m].
        axle: f64,
    },
}

/// What the wheels do beside what they are told, and the steps of the encoders.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrivetrainNoise {
    /// Slip and steering errors.
    #[serde(flatten)]
    pub wheels: WheelNoise,
    /// Step of the counters of the driven wheels [rad]; 0 for none.
    pub counter_step: f64,
    /// Step of the steering encoder [rad]; 0 for none.
    pub steering_step: f64,
}

impl Default for DrivetrainNoise {
    fn default() -> Self {
        use std::f64::consts::TAU;
        Self { wheels: WheelNoise::default(), counter_step: TAU / 4096.0, steering_step: TAU / 16384.0 }
    }
}

/// What a driver asks for: the speed of the driven wheel and the steering reading, or, of a differential drive, the speed of
/// the base and the angle whose tangent is `axle / radius of the turn`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Demand {
    /// Speed [m/s].
    pub speed: f64,
    /// Angle [rad].
    pub angle: f64,
}

impl Drivetrain {
    /// Rate of the counter [rad/s] and steering reading [rad], or the rates of both counters [rad/s].
    #[must_use]
    pub fn readings(&self, demand: Demand) -> [f64; 2] {
        match *self {
            Self::Tricycle { drive_scale, .. } => [demand.speed / drive_scale, demand.angle],
            Self::Differential { left_radius, right_radius, .. } => {
                let half = demand.angle.tan() / 2.0;
                [demand.speed * (1.0 - half) / left_radius, demand.speed * (1.0 + half) / right_radius]
            }
        }
    }

    /// Speed [m/s] and turn rate [rad/s] of the base while the wheels read `readings`, with errors of the two travels (as
    /// speeds [m/s]) and of the steering angle [rad].
    #[must_use]
    pub fn twist(&self, readings: [f64; 2], slip: [f64; 2], steering_error: f64) -> [f64; 2] {
        match *self {
            Self::Tricycle { drive_scale, wheelbase, steering_gain, .. } => {
                let u = drive_scale * readings[0] + slip[0];
                let delta = steering_gain * readings[1] + self.offset(readings[0]) + steering_error;
                [u * delta.cos(), u * delta.sin() / wheelbase]
            }
            Self::Differential { left_radius, right_radius, axle } => {
                let (left, right) = (left_radius * readings[0] + slip[0], right_radius * readings[1] + slip[1]);
                [(left + right) / 2.0, (right - left) / axle]
            }
        }
    }

    /// Travel speeds of the wheels that slip [m/s].
    #[must_use]
    pub fn speeds(&self, readings: [f64; 2]) -> [f64; 2] {
        match *self {
            Self::Tricycle { drive_scale, .. } => [drive_scale * readings[0], 0.0],
            Self::Differential { left_radius, right_radius, .. } => {
                [left_radius * readings[0], right_radius * readings[1]]
            }
        }
    }

    /// Travel over which a vehicle with commanded `angle` turns by `turn` [rad] [m].
    #[must_use]
    pub fn travel(&self, angle: f64, turn: f64) -> f64 {
        match *self {
            Self::Tricycle { wheelbase, .. } => wheelbase * turn / angle.sin().abs(),
            Self::Differential { axle, .. } => axle * turn / angle.tan().abs(),
        }
    }

    /// How far the body reaches ahead of the base [m].
    #[must_use]
    pub fn front(&self) -> f64 {
        match *self {
            Self::Tricycle { wheelbase, .. } => wheelbase,
            Self::Differential { axle, .. } => axle / 2.0,
        }
    }

    /// Whether the second reading is a steering angle.
    #[must_use]
    pub fn steers(&self) -> bool {
        matches!(self, Self::Tricycle { .. })
    }

    fn offset(&self, rate: f64) -> f64 {
        match *self {
            Self::Tricycle { steering_offset_backward, .. } if rate < 0.0 => steering_offset_backward,
            Self::Tricycle { steering_offset_forward, .. } => steering_offset_forward,
            Self::Differential { .. } => 0.0,
        }
    }
}

/// The errors of the wheels as they go on in time.
#[derive(Clone, Debug)]
pub struct Disturbance {
    noise: WheelNoise,
    steering: f64,
}

impl Disturbance {
    /// Starts with a steering error drawn from the stationary distribution.
    #[must_use]
    pub fn new(noise: WheelNoise, random: &mut Random) -> Self {
        Self { noise, steering: noise.steering * random.normal() }
    }

    /// Goes on by `dt` seconds at the given travel speeds; returns slip speeds [m/s] and the steering error [rad].
    pub fn step(&mut self, speeds: [f64; 2], dt: f64, random: &mut Random) -> ([f64; 2], f64) {
        let keep = (-dt / self.noise.memory).exp();
        let fresh = (1.0 - keep * keep).sqrt() * self.noise.steering * random.normal();
        self.steering = keep * self.steering + fresh;
        let slip = speeds.map(|u| self.noise.slip * (u.abs() * dt).sqrt() * random.normal() / dt);
        (slip, self.steering)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_demand_is_met_by_a_vehicle_without_offsets() {
        let tricycle = Drivetrain::Tricycle {
            drive_scale: 0.1,
            wheelbase: 1.5,
            steering_gain: 1.0,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
        };
        let differential = Drivetrain::Differential { left_radius: 0.1, right_radius: 0.11, axle: 0.5 };
        for (drive, length) in [(tricycle, 1.5), (differential, 0.5)] {
            let demand = Demand { speed: -0.8, angle: 0.4 };
            let [v, w] = drive.twist(drive.readings(demand), [0.0; 2], 0.0);
            assert!((w / v - 0.4_f64.tan() / length).abs() < 1e-12, "curvature of {drive:?}");
            let travel = drive.travel(0.4, 2.0);
            assert!((w.abs() * travel / 0.8 - 2.0).abs() < 1e-12, "turn of {drive:?}");
        }
    }

    #[test]
    fn steering_errors_have_the_stated_size_and_memory() {
        let mut random = Random::new(1, groma_estimation::streams::Purpose::Wheels);
        let mut disturbance = Disturbance::new(WheelNoise::default(), &mut random);
        let errors: Vec<f64> = (0..200_000).map(|_| disturbance.step([0.0; 2], 0.02, &mut random).1).collect();
        let mean_sq = |lag: usize| {
            let pairs = errors.windows(lag + 1).map(|w| w[0] * w[lag]);
            pairs.sum::<f64>() / (errors.len() - lag) as f64
        };
        let sigma = WheelNoise::default().steering;
        assert!((mean_sq(0).sqrt() / sigma - 1.0).abs() < 0.1);
        assert!((mean_sq(150) / mean_sq(0) - (-1.0_f64).exp()).abs() < 0.1);
    }
}

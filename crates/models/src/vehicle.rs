//! A vehicle: what its wheels do, where its scanners sit, and how well all of that is known.
//!
//! ```text
//! drive      counts of the wheels -> motion of the base          (see `tricycle`, `differential`)
//! scanners   T_base_scanner of each, and what its ranges are too long
//! delay      a scan stamped t is of the wheels' time t + delay
//! noise      what the wheels do beside what they read
//! covariance of the estimated parameters, by name
//! ```
//!
//! The base lies midway between the fixed wheels, x forward. Height, roll and pitch of a scanner do not show in planar motion
//! and are not here. One scanner is used for now; the list is there for more.

use crate::differential::Differential;
use crate::drive::Drive;
use crate::error::{ModelError, require};
use crate::tricycle::Tricycle;
use groma_geometry::Se2;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

mod handedness;
mod spec;

pub use spec::VehicleSpec;

/// A scanner on a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Scanner {
    /// Its frame or topic; may be empty where there is one.
    pub name: String,
    /// `T_base_scanner`.
    pub mount: Se2,
    /// What its ranges are too long [m].
    pub range_offset: f64,
}

impl Scanner {
    /// A scanner at x, y [m] and yaw [rad] on the base.
    ///
    /// # Errors
    /// A number that is not finite or out of range.
    pub fn new(name: String, [x, y, yaw]: [f64; 3], range_offset: f64) -> Result<Self, ModelError> {
        let place = "must be within 1000 m of the base";
        require("laser_x", x, x.abs() <= LONGEST, place)?;
        require("laser_y", y, y.abs() <= LONGEST, place)?;
        require("laser_yaw", yaw, yaw.abs() <= LONGEST, "must be within 1000 rad")?;
        require("range_offset", range_offset, range_offset.abs() <= 10.0, "must be at most 10 m either way")?;
        Ok(Self { name, mount: Se2::new(x, y, yaw), range_offset })
    }
}

/// What wheels do beside what they read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WheelNoise {
    /// Standard deviation of the travel of a driven wheel after one metre [m]; it grows with the root of the distance.
    pub slip: f64,
    /// Standard deviation of the steering angle that the encoder does not see [rad].
    pub steering: f64,
    /// For how long a steering error lasts before it is another one [s].
    pub memory: f64,
}

impl Default for WheelNoise {
    fn default() -> Self {
        Self { slip: 0.5e-3, steering: 0.02_f64.to_radians(), memory: 3.0 }
    }
}

impl WheelNoise {
    /// Whether every number is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), ModelError> {
        require("noise.slip", self.slip, (0.0..=LONGEST).contains(&self.slip), "must be between 0 and 1000 m")?;
        require(
            "noise.steering",
            self.steering,
            (0.0..=PI).contains(&self.steering),
            "must be between 0 and half a turn",
        )?;
        let holds = self.memory > 0.0 && self.memory <= LONGEST_MEMORY;
        require("noise.memory", self.memory, holds, "must be above 0 s and at most a day")
    }
}

/// Unit of the counters of the driven wheels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CounterUnit {
    /// Radians: a scale is the radius of a wheel [m].
    #[default]
    Rad,
    /// Ticks: a scale is metres a tick.
    Tick,
}

/// The joint covariance of the estimated parameters; the others were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterCovariance {
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Their covariance.
    pub matrix: DMatrix<f64>,
}

impl ParameterCovariance {
    fn check(&self) -> Result<(), ModelError> {
        let (n, m) = (self.names.len(), &self.matrix);
        if let Some(name) = (1..n).map(|k| &self.names[k]).zip(1..).find(|(name, k)| self.names[..*k].contains(name)) {
            return Err(ModelError::Vehicle(format!("covariance: {} is named twice", name.0)));
        }
        require("covariance", m.nrows() as f64, m.shape() == (n, n), "must have a row and a column a parameter")?;
        for (k, value) in m.iter().enumerate() {
            let is_variance = k % (n + 1) == 0;
            let holds = if is_variance { *value > 0.0 && *value <= LARGEST_VARIANCE } else { true };
            require("covariance", *value, holds, "must be finite, variances above 0 and at most 1e12")?;
        }
        if n == 0 {
            return Ok(());
        }
        let scaled = DMatrix::from_fn(n, n, |i, j| m[(i, j)] / (m[(i, i)].sqrt() * m[(j, j)].sqrt()));
        let skew = (&scaled - scaled.transpose()).amax();
        require("covariance", skew, skew <= ROUNDING, "must be symmetric")?;
        let least = scaled.symmetric_eigenvalues().iter().fold(1.0, |a: f64, b| a.min(*b));
        require("covariance", least, least >= -ROUNDING, "has a direction of negative variance: must be positive")
    }
}

/// A calibrated vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "VehicleSpec", into = "VehicleSpec")]
pub struct Vehicle {
    drive: Drive,
    scanners: Vec<Scanner>,
    delay: f64,
    noise: WheelNoise,
    covariance: ParameterCovariance,
    unit: CounterUnit,
    joints: Vec<String>,
}

/// Longest delay, base or radius that any wheeled vehicle has; beyond it a number has the wrong unit.
const LONGEST: f64 = 1e3;
/// Longest memory of a steering error [s]: beyond a day it is an offset.
const LONGEST_MEMORY: f64 = 86_400.0;
/// Largest variance of a parameter: beyond it nothing is known, and nothing can be computed.
const LARGEST_VARIANCE: f64 = 1e12;
/// How far rounding may take a covariance below zero, as a share of its variances.
const ROUNDING: f64 = 1e-9;
/// Shortest wheelbase or axle [m].
const SHORTEST: f64 = 1e-3;
/// Smallest travel of a wheel per unit of its counter [m].
const LEAST_TRAVEL: f64 = 1e-9;

impl Vehicle {
    /// A vehicle of parameters that are known, with usual noise.
    ///
    /// # Errors
    /// The first number that is not finite or out of range, by name.
    pub fn new(drive: Drive, scanners: Vec<Scanner>, delay: f64) -> Result<Self, ModelError> {
        check_drive(&drive)?;
        require("delay", delay, delay.abs() <= LONGEST, "must be at most 1000 s either way")?;
        for scanner in &scanners {
            check_scanner(scanner)?;
        }
        let (noise, covariance) = (WheelNoise::default(), ParameterCovariance::default());
        Ok(Self { drive, scanners, delay, noise, covariance, unit: CounterUnit::Rad, joints: Vec::new() })
    }

    /// The same with its own noise.
    ///
    /// # Errors
    /// A number out of range.
    pub fn with_noise(mut self, noise: WheelNoise) -> Result<Self, ModelError> {
        noise.validate()?;
        self.noise = noise;
        Ok(self)
    }

    /// The same with the covariance of its estimated parameters.
    ///
    /// # Errors
    /// A name that the vehicle does not have, a matrix that is not finite, symmetric and positive.
    pub fn with_covariance(mut self, covariance: ParameterCovariance) -> Result<Self, ModelError> {
        covariance.check()?;
        let names = self.parameter_names();
        if let Some(name) = covariance.names.iter().find(|name| !names.contains(&name.as_str())) {
            let known = names.join(", ");
            return Err(ModelError::Vehicle(format!("covariance: no parameter is called {name}: there are {known}")));
        }
        self.covariance = covariance;
        Ok(self)
    }

    /// The same with the names of its joints and the unit of its counters.
    ///
    /// # Errors
    /// Other than two joints, or none.
    pub fn with_joints(mut self, joints: Vec<String>, unit: CounterUnit) -> Result<Self, ModelError> {
        if !joints.is_empty() && joints.len() != 2 {
            return Err(ModelError::Vehicle(format!("joints: a vehicle has two, not {}", joints.len())));
        }
        (self.joints, self.unit) = (joints, unit);
        Ok(self)
    }

    /// Names of the parameters that can have a covariance.
    #[must_use]
    pub fn parameter_names(&self) -> Vec<&'static str> {
        let one_offset = if matches!(self.drive, Drive::Tricycle(_)) { &["steering_offset"][..] } else { &[] };
        self.drive
            .names()
            .iter()
            .chain(one_offset)
            .chain(&["laser_x", "laser_y", "laser_yaw", "delay"])
            .copied()
            .collect()
    }

    /// Whether a tricycle has one steering offset forward and another one backward.
    #[must_use]
    pub fn is_asymmetric(&self) -> bool {
        let Drive::Tricycle(t) = self.drive else { return false };
        let estimated = self.covariance.names.iter().any(|name| Tricycle::NAMES[3..].contains(&name.as_str()));
        estimated || t.offset_forward != t.offset_backward
    }

    /// What its wheels do.
    #[must_use]
    pub fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Its scanners.
    #[must_use]
    pub fn scanners(&self) -> &[Scanner] {
        &self.scanners
    }

    /// `T_base_scanner` of the first scanner; the base where there is none.
    #[must_use]
    pub fn mount(&self) -> Se2 {
        self.scanners.first().map_or(Se2::IDENTITY, |s| s.mount)
    }

    /// A scan stamped t is of the wheels' time t + delay [s].
    #[must_use]
    pub fn delay(&self) -> f64 {
        self.delay
    }

    /// What its wheels do beside what they read.
    #[must_use]
    pub fn noise(&self) -> &WheelNoise {
        &self.noise
    }

    /// Covariance of the estimated parameters.
    #[must_use]
    pub fn covariance(&self) -> &ParameterCovariance {
        &self.covariance
    }

    /// Unit of the counters.
    #[must_use]
    pub fn unit(&self) -> CounterUnit {
        self.unit
    }

    /// Names of the joints, first and second reading; empty where the recording has no others.
    #[must_use]
    pub fn joints(&self) -> &[String] {
        &self.joints
    }
}

fn check_drive(drive: &Drive) -> Result<(), ModelError> {
    let scale = |name, v: f64| {
        let holds = (LEAST_TRAVEL..=LONGEST).contains(&v.abs());
        require(name, v, holds, "must be between 1e-9 and 1000 m, of either sign")
    };
    let length = |name, v: f64| {
        require(name, v, (SHORTEST..=LONGEST).contains(&v.abs()), "must be between 1 mm and 1000 m, of either sign")
    };
    let angle = |name, v: f64| require(name, v, v.abs() <= PI, "must be within half a turn");
    match drive {
        Drive::Tricycle(Tricycle { scale: s, wheelbase, gain, offset_forward, offset_backward }) => {
            scale("drive_scale", *s)?;
            length("wheelbase", *wheelbase)?;
            require("steering_gain", *gain, (1e-6..=1e6).contains(&gain.abs()), "must be between 1e-6 and 1e6")?;
            angle("steering_offset_forward", *offset_forward)?;
            angle("steering_offset_backward", *offset_backward)
        }
        Drive::Differential(Differential { left, right, axle }) => {
            scale("left_radius", *left)?;
            scale("right_radius", *right)?;
            length("axle", *axle)
        }
    }
}

fn check_scanner(scanner: &Scanner) -> Result<(), ModelError> {
    let pose = scanner.mount.to_vector();
    Scanner::new(String::new(), [pose.x, pose.y, pose.z], scanner.range_offset).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fork() -> Drive {
        Drive::Tricycle(Tricycle::from_parameters([0.125, 1.5, 1.0, 0.01, 0.01]))
    }

    fn laser(x: f64) -> Vec<Scanner> {
        vec![Scanner { name: String::new(), mount: Se2::new(x, 0.0, 0.1), range_offset: 0.0 }]
    }

    #[test]
    fn numbers_out_of_range_are_refused_by_name() {
        let named = |drive: Drive, x: f64, delay: f64| Vehicle::new(drive, laser(x), delay).unwrap_err().to_string();
        for bad in [f64::NAN, f64::INFINITY, 1e300, -1e300] {
            assert!(named(fork(), bad, 0.0).starts_with("laser_x"));
            assert!(named(fork(), 0.1, bad).starts_with("delay"));
        }
        let wheelbase = |l: f64| Drive::Tricycle(Tricycle::from_parameters([0.125, l, 1.0, 0.0, 0.0]));
        for bad in [0.0, 1e-300, f64::NAN, 1e300] {
            assert!(named(wheelbase(bad), 0.1, 0.0).starts_with("wheelbase"));
        }
        let wheels = |left: f64| Drive::Differential(Differential { left, right: 0.1, axle: 0.5 });
        for bad in [0.0, f64::NAN, f64::INFINITY, 1e300] {
            assert!(named(wheels(bad), 0.1, 0.0).starts_with("left_radius"));
        }
        assert!(Vehicle::new(wheelbase(-1.2), laser(0.1), -0.05).is_ok());
    }

    #[test]
    fn noise_and_covariance_are_checked() {
        let vehicle = Vehicle::new(fork(), laser(0.3), 0.0).unwrap();
        let bad = WheelNoise { slip: f64::NAN, ..WheelNoise::default() };
        assert!(vehicle.clone().with_noise(bad).is_err());
        let of = |n: usize, v: f64| ParameterCovariance {
            names: vec!["delay".into(); n],
            matrix: DMatrix::from_element(1, 1, v),
        };
        assert!(vehicle.clone().with_covariance(of(1, 1e-6)).is_ok());
        assert!(vehicle.clone().with_covariance(of(1, -1e-6)).is_err());
        assert!(vehicle.clone().with_covariance(of(2, 1e-6)).is_err());
        assert!(vehicle.with_covariance(of(1, f64::NAN)).is_err());
    }
}

//! What a pipeline is fed with. A message can only be built finite: the constructor names the field and its value.
//!
//! Kinds that no pipeline uses yet (IMU, timed transforms) are reserved: machines pass them over.

use groma_geometry::Se2;
use groma_models::{LaserScan, ModelError, Odometry};
use nalgebra::{Matrix3, Vector3};

/// A message with the time of its measurement.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// A sweep of scanner `scanner` of the vehicle.
    Scan {
        /// Which scanner, in the order of the vehicle.
        scanner: usize,
        /// The sweep.
        scan: LaserScan,
    },
    /// A pose of the vehicle in a frame that drifts.
    Odometry(Odometry),
    /// Readings of wheels and steering, one or more joints.
    Wheels(WheelReading),
    /// Turn rates and accelerations.
    Imu(Imu),
    /// What a camera saw of a target.
    Detections(Detections),
    /// Where the vehicle is, as somebody says.
    StartPose(StartPose),
    /// An edge of the frame tree at a time.
    Transform(TimedTransform),
}

/// Readings of some joints of a vehicle at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelReading {
    /// Time by the clock of the wheels [s].
    pub stamp: f64,
    /// Which joint of the vehicle (0 or 1, in the order of its drive) and its position, in the unit of its counter or radians.
    pub positions: Vec<(usize, f64)>,
}

/// A reading of an inertial unit; reserved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Imu {
    /// Time [s].
    pub stamp: f64,
    /// Turn rates about x, y, z [rad/s].
    pub angular_velocity: Vector3<f64>,
    /// Accelerations along x, y, z [m/s^2].
    pub linear_acceleration: Vector3<f64>,
}

/// Corners of a target in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detections {
    /// Time [s].
    pub stamp: f64,
    /// Which camera, in the order of the survey.
    pub camera: usize,
    /// Corner of the target, u and v [pixel], their standard deviation [pixel].
    pub corners: Vec<(usize, f64, f64, f64)>,
}

/// A pose of the vehicle in the map that somebody gives, with what it is worth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPose {
    /// Time [s].
    pub stamp: f64,
    /// `T_map_base`.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
}

/// An edge of the frame tree; reserved.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedTransform {
    /// Time [s].
    pub stamp: f64,
    /// Parent frame.
    pub parent: String,
    /// Child frame.
    pub child: String,
    /// `T_parent_child` in the plane.
    pub pose: Se2,
}

impl Message {
    /// The time of the measurement [s]: of a scan that of its first beam.
    #[must_use]
    pub fn stamp(&self) -> f64 {
        match self {
            Self::Scan { scan, .. } => scan.stamp,
            Self::Odometry(m) => m.stamp,
            Self::Wheels(m) => m.stamp,
            Self::Imu(m) => m.stamp,
            Self::Detections(m) => m.stamp,
            Self::StartPose(m) => m.stamp,
            Self::Transform(m) => m.stamp,
        }
    }

    /// When the measurement was complete [s]: of a scan the time of its last beam.
    #[must_use]
    pub fn end(&self) -> f64 {
        match self {
            Self::Scan { scan, .. } => scan.stamp.max(scan.beam_stamp(scan.ranges.len().saturating_sub(1))),
            _ => self.stamp(),
        }
    }

    /// What the message is called where it is counted.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Scan { .. } => "scans",
            Self::Odometry(_) => "odometry",
            Self::Wheels(_) => "wheel readings",
            Self::Imu(_) => "readings of the inertial unit",
            Self::Detections(_) => "detections",
            Self::StartPose(_) => "start poses",
            Self::Transform(_) => "transforms",
        }
    }

    /// The stream within which stamps must rise.
    #[must_use]
    pub fn stream(&self) -> (u8, usize) {
        match self {
            Self::Odometry(_) => (0, 0),
            Self::Wheels(m) => (1, m.positions.first().map_or(0, |(joint, _)| *joint)),
            Self::Imu(_) => (2, 0),
            Self::Transform(_) => (3, 0),
            Self::StartPose(_) => (4, 0),
            Self::Scan { scanner, .. } => (5, *scanner),
            Self::Detections(m) => (6, m.camera),
        }
    }
}

impl WheelReading {
    /// Checks a reading.
    ///
    /// # Errors
    /// A stamp or position that is not finite.
    pub fn new(stamp: f64, positions: Vec<(usize, f64)>) -> Result<Self, ModelError> {
        finite("stamp", stamp)?;
        for (_, position) in &positions {
            finite("position", *position)?;
        }
        Ok(Self { stamp, positions })
    }
}

/// A number, or an error that names it.
///
/// # Errors
/// When it is NaN or infinite.
pub fn finite(name: &'static str, value: f64) -> Result<f64, ModelError> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(ModelError::Setting { name, value, rule: "must be a finite number" })
    }
}

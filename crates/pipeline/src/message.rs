//! What a pipeline is fed with. [`Message::validate`] names the first field that is not finite or out of the bounds of
//! [`groma_models::bounds`], and its value; the stage that orders messages lets none pass that is not valid.
//!
//! Kinds that no pipeline uses yet (IMU, timed transforms) are reserved: machines pass them over.

use groma_geometry::Se2;
use groma_models::bounds::{ANGLE, Bound, COORDINATE, JOINT, PIXEL, STAMP, VARIANCE};
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

/// Corners of one panel of a target in an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Detections {
    /// Time [s].
    pub stamp: f64,
    /// Which camera, in the order of the survey.
    pub camera: usize,
    /// Which panel of the target.
    pub panel: usize,
    /// Number of the stop that it was taken at, where it is known.
    pub stop: Option<u64>,
    /// Corner of the panel, u and v [pixel], their standard deviation [pixel].
    pub corners: Vec<(usize, f64, f64, f64)>,
}

/// A pose of the vehicle in the map that somebody gives, with its covariance.
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

    /// Refuses a message that no sensor gives.
    ///
    /// # Errors
    /// The first field that is not finite or out of its bound, by name and value.
    pub fn validate(&self) -> Result<(), ModelError> {
        STAMP.check("stamp", self.stamp())?;
        match self {
            Self::Scan { scan, .. } => scan.validate(),
            Self::Odometry(m) => m.validate(),
            Self::Wheels(m) => all(&JOINT, "position", m.positions.iter().map(|(_, position)| *position)),
            Self::Imu(m) => all(&JOINT, "imu", m.angular_velocity.iter().chain(&m.linear_acceleration).copied()),
            Self::Detections(m) => all(&PIXEL, "corner", m.corners.iter().flat_map(|&(_, u, v, sigma)| [u, v, sigma])),
            Self::StartPose(m) => {
                within("pose", &m.pose)?;
                all(&VARIANCE, "covariance", m.covariance.iter().copied())
            }
            Self::Transform(m) => within("pose", &m.pose),
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
    /// A stamp or position that is not finite or out of its bound.
    pub fn new(stamp: f64, positions: Vec<(usize, f64)>) -> Result<Self, ModelError> {
        STAMP.check("stamp", stamp)?;
        all(&JOINT, "position", positions.iter().map(|(_, position)| *position))?;
        Ok(Self { stamp, positions })
    }
}

fn all(bound: &Bound, field: &'static str, mut values: impl Iterator<Item = f64>) -> Result<(), ModelError> {
    values.try_for_each(|value| bound.check(field, value))
}

fn within(field: &'static str, pose: &Se2) -> Result<(), ModelError> {
    all(&COORDINATE, field, [pose.x(), pose.y()].into_iter())?;
    ANGLE.check(field, pose.theta())
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;

    const WRONG: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300];

    fn refused(message: Message) -> bool {
        message.validate().is_err()
    }

    #[test]
    fn no_field_of_a_message_takes_what_is_not_finite_or_absurd() {
        let geometry =
            BeamGeometry { angle_min: 0.0, angle_increment: 0.1, time_increment: 0.0, range_min: 0.1, range_max: 9.0 };
        let scan = |stamp, geometry| Message::Scan {
            scanner: 0,
            scan: LaserScan { stamp, geometry, ranges: vec![1.0; 9], intensities: vec![] },
        };
        assert!(!refused(scan(1.0, geometry)));
        for bad in WRONG {
            assert!(refused(scan(bad, geometry)));
            assert!(refused(scan(0.0, BeamGeometry { angle_min: bad, ..geometry })));
            assert!(refused(scan(0.0, BeamGeometry { angle_increment: bad, ..geometry })));
            assert!(refused(scan(0.0, BeamGeometry { time_increment: bad, ..geometry })));
            assert!(refused(scan(0.0, BeamGeometry { range_min: bad, ..geometry })));
            assert!(refused(scan(0.0, BeamGeometry { range_max: bad, ..geometry })));
            let pose = |x, y| Odometry { stamp: 0.0, pose: Se2::new(x, y, 0.0) };
            assert!(refused(Message::Odometry(pose(bad, 0.0))) && refused(Message::Odometry(pose(0.0, bad))));
            assert!(WheelReading::new(bad, vec![]).is_err() && WheelReading::new(0.0, vec![(0, bad)]).is_err());
            let corners = vec![(0, 1.0, bad, 0.1)];
            let corners = Detections { stamp: 0.0, camera: 0, panel: 0, stop: None, corners };
            assert!(refused(Message::Detections(corners)));
            let start = StartPose { stamp: 0.0, pose: Se2::IDENTITY, covariance: Matrix3::repeat(bad) };
            assert!(refused(Message::StartPose(start)));
        }
        assert!(refused(scan(0.0, BeamGeometry { angle_increment: 0.0, ..geometry })));
    }

    #[test]
    fn a_scan_is_refused_by_its_last_beam_as_by_its_first() {
        let scan = |stamp, angle_increment, time_increment| {
            let geometry =
                BeamGeometry { angle_min: 0.0, angle_increment, time_increment, range_min: 0.1, range_max: 9.0 };
            Message::Scan {
                scanner: 0,
                scan: LaserScan { stamp, geometry, ranges: vec![1.0; 361], intensities: vec![] },
            }
        };
        let latest = groma_models::bounds::STAMP.high;
        assert!(!refused(scan(latest, 0.01, 0.0)) && !refused(scan(0.0, -0.01, 0.1)));
        assert!(refused(scan(0.0, -1.0, 0.0)) && refused(scan(0.0, 1.0, 0.0)), "no scanner turns 57 times a scan");
        assert!(refused(scan(latest, 0.01, 0.1)) && !refused(scan(latest, 0.01, -0.1)));
    }
}

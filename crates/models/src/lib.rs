//! The nouns of the system: values that every other crate reads and none changes behind another's back.
//!
//! What numbers they may hold stands once, in [`bounds`]. A [`Vehicle`] and a [`Camera`] can only be built finite and in
//! range. Scans, odometry and grids are plain values that the estimators write by the thousand; what comes in from outside
//! passes their `validate` first, at every border: the constructors of the Python values, the bindings, and the stage that
//! orders the messages of a pipeline. Each names the field and the value. A landmark map is checked by the localizer that is
//! made of it.

pub mod bounds;
pub mod camera;
pub mod differential;
pub mod drive;
pub mod error;
pub mod finding;
pub mod grid;
pub mod increment;
pub mod landmark_map;
pub mod laser_scan;
pub mod odometry;
pub mod odometry_noise;
pub mod target;
pub mod token;
pub mod tricycle;
pub mod vehicle;
pub mod wheel_log;
pub mod wheel_motion;

pub use camera::{Camera, CameraSpec, Lens};
pub use differential::Differential;
pub use drive::Drive;
pub use error::ModelError;
pub use finding::Finding;
pub use grid::{Cell, Grid};
pub use increment::Increment;
pub use landmark_map::{Landmark, LandmarkKind, LandmarkMap};
pub use laser_scan::{BeamGeometry, LaserScan};
pub use odometry::{Odometry, OdometryTrack};
pub use odometry_noise::OdometryNoise;
pub use target::{Panel, Pattern, Target};
pub use token::{Cancelled, Token};
pub use tricycle::Tricycle;
pub use vehicle::{CounterUnit, ParameterCovariance, Scanner, Vehicle, WheelNoise};
pub use wheel_log::{WheelKind, WheelLog};
pub use wheel_motion::{WheelMotion, WheelPath};

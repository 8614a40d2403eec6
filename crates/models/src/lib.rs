//! The nouns of the system: values that every other crate reads and none changes behind another's back.

pub mod camera;
pub mod error;
pub mod grid;
pub mod landmark_map;
pub mod laser_scan;
pub mod odometry;
pub mod target;

pub use camera::{Camera, CameraSpec, Lens};
pub use error::ModelError;
pub use grid::{Cell, Grid};
pub use landmark_map::{Landmark, LandmarkMap};
pub use laser_scan::{BeamGeometry, LaserScan};
pub use odometry::{Odometry, OdometryTrack};
pub use target::{Panel, Pattern, Target};

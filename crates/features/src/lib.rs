//! Natural landmarks of laser scans: where they are, what they look like, which belong together.
//!
//! [`falko`] and [`oc`] find corners in one scan, [`bsc`] and [`cgh`] describe them, [`reflector`] finds marks of
//! reflecting tape, [`marks`] all of them at once, [`glarot`] tells which local maps look alike, [`association`] pairs the landmarks of two maps and finds
//! the rigid motion between them.
//!
//! Source of the family: F. Kallasi, D. L. Rizzini, S. Caselli, "Fast keypoint features from laser scanner for robot
//! localization and mapping", IEEE RA-L 1(1), 2016; "Efficient loop closure based on FALKO lidar features for online
//! robot localization and mapping", IROS 2016.

pub mod association;
pub mod bsc;
pub mod cgh;
pub mod falko;
pub mod glarot;
mod keypoint;
pub mod marks;
pub mod oc;
mod options;
pub mod reflector;
mod rigid_fit;
mod surroundings;

pub use keypoint::Keypoint;
pub use options::{InvalidOption, require};
pub use rigid_fit::{RigidFit, rigid_fit};
pub use surroundings::Surroundings;

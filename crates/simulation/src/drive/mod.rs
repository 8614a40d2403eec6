//! Drives: a route through a world, a vehicle that follows it, and what its wheels report.

pub mod follower;
pub mod odometry;
pub mod route;
pub mod vehicle;

pub use follower::{Drive, Limits};
pub use odometry::{Stall, WheelErrors, WheelReadings};
pub use route::{Leg, Route};
pub use vehicle::{Vehicle, Wheels};

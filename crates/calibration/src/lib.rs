//! Calibration: what the instruments of a vehicle and the cameras of a building are, from what they saw.

pub mod camera;
pub mod vehicle;

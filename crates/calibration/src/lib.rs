//! Calibration: what the instruments of a vehicle are, from what they saw.

pub mod vehicle;

//! Worlds, ray casting, drives and their noise.
//!
//! A [`Scenario`] names a scene (a building, drawn from a seed, and a route through it), a vehicle, a scanner and what is
//! wrong with them; [`simulate`] turns it into scans, odometry, joint readings and the truth. Estimators never see
//! this crate; the same scenario gives the same numbers everywhere.

pub mod calibration;
pub mod drive;
pub mod error;
pub mod network;
pub mod render;
pub mod scanner;
pub mod scenario;
pub mod scenes;
pub mod simulate;
pub mod world;

pub use calibration::{CalibrationDrive, CalibrationScenario, simulate_calibration};
pub use error::SimulationError;
pub use render::render;
pub use scanner::Scanner;
pub use scenario::Scenario;
pub use simulate::{Simulated, simulate};

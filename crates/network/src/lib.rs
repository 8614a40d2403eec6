//! Fixed cameras that never share a view, tied together by the odometry of a robot that carries a target.
//!
//! Errors of poses are *world-frame* errors here, `T = Exp(xi) T^`, against the rule of the other crates: see
//! [`measurement`] for why consistency depends on it.

pub mod batch;
pub mod error;
pub mod filter;
pub mod floor;
pub mod hand_eye;
pub mod measurement;
pub mod odometry;
pub mod options;
pub mod standstill;
pub mod survey;
pub mod view;

pub use error::Error;
pub use filter::NetworkFilter;
pub use floor::Floor;
pub use measurement::View;
pub use odometry::OdometryNoise;
pub use options::Options;
pub use survey::{NetworkMap, Survey};

//! How a laser moved between chosen moments ("stations"), from its scans alone, with a covariance that holds.
//!
//! A station is a standstill, whose scans are averaged beam by beam, or the first scan after a moment of the drive. The
//! tracker follows all scans, without odometry, so that whatever odometry is calibrated with these motions has
//! had no part in them; its poses are but the start. The motion between two successive stations is then measured
//! directly, by registering their scans to each other: nothing drifts, at any distance.

pub mod average;
pub mod follower;
pub mod station;

pub use follower::Follower;
pub use station::{Motion, Station, Verdict};

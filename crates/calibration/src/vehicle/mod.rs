//! Wheels, steering, pose of the laser and delay of a vehicle, from wheel readings and motions of the laser.
//!
//! [`calibrate`] is the way in. Closed forms ([`heading`], [`hand_eye`]) give the start ([`start`]), weighted or
//! heavy-tailed likelihood ([`likelihood`], [`robust`]) the answer, [`sandwich`] its covariance, [`observability`] what
//! the drive left open; [`groups`], [`held_out`] and [`stopping`] judge it.

pub mod calibrate;
pub mod error;
pub mod groups;
pub mod hand_eye;
pub mod heading;
pub mod held_out;
pub mod likelihood;
pub mod motions;
pub mod noise;
pub mod observability;
pub mod options;
pub mod parameters;
pub mod prediction;
pub mod request;
pub mod robust;
pub mod sandwich;
pub mod search;
pub mod start;
pub mod stopping;
pub mod trim;
pub mod wheel_process;
pub mod whitener;

pub use calibrate::{Calibration, calibrate};
pub use error::Error;
pub use motions::{Motion, Motions, Segments};
pub use options::Options;
pub use parameters::{Layout, Model, Vehicle};
pub use request::Request;

//! A vehicle on a landmark map.
//!
//! [`Localizer`] predicts with the wheels and updates with the corners and reflectors of a scan: [`joint`] is its filter,
//! [`options::Mode`] selects the landmarks that update the pose, [`quality`] judges the pose.
//!
//! Source of the family: F. Kallasi, PhD thesis, University of Parma, 2017, chapter on localization; the formulation is
//! our own where a file names no other.

mod associate;
mod beams;
mod error;
mod gates;
mod gating;
mod history;
mod integrity;
mod jcbb;
pub mod joint;
mod landmark_filter;
mod localizer;
mod map;
mod measurement;
mod memory;
pub mod observation;
mod odometer;
pub mod options;
mod point_index;
pub mod quality;
pub mod relocalize;
mod search;
mod symmetric;
mod update;
mod view;
mod wall_hold;
mod walls;
mod wheels;

pub use error::Error;
pub use joint::{CALIBRATION, CalibrationCovariance, DRIVE, Joint, Motion};
pub use landmark_filter::FoundCount;
pub use localizer::{Localizer, Start};
pub use map::InvalidMap;
pub use observation::Observation;
pub use options::{InvalidOption, Mode, Options};
pub use quality::{Quality, Status};
pub use relocalize::{LocalView, Located, RelocalizeOptions, Relocalizer};
pub use update::{Match, Update, View};
pub use view::sees;

//! Motions of a robot with panels before one camera: which of them calibrate it, and what to drive next.
//!
//! [`Stage`] is the camera on its mount and the panels on the robot; [`Motion`] the drives that people use;
//! [`Knowledge`] what views tell of the intrinsics; [`next_best`] the drive that lowers the worst projection uncertainty
//! most for its length; [`trials`] calibrates from drawn corners, end to end.

mod knowledge;
mod motion;
mod next_best;
mod stage;
mod trial;

pub use knowledge::Knowledge;
pub use motion::{Drive, Motion};
pub use next_best::{Search, next_best};
pub use stage::{PanelView, Stage};
pub use trial::{Trials, trials};

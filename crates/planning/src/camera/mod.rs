//! Motions of a robot with panels before one camera: which of them calibrate it, and what to drive next.
//!
//! [`Stage`] is the camera on its mount and the panels on the robot; [`Motion`] common trajectories;
//! [`Knowledge`] information of the views about the intrinsics; [`next_best`] the drive that lowers the worst projection
//! uncertainty most for what it costs; [`ranking`] common trajectories, best first; [`trials`] calibrates from drawn corners,
//! end to end, and [`study`] from a panel held in the hand, to see what number, tilt, distance, grid and coverage give.

mod foot;
mod knowledge;
mod motion;
mod next_best;
mod plan;
mod ranking;
mod stage;
mod step;
mod study;
mod trial;

pub use foot::{camera_by_panel, foot_and_mount};
pub use knowledge::Knowledge;
pub use motion::{Drive, Motion};
pub use next_best::{Search, next_best};
pub use plan::{Known, Plan, Stop};
pub use ranking::{Judged, ranking};
pub use stage::{FAN, PanelView, SIGMA, Stage, mount, nominal_camera, upright_panels};
pub use study::{Sitting, Study, study};
pub use trial::{Trials, Tries, trials};

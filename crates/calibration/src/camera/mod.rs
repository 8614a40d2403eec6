//! Intrinsics of a camera from views of flat panels, with what is known of them.
//!
//! [`calibrate`]: a start from nothing (`start`), joint refinement with the poses eliminated (`adjust`), corners that
//! do not belong left out (`reject`), mirrored poses tried again (`panel_pose`), refusal of views that do not allow
//! an estimate ([`Refusal`]), and the covariances of the parameters and of every pose (`information`). The claim is
//! checked by calibrating halves of the images against each other (`honesty`).
//!
//! Each panel in each image has a pose of its own: panels need not be rigid on each other. Assumes flat panels, corners
//! with independent errors, a lens that the model fits; the split halves tell when one of these does not hold.
//! [`panel_pose()`] is the pose of a panel from a calibrated camera.

mod adjust;
mod calibrate;
mod figures;
mod homography;
mod honesty;
mod information;
mod normal;
mod options;
mod panel_pose;
mod refusal;
mod reject;
mod start;
mod uncertainty;
mod view;

pub use calibrate::{CameraCalibration, ViewResult, calibrate};
pub use honesty::Honesty;
pub use options::Options;
pub use panel_pose::{PanelPose, Sensitivity, panel_pose};
pub use refusal::Refusal;
pub use uncertainty::ProjectionMap;
pub use view::{Sighting, View};

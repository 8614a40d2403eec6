//! Where a laser is from scan to scan: every scan is registered to the local map of the last metres.
//!
//! [`tracker`] is the way in: view and odometry increment in, pose and, now and then, a keyframe and a finished local map out.
//! [`motion`] predicts, [`rivals`] finds further starts and chooses among alignments, [`offset`] learns where the laser
//! is relative to the odometry, [`extrapolation`] continues the odometry to a moment that it has not reached yet.

mod directions;
pub mod extrapolation;
pub mod motion;
pub mod offset;
mod rivals;
pub mod tracked;
pub mod tracker;

pub use extrapolation::Increment;
pub use offset::Offset;
pub use tracked::{Tracked, has_enough_hits};
pub use tracker::{Finished, Lesson, Overruled, Tracker};

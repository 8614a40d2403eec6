//! Which arcs to drive so that a vehicle is calibrated as well as wanted, in the least time.
//!
//! [`plan`] is the way in: [`arcs`] lists what can be driven, [`floor`] what fits, [`design`] finds the best mixture with
//! a certified bound, [`rounding`] whole numbers of arcs, [`grid`] is what the thesis drives, to compare with.

pub mod arcs;
pub mod design;
pub mod floor;
pub mod grid;
pub mod plan;
pub mod rounding;

pub use arcs::{Arc, Limits, Noise};
pub use floor::{Floor, Footprint};
pub use plan::{Error, Plan, Request, plan};

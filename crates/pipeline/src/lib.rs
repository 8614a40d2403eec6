//! From messages to results: every pipeline is written once, as a machine that takes messages in the order of their arrival
//! and can be queried at any time.
//!
//! ```text
//! message -> order (bounded lateness, default 0) -> machine: push, state, snapshot, finish -> result + findings
//! ```
//!
//! The order of arrival decides, never a clock: the same messages in the same order give the same result, live or from a
//! file, with any number of threads. No machine looks ahead.

pub mod calibrate;
pub mod localize;
pub mod map;
pub mod map_at_poses;
pub mod message;
pub mod order;
pub mod survey;
mod text;
pub mod wheels;

pub use map::Map;
pub use map_at_poses::MapAtPoses;
pub use message::Message;
pub use order::{Left, Order, disorder};
pub use survey::SurveyCameras;
pub use wheels::{WheelOdometry, WheelReader, WheelRecord, WheelRow, WheelStep};

//! Tags and corners in images, to a fraction of a pixel.
//!
//! [`detect_tags`] finds AprilTags by AprilTag's own C library; [`refine`] moves any corner where edges meet to where the
//! grey values say, with a standard deviation; [`find_grid`] does both for a grid of tags and says what it left out.
//! The centre of the upper left pixel is (0, 0).

mod apriltag;
mod complete;
pub mod corner;
pub mod error;
pub mod grid;
pub mod image;
pub mod panels;
mod special;

pub use apriltag::{Family, Tag, detect_tags};
pub use corner::{Corner, Guess, refine};
pub use error::VisionError;
pub use grid::{Found, GridCorner, Options, find_grid};
pub use image::Gray;
pub use panels::{find_panels, tag_drawings};

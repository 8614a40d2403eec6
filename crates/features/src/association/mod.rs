//! Which landmarks of two maps are the same, and the rigid motion between the maps, without any first guess.
//!
//! Two pairs of landmarks of equal length, one in each map, give two motions (either way round). The method lists such
//! motions, counts for each how many landmarks of b fall on one of a, and refines the best:
//!
//! ```text
//! 1. pairs of a and of b with a length in a band; those of b sorted by length                       `segments`
//! 2. pairs of nearly equal length -> motions; all of them, or an even share of the pairs of a within a budget
//! 3. where the motions are many: only those that many others agree with, by votes on a grid         `votes`
//! 4. count inliers on a grid, best first; refine: one-to-one pairs, least squares, again            `verify`
//! 5. keep the best that differ
//! ```
//!
//! Other ways to such motions are a [`Method`] each, a file each, and end in the same step 4 and 5: [`associate_by`].
//!
//! RANSAC over pairs (Fischler, Bolles 1981), made exhaustive, hence deterministic: no seed. Mirror images cannot occur.
//! Assumes points with errors well below the tolerance. Says nothing of how likely a false match is: check the number of
//! pairs, and verify with the scans.

mod clique;
mod hough;
mod method;
mod nearest;
mod options;
mod problem;
mod ransac;
mod search;
mod segments;
mod verify;
mod votes;

pub use method::{Found, Method, associate_by};
pub use options::Options;
pub use search::{Hypothesis, associate, associate_compatible, associate_facing};

//! Reflectors: marks of retro-reflecting tape, flat or wound around a post, found by how bright they are and how wide.
//!
//! ```text
//! level       m(r)   what a diffuse surface sends back at range r, of this scan itself, see `background`
//! bright      ln I >= m(r) + max(ln contrast, spread_factor s),   s how far surfaces differ upwards
//! mark        a run of bright beams whose ranges follow each other, as wide as a mark may be, with both ends in view,
//!             and not much darker (in logarithms) than the brightest mark of the scan: tape is alike, bright paint is not
//! centre      middle of a line between the ends (flat), axis of a cylinder of known radius (post), or both weighted by
//!             how well they explain the ranges and the number of beams, see `shape`
//! ```
//!
//! A reflector has no identity: which is which is for association to find. The level is learned from each scan, so
//! that scanners that scale the intensity with range, those that do not, and those that compress it serve alike. A scan
//! without intensities has no reflectors.
//!
//! Assumes that less than half of the hits at any range are reflectors, and less than a quarter of all. It does not
//! deskew: a mark spans few beams, and the beam in its middle tells its time.
//!
//! Own definition; the use of reflectors beside natural features follows F. Kallasi, thesis, Parma 2017, chapter 5.

mod background;
mod batch;
mod detector;
mod options;
mod shape;

pub use batch::detect_all;
pub use detector::{Detector, detect};
pub use options::Options;

use nalgebra::{Matrix2, Vector2};

/// A reflecting mark in one scan, in the laser frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reflector {
    /// Beam in its middle.
    pub index: usize,
    /// Its centre: the middle of a flat mark, the axis of a post [m].
    pub point: Vector2<f64>,
    /// Covariance of the centre [m^2].
    pub covariance: Matrix2<f64>,
    /// Probability that it is a post, 0 to 1.
    pub post: f64,
    /// Its width across the line of sight [m].
    pub width: f64,
    /// By how many times it is brighter than a diffuse surface at its range.
    pub contrast: f64,
}

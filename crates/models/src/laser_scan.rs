//! A 2D laser scan with its beam geometry and its timing.
//!
//! Beam i has bearing `angle_min + i * angle_increment` in the laser frame and was fired at
//! `stamp + i * time_increment` (the ROS convention: the stamp is that of the first beam). A reading is a hit iff it is
//! finite and `range_min <= r <= range_max`; a reader writes `+inf` where its format says "no return".

use crate::bounds::{ANGLE_MIN, ANGLE_STEP, BEAMS, RANGE, STAMP, TIME_INCREMENT};
use crate::error::ModelError;
use nalgebra::Vector2;

/// Where the beams of a scanner point and what they can measure. Equal for all scans of one scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamGeometry {
    /// Bearing of beam 0 [rad].
    pub angle_min: f64,
    /// Bearing step [rad]; may be negative.
    pub angle_increment: f64,
    /// Time between two beams [s]; 0 when unknown.
    pub time_increment: f64,
    /// Shortest range that counts as a hit [m].
    pub range_min: f64,
    /// Longest range that counts as a hit [m].
    pub range_max: f64,
}

/// One sweep of the scanner.
#[derive(Clone, Debug, PartialEq)]
pub struct LaserScan {
    /// Time of the first beam [s].
    pub stamp: f64,
    /// Beam geometry.
    pub geometry: BeamGeometry,
    /// Readings [m]; `+inf` no return, NaN invalid.
    pub ranges: Vec<f64>,
    /// Intensities in the scanner's own unit, as many as ranges, or empty.
    pub intensities: Vec<f64>,
}

impl BeamGeometry {
    /// Bearing of beam `i` [rad], not wrapped.
    #[must_use]
    pub fn bearing(&self, i: usize) -> f64 {
        self.angle_min + i as f64 * self.angle_increment
    }

    /// Refuses what no scanner has.
    ///
    /// # Errors
    /// A field that is not finite or out of its bound, or a step between beams of 0.
    pub fn validate(&self) -> Result<(), ModelError> {
        ANGLE_MIN.check("angle_min", self.angle_min)?;
        ANGLE_STEP.check("size of angle_increment", self.angle_increment.abs())?;
        TIME_INCREMENT.check("time_increment", self.time_increment)?;
        RANGE.check("range_min", self.range_min)?;
        RANGE.check("range_max", self.range_max)
    }

    /// Whether a reading is a hit.
    #[must_use]
    #[inline(always)]
    pub fn is_hit(&self, range: f64) -> bool {
        range.is_finite() & (range > 0.0) & (range >= self.range_min) & (range <= self.range_max)
    }
}

impl LaserScan {
    /// The hits as `(beam index, point in the laser frame [m])`, in beam order.
    pub fn hits(&self) -> impl Iterator<Item = (usize, Vector2<f64>)> + '_ {
        self.ranges.iter().enumerate().filter(|&(_, &r)| self.geometry.is_hit(r)).map(|(i, &r)| {
            let (s, c) = self.geometry.bearing(i).sin_cos();
            (i, Vector2::new(r * c, r * s))
        })
    }

    /// Refuses a scan that no scanner gives; readings may be anything, those that are no hit do not count.
    ///
    /// # Errors
    /// A field of the geometry, or the stamp or bearing of the first or last beam, out of its bound; no beam or too many.
    pub fn validate(&self) -> Result<(), ModelError> {
        let last = self.ranges.len().saturating_sub(1);
        STAMP.check("stamp", self.stamp)?;
        BEAMS.check("beams", self.ranges.len() as f64)?;
        self.geometry.validate()?;
        STAMP.check("stamp of the last beam", self.beam_stamp(last))?;
        ANGLE_MIN.check("bearing of the last beam", self.geometry.bearing(last))
    }

    /// Time of beam `i` [s].
    #[must_use]
    pub fn beam_stamp(&self, i: usize) -> f64 {
        self.stamp + i as f64 * self.geometry.time_increment
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_skip_what_is_no_return() {
        let geometry =
            BeamGeometry { angle_min: 0.0, angle_increment: 0.1, time_increment: 0.0, range_min: 0.1, range_max: 5.0 };
        let ranges = vec![1.0, f64::NAN, f64::INFINITY, -1.0, 0.0, 0.05, 5.0, 6.0];
        let scan = LaserScan { stamp: 0.0, geometry, ranges, intensities: vec![] };
        assert_eq!(scan.hits().map(|(i, _)| i).collect::<Vec<_>>(), [0, 6]);
    }
}

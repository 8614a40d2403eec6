//! A 2D laser scan with its beam geometry and its timing.
//!
//! Beam i has bearing `angle_min + i * angle_increment` in the laser frame and was fired at
//! `stamp + i * time_increment` (the ROS convention: the stamp is that of the first beam). A reading is a hit iff it is
//! finite and `range_min <= r <= range_max`; a reader writes `+inf` where its format says "no return".

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

//! What the numbers of the physical world can be: the bounds of everything that a message, a map or a setting brings in.
//!
//! A number outside of its bound has the wrong unit, or is an accident. Within them no sum overflows, and no loop or
//! allocation depends on an extent that nobody checked. They are generous: every scanner, vehicle and building fits many
//! times. NaN is in no bound.

use crate::error::ModelError;

/// An interval of allowed values, ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// Name of the quantity.
    pub name: &'static str,
    /// Least value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// The bound in words, unit included.
    pub rule: &'static str,
}

/// A time [s]: three thousand years either way.
pub const STAMP: Bound = Bound::new("stamp", -1e11, 1e11, "must be within 1e11 s of 1970");
/// A coordinate [m]: the earth's quarter.
pub const COORDINATE: Bound = Bound::new("coordinate", -1e7, 1e7, "must be within 1e7 m of the origin");
/// A heading or the angle of a joint, perhaps unrolled [rad].
pub const ANGLE: Bound = Bound::new("angle", -1e9, 1e9, "must be within 1e9 rad");
/// Position or speed of a joint: an angle [rad], perhaps unrolled, or a count.
pub const JOINT: Bound = Bound::new("joint", -1e15, 1e15, "must be within 1e15");
/// Counts of an encoder per turn, or until it starts anew.
pub const PER_TURN: Bound = Bound::new("per_turn", 1e-3, 1e15, "must be from 1e-3 to 1e15");
/// A motion, a speed or a duration between two messages [m, rad, m/s, rad/s, s].
pub const MOTION: Bound = Bound::new("motion", -1e5, 1e5, "must be within 1e5");
/// Bearing of the first beam, and of the last [rad].
pub const ANGLE_MIN: Bound = Bound::new("angle_min", -100.0, 100.0, "must be within 100 rad");
/// Size of the step from beam to beam [rad].
pub const ANGLE_STEP: Bound = Bound::new("angle_step", 1e-7, 6.3, "must be from 1e-7 to 6.3 rad");
/// Time from beam to beam [s]; negative where they are numbered against their order of time.
pub const TIME_INCREMENT: Bound = Bound::new("time_increment", -10.0, 10.0, "must be within 10 s");
/// A limit of range [m].
pub const RANGE: Bound = Bound::new("range", 0.0, 1e4, "must be from 0 to 1e4 m");
/// Beams of a sweep.
pub const BEAMS: Bound = Bound::new("beams", 1.0, 1e5, "must be from 1 to 100 000");
/// A standard deviation of a position [m].
pub const SIGMA: Bound = Bound::new("sigma", 1e-9, 1e4, "must be from 1e-9 to 1e4 m");
/// An entry of an information matrix [1/m^2, 1/rad^2].
pub const INFORMATION: Bound = Bound::new("information", -1e18, 1e18, "must be within 1e18");
/// Number of a vertex or an image.
pub const IDENTITY: Bound = Bound::new("identity", 0.0, 9e15, "must be from 0 to 9e15");
/// Edge of a cell [m].
pub const RESOLUTION: Bound = Bound::new("resolution", 1e-4, 1e3, "must be from 1e-4 to 1e3 m");
/// Cells of a grid.
pub const CELLS: Bound = Bound::new("cells", 0.0, 1e9, "must be at most 1e9");
/// A variance or covariance of a position or a heading [m^2, rad^2].
pub const VARIANCE: Bound = Bound::new("variance", -1e14, 1e14, "must be within 1e14");
/// A focal length, centre or corner of an image [pixel].
pub const PIXEL: Bound = Bound::new("pixel", -1e6, 1e6, "must be within 1e6 pixels");
/// A focal length [pixel].
pub const FOCAL: Bound = Bound::new("focal", 1e-2, 1e6, "must be from 0.01 to 1e6 pixels");
/// Columns or rows of an image [pixel].
pub const IMAGE_SIDE: Bound = Bound::new("image_side", 1.0, 32_767.0, "must be from 1 to 32 767 pixels");
/// A coefficient of a lens.
pub const LENS: Bound = Bound::new("lens", -1e4, 1e4, "must be within 1e4");
/// A length on a target [m].
pub const LENGTH: Bound = Bound::new("length", 1e-5, 1e3, "must be from 1e-5 to 1e3 m");

/// All bounds, for those who check numbers before they reach the core.
pub const ALL: [Bound; 22] = [
    STAMP,
    COORDINATE,
    ANGLE,
    ANGLE_MIN,
    ANGLE_STEP,
    TIME_INCREMENT,
    RANGE,
    BEAMS,
    SIGMA,
    INFORMATION,
    IDENTITY,
    RESOLUTION,
    CELLS,
    VARIANCE,
    PIXEL,
    FOCAL,
    IMAGE_SIDE,
    LENS,
    LENGTH,
    JOINT,
    PER_TURN,
    MOTION,
];

impl Bound {
    /// A bound: its name, its ends, and both in words.
    #[must_use]
    pub const fn new(name: &'static str, low: f64, high: f64, rule: &'static str) -> Self {
        Self { name, low, high, rule }
    }

    /// Whether a value is inside.
    #[must_use]
    pub fn holds(&self, value: f64) -> bool {
        value >= self.low && value <= self.high
    }

    /// Refuses a value outside.
    ///
    /// # Errors
    /// [`ModelError::Setting`], which names the field and the value.
    pub fn check(&self, field: &'static str, value: f64) -> Result<(), ModelError> {
        if self.holds(value) { Ok(()) } else { Err(ModelError::Setting { name: field, value, rule: self.rule }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_bound_holds_what_is_not_finite() {
        for bound in ALL {
            assert!([f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300].iter().all(|&v| !bound.holds(v)));
            assert!(bound.holds(bound.low) && bound.holds(bound.high) && bound.low < bound.high, "{}", bound.name);
        }
    }
}

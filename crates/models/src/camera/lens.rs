//! The lens models and what they have in common.
//!
//! A lens takes a point to a distorted direction m in the plane z = 1. All radial-tangential models are one formula with
//! some coefficients held at zero (`brown.rs`); the fisheye model is in `equidistant.rs`.
//!
//! | lens | parameters after fx fy cx cy | OpenCV, ROS | Kalibr |
//! |---|---|---|---|
//! | pinhole | | plumb_bob, zeros | pinhole-none |
//! | radtan | k1 k2 p1 p2 | plumb_bob, k3 = 0 | pinhole-radtan |
//! | plumb_bob | k1 k2 p1 p2 k3 | plumb_bob | |
//! | rational | k1 k2 p1 p2 k3 k4 k5 k6 | rational_polynomial | |
//! | equidistant | k1 k2 k3 k4 | fisheye, equidistant | pinhole-equi |

use super::distortion::{Coefficients, Distorted};
use super::{brown, equidistant};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A lens model.
#[derive(Clone, Copy, Debug, Deserialize, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Lens {
    /// No distortion.
    Pinhole,
    /// Radial of order 4 with tangential: Kalibr's `radtan`.
    Radtan,
    /// Radial of order 6 with tangential: five coefficients, OpenCV's default.
    PlumbBob,
    /// Rational: a quotient of polynomials of order 6, with tangential.
    Rational,
    /// Fisheye, Kannala and Brandt: the image radius is a polynomial of the angle.
    Equidistant,
}

const NAMES: [&str; 12] = ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"];
const EQUIDISTANT_NAMES: [&str; 8] = ["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"];

impl Lens {
    /// All lens models.
    pub const ALL: [Self; 5] = [Self::Pinhole, Self::Radtan, Self::PlumbBob, Self::Rational, Self::Equidistant];

    /// Its name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Radtan => "radtan",
            Self::PlumbBob => "plumb_bob",
            Self::Rational => "rational",
            Self::Equidistant => "equidistant",
        }
    }

    /// Names of the parameters of a camera with this lens, in order.
    #[must_use]
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Pinhole => &NAMES[..4],
            Self::Radtan => &NAMES[..8],
            Self::PlumbBob => &NAMES[..9],
            Self::Rational => &NAMES,
            Self::Equidistant => &EQUIDISTANT_NAMES,
        }
    }

    /// The coefficients, padded.
    pub(super) fn coefficients(self, given: &[f64]) -> Coefficients {
        let mut padded = [0.0; 8];
        padded.iter_mut().zip(given).for_each(|(k, value)| *k = *value);
        padded
    }

    /// Up to where the image radius grows with the angle: a radius in the plane z = 1, or an angle [rad].
    pub(super) fn limit(self, k: &Coefficients) -> f64 {
        if self == Self::Equidistant { equidistant::limit(k) } else { brown::limit(k) }
    }

    pub(super) fn distort(self, k: &Coefficients, limit: f64, point: &Vector3<f64>) -> Option<Distorted> {
        if self == Self::Equidistant { equidistant::distort(k, limit, point) } else { brown::distort(k, limit, point) }
    }

    pub(super) fn undistort(self, k: &Coefficients, limit: f64, m: &Vector2<f64>) -> Option<Vector3<f64>> {
        if self == Self::Equidistant { equidistant::undistort(k, limit, m) } else { brown::undistort(k, limit, m) }
    }
}

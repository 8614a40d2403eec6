//! A landmark as one beam of a scan saw it.

use groma_models::LandmarkKind;
use groma_models::bounds::{ANGLE, RANGE, STAMP, VARIANCE};
use nalgebra::{Matrix2, Vector2};

/// A corner or reflector in polar coordinates of the laser.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// When its beam was fired [s].
    pub stamp: f64,
    /// Range [m] and bearing [rad].
    pub polar: Vector2<f64>,
    /// Covariance of range and bearing.
    pub covariance: Matrix2<f64>,
    /// What it is.
    pub kind: LandmarkKind,
    /// Direction into which the corner opens, in the laser frame [rad].
    pub orientation: Option<f64>,
    /// Binary cells around it, turned by the orientation.
    pub descriptor: Option<u128>,
    /// Which landmark of the static map it is, where that is known (a coded mark).
    pub identity: Option<usize>,
}

impl Observation {
    /// The sighting of a corner at a point of the laser frame with its covariance [m^2].
    #[must_use]
    pub fn at_point(stamp: f64, point: Vector2<f64>, covariance: Matrix2<f64>) -> Self {
        let range = point.norm();
        let sq = range * range;
        let by_point = Matrix2::new(point.x / range, point.y / range, -point.y / sq, point.x / sq);
        Self {
            stamp,
            polar: Vector2::new(range, point.y.atan2(point.x)),
            covariance: by_point * covariance * by_point.transpose(),
            kind: LandmarkKind::Corner,
            orientation: None,
            descriptor: None,
            identity: None,
        }
    }

    /// Whether every number is within the bounds of [`groma_models::bounds`], the range above zero and the covariance positive definite.
    #[must_use]
    pub fn is_usable(&self) -> bool {
        let (r, c) = (self.polar.x, &self.covariance);
        let sane = STAMP.holds(self.stamp) && RANGE.holds(r) && ANGLE.holds(self.polar.y);
        let known = c.iter().all(|v| VARIANCE.holds(*v));
        let asymmetry = (c.m12 - c.m21).abs();
        sane && known && r > 0.0 && c.m11 > 0.0 && c.determinant() > 0.0 && asymmetry <= 1e-9 * (c.m11 * c.m22).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_keeps_its_ellipse() {
        let c = Matrix2::new(4e-4, 1e-4, 1e-4, 2e-4);
        let o = Observation::at_point(0.0, Vector2::new(3.0, 4.0), c);
        let radial = Vector2::new(0.6, 0.8);
        let across = Vector2::new(-0.8, 0.6);
        assert!((o.polar.x - 5.0).abs() < 1e-15 && (o.covariance.m11 - radial.dot(&(c * radial))).abs() < 1e-18);
        assert!((o.covariance.m22 - across.dot(&(c * across)) / 25.0).abs() < 1e-18);
        assert!(o.is_usable());
    }

    #[test]
    fn says_what_cannot_be_used() {
        let good = Observation::at_point(0.0, Vector2::new(3.0, 4.0), Matrix2::identity());
        let bad = [
            Observation { polar: Vector2::new(0.0, 1.0), ..good },
            Observation { polar: Vector2::new(f64::INFINITY, 1.0), ..good },
            Observation { covariance: Matrix2::zeros(), ..good },
            Observation { covariance: Matrix2::new(1.0, 2.0, 2.0, 1.0), ..good },
            Observation { covariance: Matrix2::new(1.0, 0.5, 0.0, 1.0), ..good },
            Observation { stamp: f64::NAN, ..good },
        ];
        assert!(bad.iter().all(|o| !o.is_usable()));
    }
}

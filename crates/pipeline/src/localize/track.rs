//! What the filter said after each scan.

use groma_geometry::Se2;
use groma_localization::{Localizer, Quality, Status, Update};
use nalgebra::Matrix3;

/// The vehicle after a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Fix {
    /// When it was there: at the end of the scan, or at the last motion where that came before the scan [s].
    pub stamp: f64,
    /// `T_map_base`.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
    /// The quality of the pose.
    pub quality: Quality,
    /// Landmarks that constrained the pose: places in the map, and numbers beyond for those found during the drive.
    pub paired: Vec<usize>,
    /// Driven since the fix before [m].
    pub distance: f64,
    /// Turned since the fix before, in either direction [rad].
    pub turn: f64,
    /// For how long the motion to here was extrapolated when the scan came [s].
    pub extrapolated: f64,
    /// Whether motions that came later moved this pose by more than a tenth of its standard deviation.
    pub corrected: bool,
}

/// Distance [m] and turn [rad], both summed without sign.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Travel {
    pub distance: f64,
    pub turn: f64,
}

impl Travel {
    pub fn add(&mut self, motion: &Se2) {
        self.distance += motion.translation.norm();
        self.turn += motion.theta().abs();
    }
}

impl Fix {
    pub(super) fn new(localizer: &Localizer, update: &Update, travel: Travel) -> Self {
        Self {
            stamp: localizer.stamp(),
            pose: localizer.pose(),
            covariance: localizer.covariance(),
            quality: localizer.quality(),
            paired: update.matches.iter().filter(|m| m.holds).map(|m| m.landmark).collect(),
            distance: travel.distance,
            turn: travel.turn,
            extrapolated: 0.0,
            corrected: false,
        }
    }

    /// Whether another pose for the same scan is farther away than a share of the standard deviation of this one.
    pub(super) fn is_off(&self, other: &Self, share: f64) -> bool {
        let d = other.pose.minus(&self.pose);
        let information = self.covariance.try_inverse();
        information.map_or(d.norm() > 0.0, |information| d.dot(&(information * d)) > share * share)
    }

    /// Whether the pose was known.
    #[must_use]
    pub fn is_known(&self) -> bool {
        self.quality.status != Status::Lost
    }
}

#[cfg(test)]
pub(super) mod test_track {
    use super::*;

    fn fix(distance: f64) -> Fix {
        let quality = Quality {
            status: Status::Tracking,
            observed: 10,
            matched: 5,
            nis: 9.0,
            dof: 10,
            sigma_position: 0.01,
            geometry: 0.02,
            ..Quality::default()
        };
        let (covariance, paired) = (Matrix3::identity() * 1e-4, vec![0, 2]);
        let (stamp, pose, turn, extrapolated) = (0.0, Se2::IDENTITY, 0.0, 0.0);
        Fix { stamp, pose, covariance, quality, paired, distance, turn, extrapolated, corrected: false }
    }

    /// Fixes of a drive of so many seconds, ten a second, well constrained.
    pub fn moving(seconds: f64) -> Vec<Fix> {
        vec![fix(0.05); (10.0 * seconds) as usize]
    }

    /// The same of a vehicle that stands.
    pub fn standing(seconds: f64) -> Vec<Fix> {
        vec![fix(0.0); (10.0 * seconds) as usize]
    }

    /// Stamps so many seconds apart, and the way ahead.
    pub fn timed(mut track: Vec<Fix>, period: f64) -> Vec<Fix> {
        let mut x = 0.0;
        for (k, fix) in track.iter_mut().enumerate() {
            x += fix.distance;
            (fix.stamp, fix.pose) = (100.0 + period * k as f64, Se2::new(x, 1.0, 0.0));
        }
        track
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_go_there_and_back_is_twice_as_far() {
        let mut travel = Travel::default();
        [Se2::new(0.3, 0.4, 0.2), Se2::new(-0.5, 0.0, -0.2)].iter().for_each(|motion| travel.add(motion));
        assert!((travel.distance - 1.0).abs() < 1e-12 && (travel.turn - 0.4).abs() < 1e-12);
    }
}

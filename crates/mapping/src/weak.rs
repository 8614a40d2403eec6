//! Where the map is poorly held, and why, in words.
//!
//! A keyframe is weak when its registration left a direction of the position with a standard deviation beyond
//! `WEAK`, when little of the scan was found on the map, or when scan and odometry contradicted each other and the scan
//! was not found whole. Weak keyframes that
//! follow each other within `JOIN` seconds are one stretch.

use crate::keyframe::Keyframe;
use groma_geometry::Se2;
use groma_tracking::Tracked;
use nalgebra::Vector2;

/// Standard deviation along the weakest direction from which a keyframe counts as weak [m].
const WEAK: f64 = 0.1;
/// Share of the scan found on the map below which a keyframe counts as weak.
const LOST: f64 = 0.35;
/// Share below which a scan that contradicts the odometry is doubted; a scan found whole overrules the wheels.
const DOUBTED: f64 = 0.6;
/// Weak keyframes closer in time than this are one stretch [s].
const JOIN: f64 = 5.0;

/// Why a stretch is weak.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// Scan and odometry contradict each other.
    Contradiction,
    /// Little of the scan was found on the map, and no odometry bridges the gap: the map may be torn.
    Torn,
    /// Little of the scan was found on the map.
    Lost,
    /// No surface constrains the weak direction.
    Slides,
}

impl Reason {
    /// In words.
    #[must_use]
    pub fn told(self) -> &'static str {
        match self {
            Self::Contradiction => "odometry and scans contradict each other",
            Self::Torn => "the scan was not found on the map and no odometry bridges the gap",
            Self::Lost => "little of the scan was found on the map",
            Self::Slides => "no surface constrains this direction: a corridor without ends, or an open space",
        }
    }
}

/// A stretch of the drive where the map is poorly held.
#[derive(Clone, Debug)]
pub struct WeakSpot {
    /// First and last stamp [s].
    pub stamps: (f64, f64),
    /// Where it is weakest, in the map frame [m].
    pub position: Vector2<f64>,
    /// Standard deviation along the weakest direction there [m].
    pub sigma: f64,
    /// That direction in the map frame [rad].
    pub direction: f64,
    /// Why.
    pub reason: Reason,
}

/// The weak stretches, in order of time; `poses` are those of the keyframes.
#[must_use]
pub fn weak_spots(keyframes: &[Keyframe], poses: &[Se2]) -> Vec<WeakSpot> {
    let mut spots: Vec<WeakSpot> = Vec::new();
    for (k, pose) in keyframes.iter().map(|k| &k.tracked).zip(poses) {
        let Some(reason) = reason(k) else { continue };
        let (sigma, direction) = (k.weakest.0, pose.theta() + k.weakest.1);
        let here = WeakSpot { stamps: (k.stamp, k.stamp), position: pose.translation, sigma, direction, reason };
        match spots.last_mut() {
            Some(last) if k.stamp - last.stamps.1 < JOIN && last.reason == reason => {
                last.stamps.1 = k.stamp;
                if sigma > last.sigma {
                    *last = WeakSpot { stamps: last.stamps, ..here };
                }
            }
            _ => spots.push(here),
        }
    }
    spots
}

fn reason(k: &Tracked) -> Option<Reason> {
    if k.torn {
        Some(Reason::Torn)
    } else if k.share < LOST {
        Some(Reason::Lost)
    } else if k.surprised && k.share < DOUBTED {
        Some(Reason::Contradiction)
    } else if k.weakest.0 > WEAK {
        Some(Reason::Slides)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_keyframe::{room, tracked};

    /// A keyframe that is held well.
    fn held(stamp: f64) -> Tracked {
        Tracked { weakest: (0.02, 0.3), share: 0.9, ..tracked(&room(stamp, [2.0; 4])) }
    }

    fn slides(stamp: f64, sigma: f64) -> Tracked {
        Tracked { weakest: (sigma, 0.3), ..held(stamp) }
    }

    /// Keyframe k is at (k, 2), turned by half a radian.
    fn spots(tracked: &[Tracked]) -> Vec<WeakSpot> {
        let keyframes: Vec<Keyframe> = tracked.iter().cloned().map(Keyframe::from).collect();
        let poses: Vec<Se2> = (0..keyframes.len()).map(|k| Se2::new(k as f64, 2.0, 0.5)).collect();
        weak_spots(&keyframes, &poses)
    }

    #[test]
    fn each_reason_is_reported_what_matters_most_first() {
        let reasons = |change: fn(&mut Tracked)| {
            let mut keyframe = held(1.0);
            change(&mut keyframe);
            spots(&[keyframe]).iter().map(|spot| spot.reason).collect::<Vec<_>>()
        };
        assert_eq!(reasons(|_| ()), []);
        assert_eq!(reasons(|k| k.weakest.0 = 0.2), [Reason::Slides]);
        assert_eq!(reasons(|k| (k.share, k.weakest.0) = (0.2, 0.2)), [Reason::Lost]);
        assert_eq!(reasons(|k| (k.share, k.torn) = (0.2, true)), [Reason::Torn]);
        assert_eq!(reasons(|k| (k.share, k.surprised) = (0.5, true)), [Reason::Contradiction]);
        assert_eq!(reasons(|k| k.surprised = true), [], "a scan found whole overrules the wheels");
        assert_eq!(reasons(|k| k.share = 0.5), [], "half of it is enough where nothing contradicts");
    }

    #[test]
    fn a_stretch_lasts_from_its_first_to_its_last_keyframe_and_lies_where_it_is_weakest() {
        let all = [held(9.0), slides(10.0, 0.2), slides(12.0, 0.4), slides(14.0, 0.3), held(15.0)];
        let [spot] = &spots(&all)[..] else { panic!("one stretch") };
        assert_eq!((spot.stamps, spot.sigma, spot.position), ((10.0, 14.0), 0.4, Vector2::new(2.0, 2.0)));
        assert!((spot.direction - 0.8).abs() < 1e-12, "in the map frame");
    }

    #[test]
    fn what_lies_far_apart_or_has_another_reason_is_a_stretch_of_its_own() {
        let found = spots(&[slides(10.0, 0.2), slides(40.0, 0.2), Tracked { share: 0.1, ..held(41.0) }]);
        let told: Vec<_> = found.iter().map(|spot| (spot.stamps, spot.reason)).collect();
        assert_eq!(
            told,
            [((10.0, 10.0), Reason::Slides), ((40.0, 40.0), Reason::Slides), ((41.0, 41.0), Reason::Lost)]
        );
    }
}

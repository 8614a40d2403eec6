//! Where the map is poorly held, and why, in words.
//!
//! A keyframe is weak when its registration left a direction of the position with a standard deviation beyond
//! `WEAK`, when little of the scan was found on the map, or when scan and odometry contradicted each other and the scan
//! was not found whole. Weak keyframes that
//! follow each other within `JOIN` seconds are one stretch.

use crate::keyframe::Keyframe;
use groma_geometry::Se2;
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
    /// Nothing stands across the weak direction.
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
            Self::Slides => "nothing stands across this direction: a corridor without ends, or an open space",
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
    for (k, pose) in keyframes.iter().zip(poses) {
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

fn reason(k: &Keyframe) -> Option<Reason> {
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

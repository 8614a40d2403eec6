//! Where and how the laser was at a station, and the motion from one station to the next.

use crate::average::averaged;
use groma_geometry::{Se2, wrap};
use groma_models::LaserScan;
use groma_registration::{Contour, Mutual, align_mutually};
use nalgebra::{Matrix3, Vector3};

/// Share of two scans that must be common.
const LEAST_SHARE: f64 = 0.3;
/// Pieces of wall that must be common.
const LEAST_PATCHES: usize = 6;
/// A registration farther than this from the tracked motion found another minimum [m], [rad].
const FAR: (f64, f64) = (0.3, 0.1);

/// When the pose of the laser is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Station {
    /// Begin of the standstill, or the moment [s].
    pub from: f64,
    /// End of the standstill; equal to `from` for a moment of the drive [s].
    pub to: f64,
}

impl Station {
    /// Whether the vehicle stands.
    #[must_use]
    pub fn is_standstill(&self) -> bool {
        self.to > self.from
    }
}

/// What was seen at a station.
#[derive(Clone, Debug)]
pub struct Sight {
    /// Time that its pose belongs to: the middle of a standstill, or of a sweep [s].
    pub stamp: f64,
    /// Its scans: all of a standstill, else one.
    pub scans: Vec<LaserScan>,
    /// Tracked pose at that time.
    pub pose: Se2,
    /// Tracked heading, turns counted [rad].
    pub heading: f64,
    /// Twist of the laser during the sweep (own frame, per second).
    pub twist: Vector3<f64>,
}

/// What became of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It counts.
    Good,
    /// No scan was taken at one of its ends.
    Unseen,
    /// Its ends have too little in view in common.
    Apart,
    /// One direction of the position is unconstrained: a corridor, an open space.
    Open,
    /// Registration did not settle, or settled away from what was tracked.
    Astray,
}

/// How the laser moved from one station to the next.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Time at the first station [s].
    pub start: f64,
    /// Time at the second [s].
    pub end: f64,
    /// x, y [m] and the whole turn [rad] of the second seen from the first.
    pub motion: Vector3<f64>,
    /// Covariance of `T * exp(xi)`.
    pub covariance: Matrix3<f64>,
    /// Share of the points of both scans that fit.
    pub share: f64,
    /// Spread of the residuals [m].
    pub scale: f64,
    /// What became of it.
    pub verdict: Verdict,
}

impl Sight {
    /// The contour of what was seen.
    #[must_use]
    pub fn contour(&self) -> Contour {
        averaged(&self.scans).map_or_else(Contour::default, |scan| Contour::new(&scan, self.twist))
    }
}

/// The motion between two sights, measured by registering one to the other.
#[must_use]
pub fn motion(first: (&Sight, &Contour), second: (&Sight, &Contour)) -> Motion {
    let tracked = first.0.pose.between(&second.0.pose);
    let found = align_mutually(first.1, second.1, tracked);
    let turn = second.0.heading - first.0.heading;
    let whole = turn + wrap(found.pose.theta() - turn);
    Motion {
        start: first.0.stamp,
        end: second.0.stamp,
        motion: Vector3::new(found.pose.x(), found.pose.y(), whole),
        covariance: found.covariance,
        share: found.share,
        scale: found.scale,
        verdict: judge(&found, &tracked),
    }
}

fn judge(found: &Mutual, tracked: &Se2) -> Verdict {
    let apart = tracked.between(&found.pose);
    if found.share < LEAST_SHARE || found.patches < LEAST_PATCHES {
        Verdict::Apart
    } else if found.open {
        Verdict::Open
    } else if !found.converged || apart.translation.norm() > FAR.0 || apart.theta().abs() > FAR.1 {
        Verdict::Astray
    } else {
        Verdict::Good
    }
}

/// A motion of which one end was not seen.
#[must_use]
pub fn unseen(first: &Station, second: &Station) -> Motion {
    Motion {
        start: first.from,
        end: second.from,
        motion: Vector3::zeros(),
        covariance: Matrix3::identity(),
        share: 0.0,
        scale: 0.0,
        verdict: Verdict::Unseen,
    }
}

//! Scans of a rectangular room and keyframes of them, for the unit tests.

use crate::keyframe::Keyframe;
use groma_geometry::Se2;
use groma_models::{BeamGeometry, LaserScan};
use groma_registration::PolarView;
use nalgebra::{Matrix3, Vector3};

/// A scan all around, one beam every 0.02 rad: distances to the walls ahead, behind, to the left and to the right [m].
pub fn room(stamp: f64, [ahead, behind, left, right]: [f64; 4]) -> LaserScan {
    let geometry =
        BeamGeometry { angle_min: -3.1, angle_increment: 0.02, time_increment: 0.0, range_min: 0.1, range_max: 30.0 };
    let range = |i: usize| {
        let (sin, cos) = geometry.bearing(i).sin_cos();
        (if cos > 0.0 { ahead } else { -behind } / cos).min(if sin > 0.0 { left } else { -right } / sin)
    };
    LaserScan { stamp, geometry, ranges: (0..310).map(range).collect(), intensities: vec![] }
}

/// A keyframe at the origin that is held without a doubt.
pub fn keyframe(scan: &LaserScan) -> Keyframe {
    Keyframe {
        stamp: scan.stamp,
        tracked: Se2::IDENTITY,
        view: PolarView::new(scan, &Se2::IDENTITY, Vector3::zeros()),
        corners: vec![],
        reflectors: vec![],
        step: Matrix3::zeros(),
        weakest: (0.0, 0.0),
        share: 1.0,
        surprised: false,
        torn: false,
    }
}

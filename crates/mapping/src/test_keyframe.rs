//! Scans of a rectangular room and what the tracker makes of them, for the unit tests.

use groma_geometry::Se2;
use groma_models::{BeamGeometry, LaserScan};
use groma_registration::PolarView;
use groma_tracking::Tracked;
use nalgebra::Vector3;

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

/// The scan at the origin, without a doubt.
pub fn tracked(scan: &LaserScan) -> Tracked {
    Tracked::at(scan.stamp, Se2::IDENTITY, PolarView::new(scan, &Se2::IDENTITY, Vector3::zeros()))
}

//! A rectangular room, scanned from anywhere, for the tests of the maps.

use groma_features::Keypoint;
use groma_geometry::Se2;
use groma_mapping::keyframe::Keyframe;
use groma_models::{BeamGeometry, LaserScan};
use groma_registration::PolarView;
use groma_tracking::Tracked;
use nalgebra::{Vector2, Vector3};
use std::f64::consts::{PI, TAU};

/// Half the inner length and width of the room [m]: walls off the lines of a grid.
pub const HALF: (f64, f64) = (5.02, 3.02);
/// The laser on the vehicle.
pub const MOUNT: Se2 =
    Se2 { rotation: groma_geometry::So2 { cos: 0.0, sin: 1.0 }, translation: Vector2::new(0.2, 0.1) };

/// A round obstacle: centre and radius [m].
pub type Disc = (Vector2<f64>, f64);

/// All beams of a scanner that looks all round, one every half degree.
pub fn geometry() -> BeamGeometry {
    BeamGeometry { angle_min: -PI, angle_increment: TAU / 720.0, time_increment: 0.0, range_min: 0.05, range_max: 80.0 }
}

/// Distance from `from` along the unit vector `d` to the wall or the first disc.
pub fn cast(from: Vector2<f64>, d: Vector2<f64>, discs: &[Disc]) -> f64 {
    let wall = |p: f64, v: f64, half: f64| if v == 0.0 { f64::INFINITY } else { (half * v.signum() - p) / v };
    let mut range = wall(from.x, d.x, HALF.0).min(wall(from.y, d.y, HALF.1));
    for (center, radius) in discs {
        let to = center - from;
        let (along, aside) = (to.dot(&d), to.perp(&d).abs());
        if along > 0.0 && aside < *radius {
            range = range.min(along - (radius * radius - aside * aside).sqrt());
        }
    }
    range
}

/// What the laser of a vehicle at `pose` reads, each range disturbed by `noise()` [m].
pub fn scan(pose: &Se2, discs: &[Disc], mut noise: impl FnMut() -> f64) -> LaserScan {
    let (laser, geometry) = (*pose * MOUNT, geometry());
    let read = |i: usize| {
        let d = laser.rotation.act(Vector2::new(geometry.bearing(i).cos(), geometry.bearing(i).sin()));
        cast(laser.translation, d, discs) + noise()
    };
    LaserScan { stamp: 0.0, geometry, ranges: (0..720).map(read).collect(), intensities: vec![] }
}

/// A keyframe of a scan and of corners.
pub fn keyframe(scan: &LaserScan, corners: Vec<Keypoint>) -> Keyframe {
    let view = PolarView::new(scan, &MOUNT, Vector3::zeros());
    Keyframe { corners, ..Keyframe::from(Tracked::at(scan.stamp, Se2::IDENTITY, view)) }
}

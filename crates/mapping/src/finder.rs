//! Finds the corners and reflectors of a scan and puts them into the vehicle frame of its stamp.
//!
//! A mark found at beam i counts as seen from where the laser was when that beam was fired.

use crate::corners::Corners;
use crate::keyframe::Keyframe;
use crate::options::Options;
use groma_features::reflector::{self, Reflector};
use groma_models::LaserScan;
use groma_registration::PolarView;
use groma_tracking::Tracked;

/// The detectors, with the tables for the scanner that was seen last.
#[derive(Clone)]
pub struct Finder {
    corners: Corners,
    reflectors: reflector::Options,
}

impl Finder {
    /// With the settings of mapping.
    #[must_use]
    pub fn new(options: &Options) -> Self {
        Self { corners: Corners::new(options.corners), reflectors: options.reflectors }
    }

    /// The keyframe of a scan that was tracked, with the marks in it.
    pub fn find(&mut self, scan: &LaserScan, tracked: Tracked) -> Keyframe {
        let corners = self.corners.find(scan, &tracked.view);
        let found = reflector::detect(&scan.ranges, &scan.intensities, &scan.geometry, &self.reflectors);
        let reflectors = found.iter().map(|mark| in_vehicle(mark, &tracked.view)).collect();
        Keyframe { tracked, corners, reflectors }
    }
}

fn in_vehicle(mark: &Reflector, view: &PolarView) -> Reflector {
    let laser = view.laser_at(mark.index);
    let r = laser.rotation.matrix();
    Reflector { point: laser.act(mark.point), covariance: r * mark.covariance * r.transpose(), ..*mark }
}

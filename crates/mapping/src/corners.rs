//! Corners of keyframes, in the vehicle frame at the stamp of the scan.

use groma_features::Keypoint;
use groma_features::falko::{Detector, Options};
use groma_geometry::wrap;
use groma_models::{BeamGeometry, LaserScan};
use groma_registration::PolarView;

/// Finds the corners of scans; what the detector keeps for a scanner lasts while the scanner stays the same.
#[derive(Clone)]
pub(crate) struct Corners {
    options: Options,
    detector: Option<(BeamGeometry, usize, Detector)>,
}

impl Corners {
    pub fn new(options: Options) -> Self {
        Self { options, detector: None }
    }

    /// The corners of a scan, moved from where the laser was when it saw them.
    pub fn find(&mut self, scan: &LaserScan, view: &PolarView) -> Vec<Keypoint> {
        let beams = scan.ranges.len();
        let mut corners = Vec::new();
        let (_, _, detector) = match self.detector.take() {
            Some(kept) if kept.0 == scan.geometry && kept.1 == beams => self.detector.insert(kept),
            _ => self.detector.insert((scan.geometry, beams, Detector::new(scan.geometry, beams, self.options))),
        };
        detector.detect(&scan.ranges, &mut corners);
        corners.iter_mut().for_each(|corner| *corner = in_vehicle_frame(corner, view));
        corners
    }
}

fn in_vehicle_frame(corner: &Keypoint, view: &PolarView) -> Keypoint {
    let laser = view.laser_at(corner.index);
    let r = laser.rotation.matrix();
    Keypoint {
        point: laser.act(corner.point),
        orientation: wrap(corner.orientation + laser.theta()),
        covariance: r * corner.covariance * r.transpose(),
        ..*corner
    }
}

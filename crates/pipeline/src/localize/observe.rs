//! The corners and reflectors of a scan as observations for the localizer, each at the time of its beam.

use groma_features::bsc::Bsc;
use groma_features::marks::Detector;
use groma_localization::Observation;
use groma_models::{LandmarkKind, LaserScan};

/// Observes scans; what it keeps for a scanner lasts while the scanner stays the same.
#[derive(Debug, Default)]
pub struct Observer(Detector);

impl Observer {
    /// Corners in beam order, then reflectors.
    pub fn observe(&mut self, scan: &LaserScan) -> Vec<Observation> {
        let marks = self.0.detect(scan);
        let corner = |(c, bsc): (&groma_features::Keypoint, &Bsc)| Observation {
            orientation: Some(c.orientation),
            descriptor: Some(u128::from_le_bytes(bsc.to_bytes())).filter(|cells| *cells != 0),
            ..Observation::at_point(scan.beam_stamp(c.index), c.point, c.covariance)
        };
        let reflector = |r: &groma_features::reflector::Reflector| Observation {
            kind: LandmarkKind::Reflector,
            ..Observation::at_point(scan.beam_stamp(r.index), r.point, r.covariance)
        };
        let corners = marks.corners.iter().zip(marks.descriptors).map(corner);
        corners.chain(marks.reflectors.iter().map(reflector)).collect()
    }
}

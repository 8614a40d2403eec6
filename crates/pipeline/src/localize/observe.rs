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

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;
    use nalgebra::Vector2;

    /// A laser that stands in a rectangular room, off its middle, and takes a tenth of a second to turn.
    fn room() -> LaserScan {
        let geometry = BeamGeometry {
            angle_min: -3.0,
            angle_increment: 0.005,
            time_increment: 0.1 / 1200.0,
            range_min: 0.1,
            range_max: 30.0,
        };
        let range = |i: usize| {
            let (sin, cos) = geometry.bearing(i).sin_cos();
            let (x, y) = (if cos > 0.0 { 4.0 } else { -2.0 }, if sin > 0.0 { 3.0 } else { -1.5 });
            (x / cos).min(y / sin)
        };
        LaserScan { stamp: 50.0, geometry, ranges: (0..1200).map(range).collect(), intensities: Vec::new() }
    }

    #[test]
    fn each_corner_is_of_the_time_of_its_beam_and_opens_into_the_room() {
        let scan = room();
        let seen = Observer::default().observe(&scan);
        assert!(seen.len() > 2, "{}", seen.len());
        for corner in seen {
            let (sin, cos) = corner.polar.y.sin_cos();
            let bearing = sin.atan2(cos);
            let fired = 50.0 + (bearing + 3.0) / 0.005 * scan.geometry.time_increment;
            assert!((corner.stamp - fired).abs() < 5e-4, "{} {fired}", corner.stamp);
            let angle = corner.orientation.unwrap();
            let inwards = -Vector2::new(cos.signum(), sin.signum()).normalize();
            assert!(Vector2::new(angle.cos(), angle.sin()).dot(&inwards) > 0.9, "{bearing} {angle}");
        }
    }
}

//! Whether a scan would show a landmark at a place.

use groma_models::BeamGeometry;
use nalgebra::Vector2;
use std::f64::consts::TAU;

/// A landmark this far behind a reading still belongs to the surface that was hit [m].
const MARGIN: f64 = 0.15;

/// Whether the beams at and beside the bearing of a place reach it: `polar` is range and bearing from the laser.
///
/// A beam without return says nothing: glass and black walls give none.
#[must_use]
pub fn sees(geometry: &BeamGeometry, ranges: &[f64], polar: Vector2<f64>) -> bool {
    let turns = (polar.y - geometry.angle_min) / geometry.angle_increment;
    let all_round = TAU / geometry.angle_increment.abs();
    let beam = turns.rem_euclid(all_round).round();
    let reaches = |k: f64| {
        let reading = ranges.get(k.rem_euclid(all_round).round() as usize);
        reading.is_some_and(|r| geometry.is_hit(*r) && *r >= polar.x - MARGIN)
    };
    beam.is_finite() && [beam - 1.0, beam, beam + 1.0].into_iter().all(reaches)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_landmark_behind_a_wall_is_not_in_view() {
        let geometry = BeamGeometry {
            angle_min: -1.0,
            angle_increment: 0.1,
            time_increment: 0.0,
            range_min: 0.1,
            range_max: 20.0,
        };
        let mut ranges = vec![10.0; 21];
        ranges[15] = f64::INFINITY;
        let at = |range: f64, bearing: f64| sees(&geometry, &ranges, Vector2::new(range, bearing));
        assert!(at(5.0, 0.0) && at(10.1, 0.02) && at(3.0, -TAU - 0.3));
        assert!(!at(10.3, 0.0) && !at(5.0, 0.5) && !at(5.0, 0.41) && !at(5.0, 1.5) && !at(f64::NAN, 0.0));
    }

    #[test]
    fn a_scan_all_round_has_no_seam() {
        let increment = TAU / 360.0;
        let geometry = BeamGeometry {
            angle_min: 0.0,
            angle_increment: increment,
            time_increment: 0.0,
            range_min: 0.1,
            range_max: 20.0,
        };
        let ranges = vec![10.0; 360];
        assert!([0.0, -0.001, TAU - 0.001].iter().all(|b| sees(&geometry, &ranges, Vector2::new(5.0, *b))));
    }
}

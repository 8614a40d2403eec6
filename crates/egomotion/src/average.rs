//! One scan out of many from a laser that stands still.
//!
//! Of the readings of a beam the mean of those near the median is taken, if at least half are echoes: a beam that grazes an
//! edge or meets a passer-by keeps to what it mostly saw. The noise of n readings falls with their root.

use groma_estimation::robust;
use groma_models::LaserScan;

/// Distance from the median within which readings are of the same surface [m].
const SAME_SURFACE: f64 = 0.08;

/// The average of scans of one geometry; `None` of none.
#[must_use]
pub fn averaged(scans: &[LaserScan]) -> Option<LaserScan> {
    let first = scans.first()?;
    let alike = || scans.iter().filter(|s| s.geometry == first.geometry && s.ranges.len() == first.ranges.len());
    let beams = (0..first.ranges.len()).map(|beam| {
        let mut hits: Vec<f64> = alike().map(|s| s.ranges[beam]).filter(|r| first.geometry.is_hit(*r)).collect();
        if 2 * hits.len() < alike().count() { f64::INFINITY } else { middle(&mut hits) }
    });
    let ranges = beams.collect();
    Some(LaserScan { stamp: first.stamp, geometry: first.geometry, ranges, intensities: vec![] })
}

fn middle(readings: &mut [f64]) -> f64 {
    let Some(median) = robust::median(readings) else { return f64::INFINITY };
    let near = readings.iter().filter(|r| (**r - median).abs() < SAME_SURFACE);
    let (sum, count) = near.fold((0.0, 0.0), |(sum, count), r| (sum + r, count + 1.0));
    sum / count
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;

    fn scan(ranges: &[f64]) -> LaserScan {
        let geometry =
            BeamGeometry { angle_min: 0.0, angle_increment: 0.1, time_increment: 0.0, range_min: 0.1, range_max: 9.0 };
        LaserScan { stamp: 0.0, geometry, ranges: ranges.to_vec(), intensities: vec![] }
    }

    #[test]
    fn a_passer_by_and_lost_echoes_do_not_count() {
        let scans = [[2.00, 5.0, 1.0], [2.02, f64::INFINITY, f64::INFINITY], [2.04, 3.0, f64::NAN], [2.02, 5.02, 99.0]];
        let average = averaged(&scans.map(|ranges| scan(&ranges))).unwrap();
        assert!((average.ranges[0] - 2.02).abs() < 1e-12);
        assert!((average.ranges[1] - 5.01).abs() < 1e-12);
        assert!(average.ranges[2].is_infinite());
    }

    #[test]
    fn a_scan_of_another_geometry_is_left_out() {
        assert!((averaged(&[scan(&[2.0]), scan(&[3.0, 3.0])]).unwrap().ranges[0] - 2.0).abs() < 1e-15);
        assert!(averaged(&[]).is_none());
    }
}

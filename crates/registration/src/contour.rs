//! A scan as points and the lines through their neighbourhoods, none thinned out: what precise registration starts from.
//!
//! The nearest point to a query, chosen among noisy ones, leans towards the query and hides part of its distance. The line
//! through the neighbourhood does not depend on which of the neighbours was chosen, so that distances to it are whole.

use crate::surface_scan::{Hits, Line};
use groma_geometry::Se2;
use groma_models::LaserScan;
use nalgebra::{Vector2, Vector3};

/// Width of the cells of the index [m]; no search reaches farther.
pub const REACH: f64 = 0.3;

/// The hits of a scan in the frame of the laser in the middle of its sweep.
///
/// There, and not at the first beam, an error of the twist shifts early and late beams to opposite sides.
#[derive(Clone, Debug, Default)]
pub struct Contour {
    /// Hits [m], in beam order.
    pub points: Vec<Vector2<f64>>,
    /// The line at each hit, where its neighbourhood is one.
    pub lines: Vec<Option<Line>>,
    /// Cells of the hits that have a line, in order, with the index of the hit.
    cells: Vec<((i32, i32), u32)>,
}

impl Contour {
    /// The contour of a scan from a laser that moves with `twist` (its own frame, per second) during the sweep; its time is
    /// [`middle`] seconds after the stamp.
    #[must_use]
    pub fn new(scan: &LaserScan, twist: Vector3<f64>) -> Self {
        let hits = Hits::new(scan, &Se2::IDENTITY, twist, middle(scan));
        let lines: Vec<Option<Line>> = (0..hits.points.len()).map(|i| hits.line(i)).collect();
        let lined = (0..hits.points.len()).filter(|&i| lines[i].is_some());
        let mut cells: Vec<_> = lined.map(|i| (cell(hits.points[i]), i as u32)).collect();
        cells.sort_unstable();
        Self { points: hits.points, lines, cells }
    }

    /// The line at the hit nearest to `p` within `radius` (at most [`REACH`]), if it faces the way that `normal` does.
    #[must_use]
    pub fn nearest(&self, p: Vector2<f64>, normal: Vector2<f64>, radius: f64, agreement: f64) -> Option<Line> {
        let (home, mut best) = (cell(p), (radius.min(REACH).powi(2), None));
        for x in home.0 - 1..=home.0 + 1 {
            let first = self.cells.partition_point(|&(c, _)| c < (x, home.1 - 1));
            for &((cx, cy), k) in &self.cells[first..] {
                if (cx, cy) > (x, home.1 + 1) {
                    break;
                }
                let sq = (self.points[k as usize] - p).norm_squared();
                let line = self.lines[k as usize];
                if sq < best.0 && line.is_some_and(|l| l.normal.dot(&normal) > agreement) {
                    best = (sq, line);
                }
            }
        }
        best.1
    }
}

/// Half the time of a sweep [s].
#[must_use]
pub fn middle(scan: &LaserScan) -> f64 {
    scan.geometry.time_increment * scan.ranges.len().saturating_sub(1) as f64 / 2.0
}

fn cell(p: Vector2<f64>) -> (i32, i32) {
    ((p.x / REACH).floor() as i32, (p.y / REACH).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;

    #[test]
    fn nearest_is_that_of_brute_force() {
        let step = 0.01;
        let geometry = BeamGeometry {
            angle_min: -2.0,
            angle_increment: step,
            time_increment: 0.0,
            range_min: 0.1,
            range_max: 30.0,
        };
        let ranges: Vec<f64> = (0..400).map(|i| 3.0 + (f64::from(i) * 0.05).sin() + f64::from(i / 150)).collect();
        let scan = LaserScan { stamp: 0.0, geometry, ranges, intensities: vec![] };
        let contour = Contour::new(&scan, Vector3::zeros());
        let mut found = 0;
        for k in 0..1000_u32 {
            let aside = Vector2::new(f64::from(k % 7) - 3.0, f64::from(k % 11) - 5.0) * 0.08;
            let p = contour.points[(k as usize * 37) % contour.points.len()] + aside;
            let normal = -p.normalize();
            let faces = |i: &usize| contour.lines[*i].is_some_and(|l| l.normal.dot(&normal) > 0.7);
            let distance = |i: usize| (contour.points[i] - p).norm();
            let brute = (0..contour.points.len()).filter(faces).map(distance).fold(f64::INFINITY, f64::min);
            let line = contour.nearest(p, normal, 0.25, 0.7);
            assert_eq!(line.is_some(), brute < 0.25, "at {p:?}");
            found += usize::from(line.is_some());
        }
        assert!((100..900).contains(&found), "{found}");
    }
}

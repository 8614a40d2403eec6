//! From readings to points with normals, in the vehicle frame at the stamp of the scan.
//!
//! **Deskew.** With the vehicle's twist `v` during the sweep, beam i was fired from `exp(v * i * time_increment)`.
//!
//! **Normals.** Around each hit, neighbours on the same surface (no gap larger than the spacing that a wall seen at a
//! flat angle gives) within `NORMAL_RADIUS`, but at least two a side where there are, give a total-least-squares line.
//! A normal is kept if the neighbourhood is a line: residual below `MAX_RESIDUAL` and thin against its length.
//! Normals point to the sensor. A hit without a normal is kept; it can be matched, but is no surface to match to.
//!
//! **Thinning.** Along a surface points closer than `SPACING` to the last one kept are left out, so that near walls
//! do not outweigh far ones.
//!
//! Assumes a static scene during the sweep and a constant twist.

use groma_geometry::Se2;
use groma_models::LaserScan;
use nalgebra::{Vector2, Vector3};

/// Radius of the neighbourhood of a normal where the beams are dense [m].
const NORMAL_RADIUS: f64 = 0.15;
/// Neighbours a side that are used even where the beams are sparse.
const LEAST_NEIGHBOURS: usize = 2;
/// Neighbours a side that are never exceeded.
const MOST_NEIGHBOURS: usize = 15;
/// Largest root-mean-square distance of the neighbourhood from its line [m].
const MAX_RESIDUAL: f64 = 0.03;
/// Largest ratio of the neighbourhood's thickness to its length.
const MAX_THINNESS: f64 = 0.25;
/// Distance between kept points along a surface [m].
const SPACING: f64 = 0.03;

/// The hits of one scan as surface points in the vehicle frame.
#[derive(Clone, Debug, Default)]
pub struct SurfaceScan {
    /// Hits [m], in beam order.
    pub points: Vec<Vector2<f64>>,
    /// Unit normals that point to the sensor; zero where the neighbourhood is no line.
    pub normals: Vec<Vector2<f64>>,
}

impl SurfaceScan {
    /// Points and normals of `scan`, for a laser mounted at `t_base_laser` on a vehicle that moves with `twist`
    /// (body frame, per second) during the sweep.
    #[must_use]
    pub fn new(scan: &LaserScan, t_base_laser: &Se2, twist: Vector3<f64>) -> Self {
        let hits = Hits::new(scan, t_base_laser, twist, 0.0);
        let mut out = Self::default();
        let mut last: Option<usize> = None;
        for i in 0..hits.points.len() {
            let near = last.is_some_and(|k| {
                hits.segment[k] == hits.segment[i]
                    && (hits.points[k] - hits.points[i]).norm_squared() < SPACING * SPACING
            });
            if near {
                continue;
            }
            last = Some(i);
            out.points.push(hits.points[i]);
            out.normals.push(hits.line(i).map_or_else(Vector2::zeros, |line| line.normal));
        }
        out
    }

    /// Whether point `i` has a normal.
    #[must_use]
    pub fn has_normal(&self, i: usize) -> bool {
        self.normals[i] != Vector2::zeros()
    }
}

/// The line through the neighbourhood of a hit.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The centre of the neighbourhood [m].
    pub through: Vector2<f64>,
    /// Unit normal that points to the sensor.
    pub normal: Vector2<f64>,
}

/// All hits of a scan, cut into segments at gaps.
pub(crate) struct Hits {
    pub(crate) points: Vec<Vector2<f64>>,
    origins: Vec<Vector2<f64>>,
    segment: Vec<u32>,
}

impl Hits {
    /// In the frame of the vehicle at `reference` seconds after the stamp.
    pub(crate) fn new(scan: &LaserScan, t_base_laser: &Se2, twist: Vector3<f64>, reference: f64) -> Self {
        let still = twist == Vector3::zeros() || scan.geometry.time_increment == 0.0;
        let step = scan.geometry.angle_increment.abs();
        let mut hits = Self { points: Vec::new(), origins: Vec::new(), segment: Vec::new() };
        let mut segment = 0;
        let mut last: Option<(usize, f64, Vector2<f64>)> = None;
        for (beam, p_laser) in scan.hits() {
            let t = if still {
                *t_base_laser
            } else {
                Se2::exp(twist * (beam as f64 * scan.geometry.time_increment - reference)) * *t_base_laser
            };
            let (p, range) = (t.act(p_laser), scan.ranges[beam]);
            if let Some((last_beam, last_range, last_p)) = last {
                let between = (beam - last_beam) as f64;
                let widest = (8.0 * range.min(last_range) * step * between).max(0.2);
                if between > 3.0 || (p - last_p).norm() > widest {
                    segment += 1;
                }
            }
            last = Some((beam, range, p));
            hits.points.push(p);
            hits.origins.push(t.translation);
            hits.segment.push(segment);
        }
        hits
    }

    /// The neighbours of hit `i` on its surface, as an index range.
    fn neighbourhood(&self, i: usize) -> (usize, usize) {
        let within = |k: usize, side: usize| {
            self.segment[k] == self.segment[i]
                && (side <= LEAST_NEIGHBOURS
                    || (self.points[k] - self.points[i]).norm_squared() < NORMAL_RADIUS * NORMAL_RADIUS)
        };
        let (mut first, mut last) = (i, i);
        while first > 0 && i - first < MOST_NEIGHBOURS && within(first - 1, i - first + 1) {
            first -= 1;
        }
        while last + 1 < self.points.len() && last - i < MOST_NEIGHBOURS && within(last + 1, last - i + 1) {
            last += 1;
        }
        (first, last)
    }

    /// The line at hit `i`, if its neighbourhood is one.
    pub(crate) fn line(&self, i: usize) -> Option<Line> {
        let (first, last) = self.neighbourhood(i);
        let n = (last - first + 1) as f64;
        if n < 3.0 {
            return None;
        }
        let around = &self.points[first..=last];
        let mean = around.iter().sum::<Vector2<f64>>() / n;
        let (mut sxx, mut sxy, mut syy) = (0.0, 0.0, 0.0);
        for p in around {
            let d = p - mean;
            sxx += d.x * d.x;
            sxy += d.x * d.y;
            syy += d.y * d.y;
        }
        let (half_sum, half_difference) = ((sxx + syy) / (2.0 * n), (sxx - syy) / (2.0 * n));
        let root = half_difference.hypot(sxy / n);
        let (long_sq, thin_sq) = (half_sum + root, (half_sum - root).max(0.0));
        if thin_sq > MAX_RESIDUAL * MAX_RESIDUAL || thin_sq > MAX_THINNESS * MAX_THINNESS * long_sq {
            return None;
        }
        let along = 0.5 * (sxy / n).atan2(half_difference);
        let normal = Vector2::new(-along.sin(), along.cos());
        let outward = normal.dot(&(self.origins[i] - self.points[i])) < 0.0;
        Some(Line { through: mean, normal: if outward { -normal } else { normal } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;
    use std::f64::consts::FRAC_PI_2;

    fn wall_scan(time_increment: f64) -> LaserScan {
        let geometry = BeamGeometry {
            angle_min: -FRAC_PI_2,
            angle_increment: FRAC_PI_2 / 90.0,
            time_increment,
            range_min: 0.05,
            range_max: 20.0,
        };
        let ranges = (0..181).map(|i| 2.0 / geometry.bearing(i).cos().max(1e-9)).collect();
        LaserScan { stamp: 0.0, geometry, ranges, intensities: vec![] }
    }

    #[test]
    fn a_wall_ahead_has_normals_that_look_back() {
        let scan = SurfaceScan::new(&wall_scan(0.0), &Se2::IDENTITY, Vector3::zeros());
        assert!(scan.points.len() > 100);
        for i in 0..scan.points.len() {
            assert!((scan.points[i].x - 2.0).abs() < 1e-9);
            assert!(!scan.has_normal(i) || (scan.normals[i] - Vector2::new(-1.0, 0.0)).norm() < 1e-6);
        }
    }

    #[test]
    fn the_mount_moves_the_points() {
        let mount = Se2::new(0.5, 0.0, FRAC_PI_2);
        let scan = SurfaceScan::new(&wall_scan(0.0), &mount, Vector3::zeros());
        assert!(scan.points.iter().all(|p| (p.y - 2.0).abs() < 1e-9));
    }

    #[test]
    fn deskew_straightens_a_wall_seen_while_driving() {
        // Driving at 1 m/s towards a wall 2 m ahead: beam i measures from x = t_i.
        let mut scan = wall_scan(1e-3);
        for i in 0..scan.ranges.len() {
            scan.ranges[i] = (2.0 - 1e-3 * i as f64) / scan.geometry.bearing(i).cos().max(1e-9);
        }
        let points = SurfaceScan::new(&scan, &Se2::IDENTITY, Vector3::new(1.0, 0.0, 0.0)).points;
        assert!(points.iter().all(|p| (p.x - 2.0).abs() < 1e-9));
    }

    #[test]
    fn an_empty_scan_gives_nothing() {
        let mut scan = wall_scan(0.0);
        scan.ranges.fill(f64::INFINITY);
        assert!(SurfaceScan::new(&scan, &Se2::IDENTITY, Vector3::zeros()).points.is_empty());
    }
}

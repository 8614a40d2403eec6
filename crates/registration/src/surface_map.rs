//! Surface points of several scans in one frame, with a nearest-surface query.
//!
//! Points that fall within `MERGE` of one with nearly the same normal are averaged into it (at most `MOST_MERGED`
//! times), so that a map grows with the surface it has seen and not with time. The index is a grid of `CELL` wide
//! buckets on a torus: cells a whole turn apart share a bucket, and the distance test tells them apart, so the index
//! has a fixed size and no bounds.

use crate::point_to_line::Surfaces;
use crate::surface_scan::SurfaceScan;
use groma_geometry::Se2;
use nalgebra::Vector2;

const CELL: f64 = 0.25;
/// Buckets along an axis; a power of two.
const SIDE: i64 = 128;
const NONE: u32 = u32::MAX;
/// Distance within which two points are one [m].
const MERGE: f64 = 0.03;
const MOST_MERGED: f64 = 30.0;
/// Cosine of the largest angle between normals of points that are one.
const SAME_SIDE: f64 = 0.9;

/// Surface points with an index.
#[derive(Clone, Debug)]
pub struct SurfaceMap {
    points: Vec<Vector2<f64>>,
    normals: Vec<Vector2<f64>>,
    merged: Vec<f32>,
    next: Vec<u32>,
    heads: Vec<u32>,
}

impl Default for SurfaceMap {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            normals: Vec::new(),
            merged: Vec::new(),
            next: Vec::new(),
            heads: vec![NONE; (SIDE * SIDE) as usize],
        }
    }
}

/// The best point found so far.
struct Nearest {
    index: Option<usize>,
    sq: f64,
}

fn cell(p: Vector2<f64>) -> (i64, i64) {
    (floor(p.x / CELL), floor(p.y / CELL))
}

fn floor(x: f64) -> i64 {
    let cut = x as i64;
    cut - i64::from(x < cut as f64)
}

/// Distance from a coordinate to the cell `c` along its axis [m].
fn gap(x: f64, c: i64) -> f64 {
    let low = c as f64 * CELL;
    (low - x).max(x - low - CELL).max(0.0)
}

fn bucket(x: i64, y: i64) -> usize {
    ((y & (SIDE - 1)) * SIDE + (x & (SIDE - 1))) as usize
}

impl SurfaceMap {
    /// Adds the points of `scan` that have a normal, moved by `t_map_scan`.
    pub fn insert(&mut self, scan: &SurfaceScan, t_map_scan: &Se2) {
        for i in (0..scan.points.len()).filter(|&i| scan.has_normal(i)) {
            self.add(t_map_scan.act(scan.points[i]), t_map_scan.rotation.act(scan.normals[i]));
        }
    }

    fn add(&mut self, p: Vector2<f64>, normal: Vector2<f64>) {
        if let Some(k) = self.closest(p, normal, MERGE, SAME_SIDE) {
            let n = f64::from(self.merged[k]);
            if n < MOST_MERGED {
                let step = (p - self.points[k]) / (n + 1.0);
                self.points[k] += step;
                self.normals[k] = (self.normals[k] * n + normal).normalize();
                self.merged[k] += 1.0;
            }
            return;
        }
        let (x, y) = cell(p);
        let head = &mut self.heads[bucket(x, y)];
        self.next.push(*head);
        *head = self.points.len() as u32;
        self.points.push(p);
        self.normals.push(normal);
        self.merged.push(1.0);
    }

    /// The closest point within `radius` whose normal agrees with `normal` (any, if that is zero): the cell of `p` first, then
    /// those around it that can hold a closer one.
    fn closest(&self, p: Vector2<f64>, normal: Vector2<f64>, radius: f64, agreement: f64) -> Option<usize> {
        let agreement = if normal == Vector2::zeros() { f64::NEG_INFINITY } else { agreement };
        let mut best = Nearest { index: None, sq: radius * radius };
        let home = cell(p);
        self.scan_cell(home, p, normal, agreement, &mut best);
        let (low, high) = (cell(p - Vector2::repeat(radius)), cell(p + Vector2::repeat(radius)));
        for y in low.1..=high.1 {
            let dy = gap(p.y, y);
            for x in low.0..=high.0 {
                let dx = gap(p.x, x);
                if (x, y) != home && dx * dx + dy * dy < best.sq {
                    self.scan_cell((x, y), p, normal, agreement, &mut best);
                }
            }
        }
        best.index
    }

    fn scan_cell(&self, c: (i64, i64), p: Vector2<f64>, normal: Vector2<f64>, agreement: f64, best: &mut Nearest) {
        let mut k = self.heads[bucket(c.0, c.1)];
        while k != NONE {
            let i = k as usize;
            let sq = (self.points[i] - p).norm_squared();
            if sq < best.sq && self.normals[i].dot(&normal) > agreement {
                *best = Nearest { index: Some(i), sq };
            }
            k = self.next[i];
        }
    }

    /// The surface points.
    #[must_use]
    pub fn points(&self) -> &[Vector2<f64>] {
        &self.points
    }

    /// Their normals, in the same order.
    #[must_use]
    pub fn normals(&self) -> &[Vector2<f64>] {
        &self.normals
    }

    /// Every `k`-th surface point as a scan, so that about `count` remain: a map to be matched to another.
    #[must_use]
    pub fn sample(&self, count: usize) -> SurfaceScan {
        let step = self.points.len().div_ceil(count.max(1)).max(1);
        SurfaceScan {
            points: self.points.iter().step_by(step).copied().collect(),
            normals: self.normals.iter().step_by(step).copied().collect(),
        }
    }
}

impl Surfaces for SurfaceMap {
    fn nearest(&self, p: Vector2<f64>, normal: Vector2<f64>, radius: f64) -> Option<(Vector2<f64>, Vector2<f64>)> {
        self.closest(p, normal, radius, crate::point_to_line::NORMAL_AGREEMENT)
            .map(|i| (self.points[i], self.normals[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(n: usize) -> SurfaceScan {
        SurfaceScan {
            points: (0..n).map(|i| Vector2::new(0.05 * i as f64, 1.0)).collect(),
            normals: vec![Vector2::new(0.0, -1.0); n],
        }
    }

    #[test]
    fn nearest_is_the_nearest() {
        let mut map = SurfaceMap::default();
        map.insert(&line(2000), &Se2::IDENTITY);
        assert_eq!(map.points().len(), 2000);
        for k in 0..500 {
            let q = Vector2::new(0.197 * f64::from(k), 0.8);
            let brute = map.points().iter().map(|p| (p - q).norm()).fold(f64::INFINITY, f64::min);
            match map.nearest(q, Vector2::zeros(), 0.3) {
                Some((p, _)) => assert!(((p - q).norm() - brute).abs() < 1e-12),
                None => assert!(brute >= 0.3),
            }
        }
        assert!(map.nearest(Vector2::new(1.0, 0.9), Vector2::new(0.0, 1.0), 0.3).is_none(), "the far side of a wall");
    }

    #[test]
    fn seeing_a_wall_twice_does_not_grow_the_map() {
        let mut map = SurfaceMap::default();
        map.insert(&line(100), &Se2::IDENTITY);
        map.insert(&line(100), &Se2::new(0.0, 0.01, 0.0));
        assert_eq!(map.points().len(), 100);
        assert!((map.points()[50].y - 1.005).abs() < 1e-12);
    }
}

//! One scan as it was seen: from where, in which direction, how far.
//!
//! Kept in order of bearing it answers two questions cheaply, without a grid: which surface is nearest to a point (for
//! scan-to-scan registration), and how the scan classifies a point: on a surface, seen through (the beam went past it),
//! hidden behind a surface, or not in view. A beam without return says nothing: glass and black walls give none.

use crate::point_to_line::{NORMAL_AGREEMENT, Surfaces};
use crate::surface_scan::SurfaceScan;
use groma_geometry::{Se2, So2, wrap};
use groma_models::{BeamGeometry, LaserScan};
use nalgebra::{Vector2, Vector3};
use std::f64::consts::{PI, TAU};

/// Distance from a surface within which a point agrees with it: this, plus a share of the range.
const AGREES: (f64, f64) = (0.12, 0.015);
/// How far before the surface a point must lie to be called seen through: this, plus a share of the range.
const THROUGH: (f64, f64) = (0.3, 0.03);

/// Classification of a point by a view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Visibility {
    /// The point lies on a surface that was seen.
    Agrees,
    /// The beam went past the point: it was not there.
    SeenThrough,
    /// Something stood before the point.
    Hidden,
    /// No beam, or no return, in its direction.
    NotInView,
}

/// A scan in order of bearing.
#[derive(Clone, Debug)]
pub struct PolarView {
    /// Points and normals in the vehicle frame.
    pub scan: SurfaceScan,
    laser: Se2,
    twist: Vector3<f64>,
    geometry: BeamGeometry,
    ranges: Vec<f32>,
    /// Bearings of the points from the laser, rising, and their indices.
    order: Vec<(f32, u32)>,
}

impl PolarView {
    /// The view of a laser mounted at `t_base_laser` on a vehicle that moves with `twist` (per second).
    #[must_use]
    pub fn new(scan: &LaserScan, t_base_laser: &Se2, twist: Vector3<f64>) -> Self {
        let surface = SurfaceScan::new(scan, t_base_laser, twist);
        let inverse = t_base_laser.inverse();
        let mut order: Vec<(f32, u32)> = surface
            .points
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let q = inverse.act(*p);
                (q.y.atan2(q.x) as f32, i as u32)
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let hit = |r: &f64| if scan.geometry.is_hit(*r) { *r as f32 } else { f32::NAN };
        let ranges = scan.ranges.iter().map(hit).collect();
        Self { scan: surface, laser: *t_base_laser, twist, geometry: scan.geometry, ranges, order }
    }

    /// The laser in the vehicle frame.
    #[must_use]
    pub fn laser(&self) -> &Se2 {
        &self.laser
    }

    /// The laser in the vehicle frame of the scan's stamp when beam `i` was fired.
    #[must_use]
    pub fn laser_at(&self, i: usize) -> Se2 {
        let seconds = i as f64 * self.geometry.time_increment;
        if seconds == 0.0 || self.twist == Vector3::zeros() {
            return self.laser;
        }
        Se2::exp(self.twist * seconds) * self.laser
    }

    /// Where each beam was fired and its unit direction, in a frame that has the vehicle at `pose`. From beam to beam the
    /// laser makes the same motion: `L_(i+1) = L_i (T_v_l^-1 exp(twist dt) T_v_l)`, and the beam the same turn.
    pub fn beams_at(&self, pose: &Se2) -> impl Iterator<Item = (Vector2<f64>, Vector2<f64>)> + use<> {
        let motion = self.laser.inverse() * Se2::exp(self.twist * self.geometry.time_increment) * self.laser;
        let turn = So2::exp(self.geometry.angle_increment);
        let first = (*pose * self.laser, So2::exp(self.geometry.angle_min));
        let beams = std::iter::successors(Some(first), move |(laser, beam)| Some((*laser * motion, *beam * turn)));
        beams.map(|(laser, beam)| (laser.translation, (laser.rotation * beam).act(Vector2::x())))
    }

    /// Classification by this view of a point in the vehicle frame.
    #[must_use]
    pub fn visibility(&self, p: Vector2<f64>) -> Visibility {
        let q = self.laser.inverse().act(p);
        let range = q.norm();
        let Some((near, far)) = self.surface_at(q.y.atan2(q.x)) else { return Visibility::NotInView };
        let agrees = AGREES.0 + AGREES.1 * range;
        if range > near - agrees && range < far + agrees {
            Visibility::Agrees
        } else if range < near - THROUGH.0 - THROUGH.1 * range {
            Visibility::SeenThrough
        } else if range > far {
            Visibility::Hidden
        } else {
            Visibility::NotInView
        }
    }

    /// The nearer and the farther of the two readings around a bearing.
    fn surface_at(&self, bearing: f64) -> Option<(f64, f64)> {
        let beam = self.beam(bearing)?;
        let a = f64::from(*self.ranges.get(beam.floor() as usize)?);
        let b = f64::from(*self.ranges.get(beam.ceil() as usize)?);
        (a.is_finite() && b.is_finite()).then(|| (a.min(b), a.max(b)))
    }

    /// The fractional beam at a bearing.
    fn beam(&self, bearing: f64) -> Option<f64> {
        let last = self.ranges.len().checked_sub(1)? as f64;
        let middle = self.geometry.angle_min + 0.5 * last * self.geometry.angle_increment;
        let beam = 0.5 * last + wrap(bearing - middle) / self.geometry.angle_increment;
        (beam >= 0.0 && beam <= last).then_some(beam)
    }

    /// The ranges beam by beam [m], NaN where there was no hit, with their geometry.
    #[must_use]
    pub fn ranges(&self) -> (&[f32], &BeamGeometry) {
        (&self.ranges, &self.geometry)
    }
}

impl Surfaces for PolarView {
    fn nearest(&self, p: Vector2<f64>, normal: Vector2<f64>, radius: f64) -> Option<(Vector2<f64>, Vector2<f64>)> {
        let q = self.laser.inverse().act(p);
        let range = q.norm();
        if range <= radius || self.order.is_empty() {
            return None;
        }
        let half = (radius / range).asin() as f32;
        let bearing = q.y.atan2(q.x) as f32;
        let mut best: Option<usize> = None;
        let mut best_sq = radius * radius;
        // The seam at +-pi: bearings beyond it continue on the other side.
        for turn in [0.0, TAU as f32, -TAU as f32] {
            let (low, high) = (bearing + turn - half, bearing + turn + half);
            if high < -(PI as f32) || low > PI as f32 {
                continue;
            }
            let first = self.order.partition_point(|o| o.0 < low);
            for &(_, i) in self.order[first..].iter().take_while(|o| o.0 <= high) {
                let (i, n) = (i as usize, self.scan.normals[i as usize]);
                let sq = (self.scan.points[i] - p).norm_squared();
                let agrees = normal == Vector2::zeros() || n.dot(&normal) > NORMAL_AGREEMENT;
                if sq < best_sq && agrees && n != Vector2::zeros() {
                    best_sq = sq;
                    best = Some(i);
                }
            }
        }
        best.map(|i| (self.scan.points[i], self.scan.normals[i]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall 2 m ahead of a 180 degree scanner, one beam without return.
    fn view() -> PolarView {
        let geometry = BeamGeometry {
            angle_min: -std::f64::consts::FRAC_PI_2,
            angle_increment: std::f64::consts::PI / 180.0,
            time_increment: 0.0,
            range_min: 0.05,
            range_max: 20.0,
        };
        let mut ranges: Vec<f64> = (0..181).map(|i| 2.0 / geometry.bearing(i).cos().max(1e-9)).collect();
        ranges[90] = f64::INFINITY;
        let scan = LaserScan { stamp: 0.0, geometry, ranges, intensities: vec![] };
        PolarView::new(&scan, &Se2::new(0.1, 0.0, 0.0), Vector3::zeros())
    }

    #[test]
    fn tells_what_it_sees() {
        let v = view();
        assert_eq!(v.visibility(Vector2::new(2.1, 0.5)), Visibility::Agrees);
        assert_eq!(v.visibility(Vector2::new(1.0, 0.5)), Visibility::SeenThrough);
        assert_eq!(v.visibility(Vector2::new(3.0, 0.5)), Visibility::Hidden);
        assert_eq!(v.visibility(Vector2::new(-1.0, 0.5)), Visibility::NotInView);
        assert_eq!(v.visibility(Vector2::new(1.0, 0.0)), Visibility::NotInView);
    }

    #[test]
    fn the_laser_moves_with_the_vehicle_during_the_sweep() {
        let mut geometry = *view().ranges().1;
        geometry.time_increment = 0.01;
        let scan = LaserScan { stamp: 0.0, geometry, ranges: vec![2.0; 11], intensities: vec![] };
        let v = PolarView::new(&scan, &Se2::new(0.1, 0.0, 0.0), Vector3::new(1.0, 0.0, 0.0));
        assert!((v.laser_at(10).translation - Vector2::new(0.2, 0.0)).norm() < 1e-12);
        assert_eq!(v.laser_at(0), *v.laser());
        // The same place that the points of the scan were taken from.
        let last = v.scan.points.last().unwrap() - v.laser_at(10).translation;
        assert!((last.norm() - 2.0).abs() < 1e-9);
    }

    #[test]
    fn beams_step_by_step_are_those_that_are_requested_one_by_one() {
        let mut geometry = *view().ranges().1;
        geometry.time_increment = 0.001;
        let scan = LaserScan { stamp: 0.0, geometry, ranges: vec![2.0; 181], intensities: vec![] };
        let v = PolarView::new(&scan, &Se2::new(0.8, 0.3, 0.2), Vector3::new(1.0, 0.1, 2.0));
        let pose = Se2::new(3.0, -2.0, 2.5);
        for (i, (from, direction)) in v.beams_at(&pose).take(181).enumerate() {
            let laser = pose * v.laser_at(i);
            let (s, c) = geometry.bearing(i).sin_cos();
            assert!((from - laser.translation).norm() < 1e-12);
            assert!((laser.rotation.inverse().act(direction) - Vector2::new(c, s)).norm() < 1e-12);
        }
    }

    #[test]
    fn finds_the_nearest_surface() {
        let v = view();
        let q = Vector2::new(2.0, 0.31);
        let brute = v.scan.points.iter().map(|p| (p - q).norm()).fold(f64::INFINITY, f64::min);
        let (p, n) = v.nearest(q, Vector2::zeros(), 0.3).unwrap();
        assert!(((p - q).norm() - brute).abs() < 1e-12 && (n - Vector2::new(-1.0, 0.0)).norm() < 1e-6);
        assert!(v.nearest(Vector2::new(1.0, 0.0), Vector2::zeros(), 0.3).is_none());
    }
}

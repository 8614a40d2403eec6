//! Everything that a scan shows to a localizer: FALKO corners with their BSC descriptors, and reflectors.
//!
//! The detector keeps the tables of its scanner and all workspace from scan to scan. A descriptor looks only at the beams
//! that can be near: a point within the radius r of a keypoint at range rho lies within asin(r / rho) of its bearing. The
//! outcome is that of [`crate::falko::Detector`], [`Surroundings::of`] over all hits and [`reflector::detect`].

use crate::bsc::Bsc;
use crate::falko;
use crate::reflector::{self, Reflector};
use crate::{Keypoint, Surroundings};
use groma_models::{BeamGeometry, LaserScan};
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Beams beyond the bound that are looked at as well: rounding.
const SPARE: f64 = 2.0;

/// What a scan shows, in the laser frame.
#[derive(Clone, Copy, Debug)]
pub struct Marks<'a> {
    /// Corners in beam order.
    pub corners: &'a [Keypoint],
    /// Their descriptors.
    pub descriptors: &'a [Bsc],
    /// Reflectors in beam order.
    pub reflectors: &'a [Reflector],
}

/// Detects corners and reflectors with default settings.
#[derive(Clone, Debug, Default)]
pub struct Detector {
    tables: Option<Tables>,
    hits: Vec<Vector2<f64>>,
    corners: Vec<Keypoint>,
    descriptors: Vec<Bsc>,
    reflectors: Vec<Reflector>,
}

/// What depends on the scanner alone.
#[derive(Clone, Debug)]
struct Tables {
    geometry: BeamGeometry,
    corners: falko::Detector,
    reflectors: reflector::Detector,
    /// Direction of every beam.
    directions: Vec<Vector2<f64>>,
}

impl Tables {
    fn new(geometry: BeamGeometry, beams: usize) -> Self {
        let direction = |i| {
            let (sin, cos) = geometry.bearing(i).sin_cos();
            Vector2::new(cos, sin)
        };
        Self {
            geometry,
            corners: falko::Detector::new(geometry, beams, falko::Options::default()),
            reflectors: reflector::Detector::new(geometry, beams, reflector::Options::default()),
            directions: (0..beams).map(direction).collect(),
        }
    }

    fn fits(&self, scan: &LaserScan) -> bool {
        self.geometry == scan.geometry && self.directions.len() == scan.ranges.len()
    }
}

impl Detector {
    /// What a scan shows; the tables are made anew where the scanner is another one.
    pub fn detect(&mut self, scan: &LaserScan) -> Marks<'_> {
        let kept = self.tables.take().filter(|tables| tables.fits(scan));
        let tables = self.tables.insert(kept.unwrap_or_else(|| Tables::new(scan.geometry, scan.ranges.len())));
        tables.corners.detect(&scan.ranges, &mut self.corners);
        tables.reflectors.detect(&scan.ranges, &scan.intensities, &mut self.reflectors);
        place(scan, &tables.directions, &mut self.hits);
        self.descriptors.clear();
        let describe = |corner: &Keypoint| Bsc::of(&surroundings(corner, &scan.geometry, &self.hits));
        self.descriptors.extend(self.corners.iter().map(describe));
        Marks { corners: &self.corners, descriptors: &self.descriptors, reflectors: &self.reflectors }
    }
}

/// The points of all beams, NaN where there is no hit.
fn place(scan: &LaserScan, directions: &[Vector2<f64>], hits: &mut Vec<Vector2<f64>>) {
    hits.clear();
    let point = |(range, direction): (&f64, &Vector2<f64>)| match scan.geometry.is_hit(*range) {
        true => direction * *range,
        false => Vector2::repeat(f64::NAN),
    };
    hits.extend(scan.ranges.iter().zip(directions).map(point));
}

/// What is around a keypoint, from the beams that can be.
fn surroundings(keypoint: &Keypoint, geometry: &BeamGeometry, hits: &[Vector2<f64>]) -> Surroundings {
    let step = geometry.angle_increment.abs();
    let (beams, range) = (hits.len() as i64, keypoint.point.norm());
    let reach = if keypoint.radius < range { (keypoint.radius / range).asin() } else { FRAC_PI_2 * 2.0 };
    // The keypoint lies beside its beam by less than its radius.
    let reach = (2.0 * reach / step + SPARE).ceil() as i64;
    let middle = keypoint.index as i64;
    let others = |i: &usize| *i != keypoint.index;
    let point = |i: usize| hits[i];
    if 2 * reach >= beams {
        return Surroundings::of((0..hits.len()).filter(others).map(point), keypoint, keypoint.radius);
    }
    let near = (middle - reach).max(0) as usize..=(middle + reach).min(beams - 1) as usize;
    let turn = (TAU / step).round() as i64;
    // Beams a turn away point the same way; a scan has at most a few of them beyond its first turn.
    let before = ((middle + turn - reach).max(middle + reach + 1).max(0)).min(beams) as usize..hits.len();
    let after = 0..(middle - turn + reach + 1).min(middle - reach).clamp(0, beams) as usize;
    let all = near.chain(before).chain(after).filter(others).map(point);
    Surroundings::of(all, keypoint, keypoint.radius)
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_estimation::random::SplitMix64;

    /// Walls at right angles with tape on them, seen by a scanner of any field.
    fn scan(beams: usize, field: f64, start: f64, seed: u64) -> LaserScan {
        let geometry = BeamGeometry {
            angle_min: start,
            angle_increment: field / beams as f64,
            time_increment: 1e-5,
            range_min: 0.05,
            range_max: 30.0,
        };
        let mut draw = SplitMix64::new(seed);
        let reading = |i: usize| {
            let fold = ((geometry.bearing(i) + 0.01 * seed as f64).rem_euclid(0.4) - 0.2).abs();
            if i % 101 == 7 { f64::NAN } else { 2.0 + 2.0 * fold + 0.01 * draw.normal() }
        };
        let ranges: Vec<f64> = (0..beams).map(reading).collect();
        let intensities = (0..beams).map(|i| if i % 90 < 6 { 2000.0 } else { 100.0 + (i % 7) as f64 }).collect();
        LaserScan { stamp: 1.0, geometry, ranges, intensities }
    }

    #[test]
    fn finds_what_each_detector_finds_over_all_beams() {
        let mut detector = Detector::default();
        for (beams, field, start) in
            [(1081, 4.7, -2.35), (720, TAU, 0.5), (723, 723.0 * TAU / 720.0, -3.0), (361, -3.13, 1.5)]
        {
            for seed in 0..6 {
                let scan = scan(beams, field, start, seed);
                let mut corners = Vec::new();
                falko::Detector::new(scan.geometry, beams, falko::Options::default())
                    .detect(&scan.ranges, &mut corners);
                let marks = reflector::detect(&scan.ranges, &scan.intensities, &scan.geometry, &Default::default());
                let found = detector.detect(&scan);
                assert!(found.corners.len() > 3);
                assert_eq!((found.corners, found.reflectors), (&corners[..], &marks[..]));
                let describe = |c: &Keypoint| {
                    let others = scan.hits().filter(|(i, _)| *i != c.index).map(|(_, p)| p);
                    Bsc::of(&Surroundings::of(others, c, c.radius))
                };
                assert_eq!(found.descriptors, corners.iter().map(describe).collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn a_scan_without_beams_or_intensities_shows_no_marks() {
        let mut detector = Detector::default();
        let empty = LaserScan { ranges: Vec::new(), intensities: Vec::new(), ..scan(9, 1.0, 0.0, 1) };
        assert!(detector.detect(&empty).corners.is_empty());
        let dark = LaserScan { intensities: Vec::new(), ..scan(720, TAU, 0.0, 1) };
        assert!(detector.detect(&dark).reflectors.is_empty());
    }
}

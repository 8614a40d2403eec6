//! From ranges to keypoints, with tables and workspace that last from scan to scan.

use super::corner::{Corner, Resolution, locate, on_beam};
use super::layout::{Layout, PaddedRanges};
use super::neighbourhood::{Arms, LANES};
use super::options::{Definition, Options};
use super::radius::fill;
use super::score::Ring;
use super::selection::{Ranked, Selection};
use super::suppression::{Candidate, Search};
use super::sweep::{Sweep, Triangle};
use crate::Keypoint;
use groma_geometry::{So2, wrap};
use groma_models::BeamGeometry;
use nalgebra::Vector2;
use pulp::{Arch, Simd, WithSimd};

/// Finds the corners of the scans of one scanner. Allocates nothing per scan once it has seen a few.
///
/// ```
/// use groma_features::falko::{Detector, Options};
/// use groma_models::BeamGeometry;
/// // A wall 3 m ahead that ends at 20 degrees to the left: another wall comes from there to the scanner.
/// let geometry = BeamGeometry {
///     angle_min: -1.0, angle_increment: 0.005, time_increment: 0.0, range_min: 0.1, range_max: 20.0,
/// };
/// let bearing = |i| geometry.bearing(i);
/// let ranges: Vec<f64> = (0..400).map(|i| (3.0 / bearing(i).cos()).min(1.1 / bearing(i).sin().max(1e-9))).collect();
/// let mut keypoints = Vec::new();
/// Detector::new(geometry, ranges.len(), Options::default()).detect(&ranges, &mut keypoints);
/// assert_eq!(keypoints.len(), 1);
/// assert!((keypoints[0].point - nalgebra::Vector2::new(3.0, 1.1)).norm() < 0.01);
/// ```
#[derive(Clone, Debug)]
pub struct Detector {
    geometry: BeamGeometry,
    options: Options,
    layout: Layout,
    /// The direction of every beam.
    bearings: Vec<So2>,
    ring: Ring,
    /// The vector instructions of this machine; the outcome does not depend on them.
    arch: Arch,
    work: Workspace,
}

#[derive(Clone, Debug, Default)]
struct Workspace {
    ranges: PaddedRanges,
    /// Of every beam [m]; 0 where it cannot be a corner.
    radius: Vec<f64>,
    arms: Arms,
    triangles: Vec<Triangle>,
    scored: Vec<Scored>,
    candidates: Vec<Candidate>,
    ranked: Vec<Ranked>,
    peaks: Vec<usize>,
}

/// A beam that passed the triangle test.
#[derive(Clone, Copy, Debug)]
struct Scored {
    index: usize,
    score: u64,
    /// Pairs of points of one arm.
    pairs: u64,
    /// Height of the triangle over the radius, squared.
    height_sq: f64,
    radius: f64,
    reach: usize,
}

impl Detector {
    /// A detector for scans of `beams` beams; the options are assumed valid (see [`Options::validate`]).
    #[must_use]
    pub fn new(geometry: BeamGeometry, beams: usize, options: Options) -> Self {
        let layout = Layout::new(&geometry, beams);
        let bearings = (0..layout.beams).map(|i| So2::exp(geometry.bearing(i))).collect();
        let (ring, work) = (Ring::new(options.sectors), Workspace::default());
        Self { geometry, options, layout, bearings, ring, arch: Arch::new(), work }
    }

    /// Replace `out` by the keypoints of a scan, in beam order. Beams the scan lacks count as no hits.
    pub fn detect(&mut self, ranges: &[f64], out: &mut Vec<Keypoint>) {
        out.clear();
        let Self { geometry, options, layout, ring, work, arch, .. } = self;
        arch.dispatch(Find { ranges, geometry, options, layout, ring, work });
        match self.options.definition {
            Definition::Normalised => self.select(),
            Definition::Published => self.suppress(),
        }
        for k in 0..self.work.peaks.len() {
            out.push(self.keypoint(self.work.peaks[k]));
        }
    }

    /// Keep the best by the score over its maximum.
    fn select(&mut self) {
        let Workspace { ranges, scored, ranked, peaks, .. } = &mut self.work;
        let Options { sectors, threshold, .. } = self.options;
        let rank = |s: &Scored| {
            let most = s.pairs * u64::from(sectors / 2);
            let score = s.score as f64 / most.max(1) as f64;
            Ranked { index: s.index, score, height_sq: s.height_sq, radius: s.radius }
        };
        ranked.clear();
        ranked.extend(scored.iter().map(rank));
        Selection { ranges, layout: &self.layout, threshold }.corners(ranked, peaks);
    }

    /// Turn scores into qualities and keep the peaks.
    fn suppress(&mut self) {
        let Workspace { ranges, scored, candidates, peaks, .. } = &mut self.work;
        let worst = scored.iter().map(|s| s.score).max().unwrap_or(0);
        candidates.clear();
        candidates.extend(scored.iter().map(|s| Candidate { index: s.index, quality: worst - s.score }));
        let threshold = worst * u64::from(self.options.threshold_percent) / 100;
        let radius = self.options.suppression_radius;
        let widest = self.layout.reach_at((radius / ranges.nearest(self.layout.beams)).min(1.0));
        let search = Search { ranges, layout: &self.layout, radius, threshold, widest };
        search.peaks(candidates, peaks);
    }

    /// The keypoint of a peak.
    fn keypoint(&mut self, index: usize) -> Keypoint {
        let at = self.work.scored.partition_point(|s| s.index < index);
        let Scored { radius, reach, .. } = self.work.scored[at];
        let (rho, arms) = (self.work.ranges.at(index), &mut self.work.arms);
        arms.gather(&self.work.ranges, index, radius, reach, &self.layout);
        let resolution = Resolution { sigma: self.options.range_noise, spacing: rho * self.layout.step, radius };
        let corner = if self.options.sub_beam { locate(arms, &resolution) } else { on_beam(&resolution) };
        let opening = arms.opening();
        self.in_laser_frame(index, rho, radius, corner, opening.y.atan2(opening.x))
    }

    /// From the frame of the beam, y towards growing index, to the frame of the laser.
    fn in_laser_frame(&self, index: usize, rho: f64, radius: f64, corner: Corner, opening: f64) -> Keypoint {
        let (bearing, turn) = (self.geometry.bearing(index), self.layout.turn);
        let rotation = self.bearings[index];
        let point = rotation.act(Vector2::new(rho + corner.offset.x, turn * corner.offset.y));
        let mut local = corner.covariance;
        local.m12 *= turn;
        local.m21 *= turn;
        let covariance = rotation.matrix() * local * rotation.matrix().transpose();
        Keypoint { index, point, orientation: wrap(bearing + turn * opening), radius, covariance }
    }
}

/// From ranges to scored beams, compiled for each instruction set.
struct Find<'a> {
    ranges: &'a [f64],
    geometry: &'a BeamGeometry,
    options: &'a Options,
    layout: &'a Layout,
    ring: &'a Ring,
    work: &'a mut Workspace,
}

impl WithSimd for Find<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { ranges, geometry, options, layout, ring, work } = self;
        work.ranges.load(ranges, geometry, layout, LANES);
        fill(&mut work.radius, work.ranges.beams_and(layout.beams, LANES), options);
        work.radius[layout.beams..].fill(0.0);
        let sweep = Sweep { ranges: &work.ranges, layout, radius: &work.radius, beta: options.beta };
        sweep.triangles(simd, &mut work.triangles);
        work.score(layout, options, ring);
    }
}

impl Workspace {
    /// The beams of the triangles with enough neighbours on either side, scored.
    #[inline(always)]
    fn score(&mut self, layout: &Layout, options: &Options, ring: &Ring) {
        self.scored.clear();
        for &Triangle { index, radius, reach } in &self.triangles {
            self.arms.gather(&self.ranges, index, radius, reach, layout);
            if self.arms.left.len().min(self.arms.right.len()) >= options.min_side_points {
                let score = ring.score(&self.arms, self.arms.opening());
                let (pairs, height_sq) = (self.arms.pairs(), self.arms.height_sq() / (radius * radius));
                self.scored.push(Scored { index, score, pairs, height_sq, radius, reach });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_estimation::random::SplitMix64;
    use pulp::Arch;

    /// A zigzag of walls at right angles, with noise and gaps, in centimetres: many corners, many ties.
    fn scan(beams: usize, step: f64, seed: u64) -> Vec<f64> {
        let mut draw = SplitMix64::new(seed);
        let reading = |i: usize| {
            let fold = ((i as f64 * step + 0.01 * seed as f64).rem_euclid(0.4) - 0.2).abs();
            let range = 2.0 + 2.0 * fold + 0.01 * draw.normal();
            if i % 101 == 7 { f64::NAN } else { (range * 100.0).round() / 100.0 }
        };
        (0..beams).map(reading).collect()
    }

    #[test]
    fn every_instruction_set_finds_the_same_to_the_last_bit() {
        for (beams, field) in [(181, 3.13), (361, 3.12), (1081, 4.7), (720, std::f64::consts::TAU), (3, 0.1)] {
            let geometry = BeamGeometry {
                angle_min: -1.0,
                angle_increment: field / beams as f64,
                time_increment: 0.0,
                range_min: 0.05,
                range_max: 30.0,
            };
            for definition in [Definition::Normalised, Definition::Published] {
                let options = Options { definition, ..Options::default() };
                let (mut fast, mut found) = (Detector::new(geometry, beams, options), Vec::new());
                let (mut plain, mut expected) = (Detector { arch: Arch::Scalar, ..fast.clone() }, Vec::new());
                for seed in 0..40 {
                    let ranges = scan(beams, geometry.angle_increment, seed);
                    fast.detect(&ranges, &mut found);
                    plain.detect(&ranges, &mut expected);
                    assert_eq!(found, expected);
                    assert!(beams < 10 || !found.is_empty());
                }
            }
        }
    }
}

//! From ranges to orthogonal corners, with tables and workspace that last from scan to scan.

use super::arms::{Corner, Gates, LEAST_SCORE, Tally, locate};
use super::options::Options;
use super::spectrum::Spectrum;
use crate::Keypoint;
use crate::falko::layout::{Layout, PaddedRanges};
use groma_geometry::{So2, wrap};
use groma_models::BeamGeometry;
use nalgebra::{Matrix2, Vector2};
use pulp::{Arch, Simd, WithSimd};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Finds the orthogonal corners of the scans of one scanner.
#[derive(Clone, Debug)]
pub struct Detector {
    geometry: BeamGeometry,
    options: Options,
    layout: Layout,
    /// Cosine and sine of the bearings from beam 0.
    bearings: Vec<(f64, f64)>,
    spectrum: Spectrum,
    ranges: PaddedRanges,
    /// Points in the frame of the walls, with the margins of the ranges; NaN for no hit.
    x: Vec<f64>,
    y: Vec<f64>,
    candidates: Vec<Candidate>,
    peaks: Vec<Candidate>,
    /// The vector instructions of this machine; the outcome does not depend on them.
    arch: Arch,
}

/// A beam with two arms.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    index: usize,
    score: u64,
    /// Distance of the beam's point from its corner, where others have the same score [m].
    off: f64,
    point: Vector2<f64>,
}

impl Detector {
    /// A detector for scans of `beams` beams; the options are assumed valid (see [`Options::validate`]).
    #[must_use]
    pub fn new(geometry: BeamGeometry, beams: usize, options: Options) -> Self {
        let layout = Layout::new(&geometry, beams);
        let bearing = |i: usize| {
            let (sin, cos) = (i as f64 * layout.step).sin_cos();
            (cos, sin)
        };
        Self {
            geometry,
            options,
            bearings: (0..layout.beams).map(bearing).collect(),
            layout,
            spectrum: Spectrum::new(&options),
            ranges: PaddedRanges::default(),
            x: Vec::new(),
            y: Vec::new(),
            candidates: Vec::new(),
            peaks: Vec::new(),
            arch: Arch::new(),
        }
    }

    /// Replace `out` by the keypoints of a scan, in beam order. Beams the scan lacks count as no hits.
    pub fn detect(&mut self, ranges: &[f64], out: &mut Vec<Keypoint>) {
        out.clear();
        self.ranges.load(ranges, &self.geometry, &self.layout, 0);
        let dominant = self.turn_to_walls();
        self.arch.dispatch(Score(self));
        self.suppress();
        out.extend(self.peaks.iter().map(|peak| self.keypoint(peak.index, dominant)));
    }

    /// Fill the points in the frame of the walls; the direction of the walls from beam 0.
    fn turn_to_walls(&mut self) -> f64 {
        let (n, margin) = (self.layout.beams, self.layout.reach());
        self.x.clear();
        self.y.clear();
        self.x.resize(n + 2 * margin, f64::NAN);
        self.y.resize(n + 2 * margin, f64::NAN);
        let (x, y) = (&mut self.x[margin..margin + n], &mut self.y[margin..margin + n]);
        let ranges = &self.ranges.at_and_after(0)[..n];
        for ((x, y), (rho, (cos, sin))) in x.iter_mut().zip(y.iter_mut()).zip(ranges.iter().zip(&self.bearings)) {
            (*x, *y) = (rho * cos, rho * sin);
        }
        let dominant = self.spectrum.dominant(x, y);
        let (sin, cos) = dominant.sin_cos();
        for (x, y) in x.iter_mut().zip(y) {
            (*x, *y) = (cos * *x + sin * *y, cos * *y - sin * *x);
        }
        if self.layout.closed {
            for values in [&mut self.x, &mut self.y] {
                values.copy_within(n..n + margin, 0);
                values.copy_within(margin..2 * margin, margin + n);
            }
        }
        dominant
    }

    /// Radius of the neighbourhood of a beam, and how many beams it may reach; none where it cannot be a corner.
    #[inline(always)]
    fn neighbourhood(&self, i: usize) -> Option<(f64, usize)> {
        let rho = self.ranges.at(i);
        let within = rho >= self.options.range_min && rho <= self.options.range_max;
        let radius = self.options.radius(rho);
        within.then(|| (radius, self.layout.reach_at(radius / rho)))
    }

    #[inline(always)]
    fn gates(&self, radius: f64) -> Gates {
        Gates { radius, tolerance: self.options.tolerance }
    }

    /// The stretches of points before and after beam `i`, and the beam's own.
    #[inline(always)]
    fn stretches(&self, i: usize, reach: usize) -> (Range<usize>, Range<usize>, Vector2<f64>) {
        let at = self.layout.reach() + i;
        (at - reach..at, at + 1..at + 1 + reach, Vector2::new(self.x[at], self.y[at]))
    }

    /// Beam `i` as a corner, if there are enough points on either side and on either arm.
    #[inline(always)]
    fn judge(&self, index: usize, radius: f64, reach: usize) -> Option<Candidate> {
        let (before, after, point) = self.stretches(index, reach);
        let gates = self.gates(radius);
        let left = Tally::of(&self.x[before.clone()], &self.y[before.clone()], point, gates);
        let right = Tally::of(&self.x[after.clone()], &self.y[after.clone()], point, gates);
        let (tally, least) = (left.plus(right), self.options.min_side_points);
        let fewest = left.near.min(right.near).min(tally.vertical).min(tally.horizontal);
        let corner = fewest as usize >= least && tally.score() > LEAST_SCORE;
        corner.then_some(Candidate { index, score: tally.score(), off: 0.0, point })
    }

    /// The best candidates, none within the radius of a better one: those of higher score, then those nearer to their
    /// corner, then those of lower index are better.
    fn suppress(&mut self) {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.sort_unstable_by(|s, t| t.score.cmp(&s.score).then(s.index.cmp(&t.index)));
        self.peaks.clear();
        for equals in candidates.chunk_by_mut(|s, t| s.score == t.score) {
            self.suppress_equals(equals);
        }
        self.peaks.sort_unstable_by_key(|peak| peak.index);
        self.candidates = candidates;
    }

    /// The same among candidates of one score.
    fn suppress_equals(&mut self, equals: &mut [Candidate]) {
        let mut left = 0;
        for k in 0..equals.len() {
            if self.is_apart(&equals[k]) {
                equals.swap(left, k);
                left += 1;
            }
        }
        let equals = &mut equals[..left];
        if left > 1 {
            equals.iter_mut().for_each(|c| c.off = self.corner(c.index).offset.norm());
            equals.sort_unstable_by(|s, t| s.off.total_cmp(&t.off).then(s.index.cmp(&t.index)));
        }
        for candidate in equals {
            if self.is_apart(candidate) {
                self.peaks.push(*candidate);
            }
        }
    }

    /// Whether no peak is within the suppression radius.
    fn is_apart(&self, candidate: &Candidate) -> bool {
        self.peaks.iter().all(|peak| (peak.point - candidate.point).norm() > self.options.suppression_radius)
    }

    /// The corner of a beam, relative to its point, in the frame of the walls.
    fn corner(&self, index: usize) -> Corner {
        let (radius, reach) = self.neighbourhood(index).unwrap_or((0.0, 0));
        let (before, after, own) = self.stretches(index, reach);
        let around = before.start..after.end;
        locate(&self.x[around.clone()], &self.y[around], own, self.gates(radius), self.options.range_noise)
    }

    /// The keypoint of a peak, in the laser frame.
    fn keypoint(&self, index: usize, dominant: f64) -> Keypoint {
        let (radius, _) = self.neighbourhood(index).unwrap_or((0.0, 0));
        let (_, _, own) = self.stretches(index, 0);
        let Corner { offset, variance, quadrant } = self.corner(index);
        // From the frame of the walls to that of beam 0, y towards growing index, and on to the laser's.
        let turn = self.layout.turn;
        let rotation = So2::exp(self.geometry.angle_min + turn * dominant);
        let flip = Vector2::new(1.0, turn);
        let local = Matrix2::from_diagonal(&variance);
        let opening = quadrant.y.atan2(quadrant.x).rem_euclid(4.0 * FRAC_PI_2);
        Keypoint {
            index,
            point: rotation.act((own + offset).component_mul(&flip)),
            orientation: wrap(self.geometry.angle_min + turn * (dominant + opening)),
            radius,
            covariance: rotation.matrix() * local * rotation.matrix().transpose(),
        }
    }
}

/// The beams with two arms, with their scores; compiled for each instruction set.
struct Score<'a>(&'a mut Detector);

impl WithSimd for Score<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(detector) = self;
        detector.candidates.clear();
        for i in 0..detector.layout.beams {
            if let Some((radius, reach)) = detector.neighbourhood(i) {
                let candidate = detector.judge(i, radius, reach);
                detector.candidates.extend(candidate);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_estimation::random::SplitMix64;

    #[test]
    fn every_instruction_set_finds_the_same_to_the_last_bit() {
        let geometry = BeamGeometry {
            angle_min: -1.0,
            angle_increment: 0.008,
            time_increment: 0.0,
            range_min: 0.05,
            range_max: 30.0,
        };
        let (mut draw, mut found, mut expected) = (SplitMix64::new(8), Vec::new(), Vec::new());
        let mut fast = Detector::new(geometry, 600, Options::default());
        let mut plain = Detector { arch: Arch::Scalar, ..fast.clone() };
        for k in 0..40 {
            // A room at some angle, its pillars 0.3 m deep, with noise and without some beams.
            let mut reading = |i: usize| {
                let (sin, cos) = (geometry.bearing(i) + 0.04 * f64::from(k)).sin_cos();
                let range = (4.0 / cos.abs()).min(2.5 / sin.abs());
                let pillar = if (range * (cos + sin)).rem_euclid(1.5) < 0.5 { 0.3 } else { 0.0 };
                if i % 97 == 3 { f64::NAN } else { range - pillar + 0.01 * draw.normal() }
            };
            let ranges: Vec<f64> = (0..600).map(&mut reading).collect();
            fast.detect(&ranges, &mut found);
            plain.detect(&ranges, &mut expected);
            assert_eq!(found, expected);
            assert!(!found.is_empty());
        }
    }
}

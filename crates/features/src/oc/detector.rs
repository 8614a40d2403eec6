//! From ranges to orthogonal corners, with tables and workspace that last from scan to scan.

use super::arms::{Corner, Gates, LEAST_SCORE, Tally, locate};
use super::options::Options;
use super::spectrum::Spectrum;
use crate::Keypoint;
use crate::falko::layout::{Layout, PaddedRanges};
use groma_geometry::{So2, wrap};
use groma_models::BeamGeometry;
use nalgebra::{Matrix2, Vector2};
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
}

/// A beam with two arms.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    index: usize,
    score: u64,
    /// Distance of the beam's point from its corner [m].
    off: f64,
    point: Vector2<f64>,
}

impl Detector {
    /// A detector for scans of `beams` beams; the options are taken to be valid (see [`Options::validate`]).
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
        }
    }

    /// Replace `out` by the keypoints of a scan, in beam order. Beams the scan lacks count as no hits.
    pub fn detect(&mut self, ranges: &[f64], out: &mut Vec<Keypoint>) {
        out.clear();
        self.ranges.load(ranges, &self.geometry, &self.layout, 0);
        let dominant = self.turn_to_walls();
        self.score();
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
    fn neighbourhood(&self, i: usize) -> Option<(f64, usize)> {
        let rho = self.ranges.at(i);
        let within = rho >= self.options.range_min && rho <= self.options.range_max;
        let radius = self.options.radius(rho);
        within.then(|| (radius, self.layout.reach_at(radius / rho)))
    }

    fn gates(&self, radius: f64) -> Gates {
        Gates { radius, tolerance: self.options.tolerance }
    }

    /// The stretches of points before and after beam `i`, and the beam's own.
    fn stretches(&self, i: usize, reach: usize) -> (Range<usize>, Range<usize>, Vector2<f64>) {
        let at = self.layout.reach() + i;
        (at - reach..at, at + 1..at + 1 + reach, Vector2::new(self.x[at], self.y[at]))
    }

    /// The beams with two arms, with their scores.
    fn score(&mut self) {
        self.candidates.clear();
        for i in 0..self.layout.beams {
            let candidate = self.neighbourhood(i).and_then(|(radius, reach)| self.judge(i, radius, reach));
            self.candidates.extend(candidate);
        }
    }

    /// Beam `i` as a corner, if there are enough points on either side and on either arm.
    fn judge(&self, index: usize, radius: f64, reach: usize) -> Option<Candidate> {
        let (before, after, point) = self.stretches(index, reach);
        let gates = self.gates(radius);
        let of = |side: &Range<usize>| Tally::of(&self.x[side.clone()], &self.y[side.clone()], point, gates);
        let (left, right) = (of(&before), of(&after));
        let (tally, least) = (left.plus(right), self.options.min_side_points);
        let fewest = left.near.min(right.near).min(tally.vertical).min(tally.horizontal);
        (fewest as usize >= least && tally.score() > LEAST_SCORE).then(|| {
            let around = before.start..after.end;
            let corner = locate(&self.x[around.clone()], &self.y[around], point, gates, self.options.range_noise);
            Candidate { index, score: tally.score(), off: corner.offset.norm(), point }
        })
    }

    /// The best candidates, none within the radius of a better one: those of higher score, then those nearer to their
    /// corner, then those of lower index are better.
    fn suppress(&mut self) {
        let order = |s: &Candidate, t: &Candidate| {
            t.score.cmp(&s.score).then(s.off.total_cmp(&t.off)).then(s.index.cmp(&t.index))
        };
        self.candidates.sort_unstable_by(order);
        self.peaks.clear();
        for candidate in &self.candidates {
            let apart = |peak: &Candidate| (peak.point - candidate.point).norm() > self.options.suppression_radius;
            if self.peaks.iter().all(apart) {
                self.peaks.push(*candidate);
            }
        }
        self.peaks.sort_unstable_by_key(|peak| peak.index);
    }

    /// The keypoint of a peak, in the laser frame.
    fn keypoint(&self, index: usize, dominant: f64) -> Keypoint {
        let (radius, reach) = self.neighbourhood(index).unwrap_or((0.0, 0));
        let (before, after, own) = self.stretches(index, reach);
        let around = before.start..after.end;
        let (x, y) = (&self.x[around.clone()], &self.y[around]);
        let Corner { offset, variance, quadrant } = locate(x, y, own, self.gates(radius), self.options.range_noise);
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

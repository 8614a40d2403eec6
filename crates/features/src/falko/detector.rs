//! From ranges to keypoints, with tables and workspace that last from scan to scan.

use super::corner::{Corner, Resolution, locate, on_beam};
use super::layout::{Layout, PaddedRanges};
use super::neighbourhood::{Arms, LANES, is_corner, relative, sweep};
use super::options::Options;
use super::score::Ring;
use super::suppression::{Candidate, Search};
use crate::Keypoint;
use groma_geometry::{So2, wrap};
use groma_models::BeamGeometry;
use nalgebra::Vector2;

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
    ring: Ring,
    work: Workspace,
}

#[derive(Clone, Debug, Default)]
struct Workspace {
    ranges: PaddedRanges,
    arms: Arms,
    scored: Vec<Scored>,
    candidates: Vec<Candidate>,
    peaks: Vec<usize>,
}

/// A beam that passed the triangle test.
#[derive(Clone, Copy, Debug)]
struct Scored {
    index: usize,
    score: u64,
}

/// Neighbourhoods of beams that are swept side by side.
struct Group {
    radius: [f64; LANES],
    /// r^2 - rho^2, minus infinity where the beam cannot be a corner.
    slack: [f64; LANES],
    reach: usize,
}

impl Detector {
    /// A detector for scans of `beams` beams; the options are taken to be valid (see [`Options::validate`]).
    #[must_use]
    pub fn new(geometry: BeamGeometry, beams: usize, options: Options) -> Self {
        let layout = Layout::new(&geometry, beams);
        Self { geometry, options, layout, ring: Ring::new(options.sectors), work: Workspace::default() }
    }

    /// Replace `out` by the keypoints of a scan, in beam order. Beams the scan lacks count as no hits.
    pub fn detect(&mut self, ranges: &[f64], out: &mut Vec<Keypoint>) {
        out.clear();
        self.work.ranges.load(ranges, &self.geometry, &self.layout, LANES);
        self.find_candidates();
        self.suppress();
        for k in 0..self.work.peaks.len() {
            out.push(self.keypoint(self.work.peaks[k]));
        }
    }

    /// Radius of the neighbourhood of a beam, 0 where the beam cannot be a corner.
    fn radius(&self, i: usize) -> f64 {
        let rho = self.work.ranges.at(i);
        let within = rho >= self.options.range_min && rho <= self.options.range_max;
        if within { self.options.radius(rho) } else { 0.0 }
    }

    /// The beams with a corner's triangle, scored.
    fn find_candidates(&mut self) {
        self.work.scored.clear();
        for first in (0..self.layout.beams).step_by(LANES) {
            let Some(group) = self.group(first) else { continue };
            let furthest = sweep(&self.work.ranges, first, &group.slack, group.reach, &self.layout);
            let sides = furthest.left.iter().zip(&furthest.right);
            for (lane, (radius, (&left, &right))) in group.radius.iter().zip(sides).enumerate() {
                if left > 0.0 && right > 0.0 {
                    self.judge(first + lane, *radius, left as usize, right as usize);
                }
            }
        }
    }

    /// Radii of the beams `first .. first + LANES`; none where no beam can be a corner.
    fn group(&self, first: usize) -> Option<Group> {
        let mut group = Group { radius: [0.0; LANES], slack: [f64::NEG_INFINITY; LANES], reach: 0 };
        let mut steepest = 0.0_f64;
        for (lane, i) in (first..self.layout.beams.min(first + LANES)).enumerate() {
            let (rho, radius) = (self.work.ranges.at(i), self.radius(i));
            if radius > 0.0 {
                (group.radius[lane], group.slack[lane]) = (radius, radius * radius - rho * rho);
                steepest = steepest.max(radius / rho);
            }
        }
        group.reach = self.layout.reach_at(steepest);
        (steepest > 0.0).then_some(group)
    }

    /// Score beam `i` if the triangle with its furthest neighbours, `left` and `right` beams off, is a corner's.
    fn judge(&mut self, i: usize, radius: f64, left: usize, right: usize) {
        let (ranges, layout) = (&self.work.ranges, &self.layout);
        let (rho, before) = (ranges.at(i), ranges.before(i));
        let first = relative(before[before.len() - left], rho, left, layout);
        let last = relative(ranges.at_and_after(i)[right], rho, right, layout);
        if !is_corner(Vector2::new(first.x, -first.y), last, radius / self.options.beta) {
            return;
        }
        let arms = &mut self.work.arms;
        arms.gather(ranges, i, radius, left.max(right), layout);
        if arms.left.len().min(arms.right.len()) >= self.options.min_side_points {
            self.work.scored.push(Scored { index: i, score: self.ring.score(arms, arms.opening()) });
        }
    }

    /// Turn scores into qualities and keep the peaks.
    fn suppress(&mut self) {
        let Workspace { ranges, scored, candidates, peaks, .. } = &mut self.work;
        let worst = scored.iter().map(|s| s.score).max().unwrap_or(0);
        candidates.clear();
        candidates.extend(scored.iter().map(|s| Candidate { index: s.index, quality: worst - s.score }));
        let threshold = worst * u64::from(self.options.threshold_percent) / 100;
        let search = Search { ranges, layout: &self.layout, radius: self.options.suppression_radius, threshold };
        search.peaks(candidates, peaks);
    }

    /// The keypoint of a peak.
    fn keypoint(&mut self, index: usize) -> Keypoint {
        let (rho, radius) = (self.work.ranges.at(index), self.radius(index));
        let arms = &mut self.work.arms;
        arms.gather(&self.work.ranges, index, radius, self.layout.reach_at(radius / rho), &self.layout);
        let resolution = Resolution { sigma: self.options.range_noise, spacing: rho * self.layout.step, radius };
        let corner = if self.options.sub_beam { locate(arms, &resolution) } else { on_beam(&resolution) };
        let opening = arms.opening();
        self.in_laser_frame(index, rho, radius, corner, opening.y.atan2(opening.x))
    }

    /// From the frame of the beam, y towards growing index, to the frame of the laser.
    fn in_laser_frame(&self, index: usize, rho: f64, radius: f64, corner: Corner, opening: f64) -> Keypoint {
        let (bearing, turn) = (self.geometry.bearing(index), self.layout.turn);
        let rotation = So2::exp(bearing);
        let point = rotation.act(Vector2::new(rho + corner.offset.x, turn * corner.offset.y));
        let mut local = corner.covariance;
        local.m12 *= turn;
        local.m21 *= turn;
        let covariance = rotation.matrix() * local * rotation.matrix().transpose();
        Keypoint { index, point, orientation: wrap(bearing + turn * opening), radius, covariance }
    }
}

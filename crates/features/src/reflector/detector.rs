//! From ranges and intensities to marks: runs of bright beams, with both ends in view.
//!
//! A run may have one beam without an echo in it. Its ranges follow each other within the noise or one bearing step of a
//! surface seen at 75 degrees. It is no mark when it is wider than a mark may be, when it has too few beams for the
//! narrowest mark at its range, or when an end is not in view: the scan ends there, the next beam is nearer by more
//! than `HIDES` (something stands before the edge), or it is bright as well (another mark stands before or behind).

use super::background::Background;
use super::shape::{Run, locate};
use super::{Options, Reflector};
use crate::falko::layout::Layout;
use groma_geometry::So2;
use groma_models::BeamGeometry;
use nalgebra::Vector2;

/// Ranges of neighbouring beams of a mark may differ by so many times the noise of a range.
const STEP_SIGMAS: f64 = 8.0;
/// Tangent of the steepest incidence at which a mark is followed.
const STEEPEST: f64 = 3.7;
/// What is nearer by more than this may hide the edge of a mark [m].
const HIDES: f64 = 0.15;
/// Hits a mark has at least, as a share of what the narrowest mark would have.
const LEAST_SHARE: f64 = 0.6;

/// The reflectors of a scan, in beam order; none if it has no intensities.
///
/// ```
/// use groma_features::reflector::{Options, detect};
/// use groma_models::BeamGeometry;
/// // A wall 4 m ahead, a strip of tape on it.
/// let geometry = BeamGeometry {
///     angle_min: -0.5, angle_increment: 0.005, time_increment: 0.0, range_min: 0.1, range_max: 20.0,
/// };
/// let ranges: Vec<f64> = (0..200).map(|i| 4.0 / geometry.bearing(i).cos()).collect();
/// let is_tape = |i: usize| (ranges[i] * geometry.bearing(i).sin()).abs() < 0.15;
/// let intensities: Vec<f64> = (0..200).map(|i| if is_tape(i) { 900.0 } else { 40.0 }).collect();
/// let found = detect(&ranges, &intensities, &geometry, &Options::default());
/// assert_eq!(found.len(), 1);
/// assert!((found[0].point - nalgebra::Vector2::new(4.0, 0.0)).norm() < 0.01);
/// ```
#[must_use]
pub fn detect(ranges: &[f64], intensities: &[f64], geometry: &BeamGeometry, options: &Options) -> Vec<Reflector> {
    let mut found = Vec::new();
    Detector::new(*geometry, ranges.len(), *options).detect(ranges, intensities, &mut found);
    found
}

/// Finds the reflectors of the scans of one scanner; tables and workspace last from scan to scan.
#[derive(Clone, Debug)]
pub struct Detector {
    geometry: BeamGeometry,
    options: Options,
    layout: Layout,
    background: Background,
    bright: Vec<bool>,
}

impl Detector {
    /// A detector for scans of `beams` beams; the options are assumed valid (see [`Options::validate`]).
    #[must_use]
    pub fn new(geometry: BeamGeometry, beams: usize, options: Options) -> Self {
        let layout = Layout::new(&geometry, beams);
        Self { geometry, options, layout, background: Background::default(), bright: Vec::new() }
    }

    /// Replaces `out` by the reflectors of a scan, in beam order; none where a scan has other beams or no intensities.
    pub fn detect(&mut self, ranges: &[f64], intensities: &[f64], out: &mut Vec<Reflector>) {
        out.clear();
        let beams = self.layout.beams;
        if intensities.len() != ranges.len() || ranges.len() < beams {
            return;
        }
        let hits = (0..beams).filter(|&i| self.geometry.is_hit(ranges[i]));
        if !self.background.learn(hits.map(|i| (ranges[i], intensities[i]))) {
            return;
        }
        let Options { range_min, range_max, contrast, spread_factor, .. } = self.options;
        let least = contrast.ln().max(spread_factor * self.background.spread());
        self.background.expect(least);
        let is_bright = |i: usize| {
            let (range, intensity) = (ranges[i], intensities[i]);
            let within = self.geometry.is_hit(range) && range >= range_min && range <= range_max;
            within && self.background.may_exceed(range, intensity) && self.background.excess(range, intensity) >= least
        };
        self.bright.clear();
        self.bright.extend((0..beams).map(is_bright));
        let Self { geometry, options, layout, background, bright } = self;
        Search { ranges, intensities, geometry, options, layout, background, bright }.marks(out);
    }
}

/// One scan under search.
struct Search<'a> {
    ranges: &'a [f64],
    intensities: &'a [f64],
    geometry: &'a BeamGeometry,
    options: &'a Options,
    layout: &'a Layout,
    background: &'a Background,
    bright: &'a [bool],
}

impl Search<'_> {
    fn marks(&self, out: &mut Vec<Reflector>) {
        let runs: Vec<Vec<usize>> = self.runs().into_iter().filter(|run| self.is_mark(run)).collect();
        let excesses: Vec<f64> = runs.iter().map(|run| self.excess(run)).collect();
        let brightest = excesses.iter().copied().fold(0.0, f64::max);
        let like_others = |excess: f64| excess >= self.options.peer_share * brightest;
        let seen = runs.iter().zip(&excesses).filter(|(_, excess)| like_others(**excess));
        out.extend(seen.filter_map(|(run, excess)| self.locate(run, *excess, brightest - excess)));
        out.sort_by_key(|mark| mark.index);
    }

    /// Runs of bright beams of one surface, as positions from the start, which may exceed the last beam of a closed scan.
    fn runs(&self) -> Vec<Vec<usize>> {
        let n = self.layout.beams;
        // A closed scan is read from a dark beam on, so that no mark lies across the seam.
        let start = if self.layout.closed { (0..n).find(|&i| !self.is_bright(i)).unwrap_or(0) } else { 0 };
        let mut runs: Vec<Vec<usize>> = Vec::new();
        for k in (start..start + n).filter(|k| self.is_bright(k % n)) {
            match runs.last_mut() {
                Some(run) if run.last().is_some_and(|&last| self.go_together(last, k)) => run.push(k),
                _ => runs.push(vec![k]),
            }
        }
        runs
    }

    fn is_bright(&self, i: usize) -> bool {
        self.bright[i]
    }

    /// Whether bright beam `b` goes on with the surface of bright beam `a` before it.
    fn go_together(&self, a: usize, b: usize) -> bool {
        let n = self.layout.beams;
        let bridged = b == a + 1 || (b == a + 2 && !self.geometry.is_hit(self.ranges[(a + 1) % n]));
        let (near, far) = (self.ranges[a % n], self.ranges[b % n]);
        let slope = STEEPEST * (b - a) as f64 * self.layout.step * near.min(far);
        bridged && (near - far).abs() <= slope.max(STEP_SIGMAS * self.options.range_noise)
    }

    /// Mean excess of the logarithm of its intensities.
    fn excess(&self, run: &[usize]) -> f64 {
        let n = self.layout.beams;
        run.iter().map(|k| self.background.excess(self.ranges[k % n], self.intensities[k % n])).sum::<f64>()
            / run.len() as f64
    }

    /// Distance of neighbouring beams at a run, across the line of sight [m].
    fn spacing(&self, run: &[usize]) -> f64 {
        let n = self.layout.beams;
        run.iter().map(|k| self.ranges[k % n]).sum::<f64>() / run.len() as f64 * self.layout.step
    }

    /// Whether a run has the width of a mark and both ends in view.
    fn is_mark(&self, run: &[usize]) -> bool {
        let (Some(&first), Some(&last)) = (run.first(), run.last()) else { return false };
        let n = self.layout.beams;
        let spacing = self.spacing(run);
        let width = (last - first + 1) as f64 * spacing;
        let least = (LEAST_SHARE * self.options.width_min / spacing).floor().max(1.0);
        let wide = width - spacing <= self.options.width_max && run.len() as f64 >= least;
        wide && self.is_open(first, -1, self.ranges[first % n]) && self.is_open(last, 1, self.ranges[last % n])
    }

    /// Whether the beam next to `end` shows that the mark ends there: it is in the scan, and nothing nearer hides an edge.
    fn is_open(&self, end: usize, side: i64, range: f64) -> bool {
        let (n, next) = (self.layout.beams as i64, end as i64 + side);
        if !self.layout.closed && !(0..n).contains(&next) {
            return false;
        }
        let next = next.rem_euclid(n) as usize;
        let visible = !self.geometry.is_hit(self.ranges[next]) || self.ranges[next] > range - HIDES;
        visible && !self.is_bright(next)
    }

    /// The mark of a run; `dimness` is by how much the logarithm of its intensities falls short of the brightest mark's.
    fn locate(&self, run: &[usize], excess: f64, dimness: f64) -> Option<Reflector> {
        let (first, last) = (*run.first()?, *run.last()?);
        let n = self.layout.beams;
        let middle = (first + last) as f64 / 2.0;
        let bearing = |k: f64| (k - middle) * self.layout.step;
        let hits: Vec<(f64, f64)> = run.iter().map(|&k| (bearing(k as f64), self.ranges[k % n])).collect();
        let ends = (bearing(first as f64 - 0.5), bearing(last as f64 + 0.5));
        let located = locate(&Run { hits: &hits, ends, step: self.layout.step, dimness }, self.options);
        let rotation = So2::exp(self.geometry.angle_min + middle * self.geometry.angle_increment);
        let turn = self.layout.turn;
        let mut local = located.covariance;
        local.m12 *= turn;
        local.m21 *= turn;
        Some(Reflector {
            index: ((first + last) / 2) % n,
            point: rotation.act(Vector2::new(located.center.x, turn * located.center.y)),
            covariance: rotation.matrix() * local * rotation.matrix().transpose(),
            post: located.post,
            width: (last - first + 1) as f64 * self.spacing(run),
            contrast: excess.exp(),
        })
    }
}

//! How the beams of a scanner lie: the bearing step, whether the scan closes, how far a neighbourhood may reach.

use groma_models::BeamGeometry;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Beams of one scanner as the detector sees them: in index order, `step` apart.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Beams in use: all, or one turn of them where the last repeat the first.
    pub beams: usize,
    /// Whether beam 0 follows the last one.
    pub closed: bool,
    /// Bearing step, positive [rad].
    pub step: f64,
    /// +1 where bearings grow with the index, -1 where they fall.
    pub turn: f64,
    /// `cos(k step)` and `sin(k step)`, k = 0 to a quarter turn or to the last beam.
    pub cos: Vec<f64>,
    pub sin: Vec<f64>,
}

impl Layout {
    /// A scanner without a usable bearing step has no beams.
    pub fn new(geometry: &BeamGeometry, beams: usize) -> Self {
        let step = geometry.angle_increment.abs();
        if !(step > 0.0 && step < FRAC_PI_2) {
            return Self { beams: 0, closed: false, step: 1.0, turn: 1.0, cos: vec![1.0], sin: vec![0.0] };
        }
        // One missing beam does not open a turn: many drivers round the step or leave the last beam out.
        let closed = (beams as f64 + 1.0) * step > TAU;
        let beams = if closed { beams.min((TAU / step).round() as usize) } else { beams };
        let reach = ((FRAC_PI_2 / step) as usize + 1).min(beams.saturating_sub(1));
        let (sin, cos) = (0..=reach).map(|k| (k as f64 * step).sin_cos()).unzip();
        Self { beams, closed, step, turn: geometry.angle_increment.signum(), cos, sin }
    }

    /// Most beams between a corner and its neighbour: within a quarter turn, as a radius is below the range.
    #[inline(always)]
    pub fn reach(&self) -> usize {
        self.cos.len() - 1
    }

    /// A bound of the index distance of a neighbour at `ratio` = radius / range, the bearing of which is within
    /// `asin(z) <= z + z^3 / 4` (z <= 0.8). Across the seam of a closed scan two beams may be closer than a step.
    #[inline(always)]
    pub fn reach_at(&self, ratio: f64) -> usize {
        let bearing = if ratio <= 0.8 { ratio + 0.25 * ratio.powi(3) } else { FRAC_PI_2 };
        let spare = if self.closed { 1.0 } else { 1e-6 };
        ((bearing / self.step + spare) as usize).min(self.reach())
    }
}

/// The ranges of a scan with a margin of `reach` on both sides: the far end of a closed scan, NaN of an open one.
///
/// What is no hit is NaN, so that every comparison with it fails.
#[derive(Clone, Debug, Default)]
pub(crate) struct PaddedRanges {
    values: Vec<f64>,
    margin: usize,
}

impl PaddedRanges {
    /// Take over the hits of a scan; beams the scan lacks are no hits.
    #[inline(always)]
    pub fn load(&mut self, ranges: &[f64], geometry: &BeamGeometry, layout: &Layout, extra: usize) {
        let (n, margin) = (layout.beams, layout.reach());
        self.margin = margin;
        self.values.clear();
        self.values.resize(n + 2 * margin + extra, f64::NAN);
        let beams = &mut self.values[margin..margin + n.min(ranges.len())];
        let ranges = &ranges[..beams.len()];
        for i in 0..beams.len() {
            beams[i] = if geometry.is_hit(ranges[i]) { ranges[i] } else { f64::NAN };
        }
        if layout.closed {
            self.values.copy_within(n..n + margin, 0);
            self.values.copy_within(margin..2 * margin, margin + n);
        }
    }

    /// Beam 0 and all after it, margin included.
    #[inline(always)]
    pub fn at_and_after(&self, i: usize) -> &[f64] {
        &self.values[self.margin + i..]
    }

    /// The first `n` beams, and what is after them to fill up chunks of `lanes`.
    #[inline(always)]
    pub fn beams_and(&self, n: usize, lanes: usize) -> &[f64] {
        &self.values[self.margin..self.margin + n.next_multiple_of(lanes)]
    }

    /// All before beam `i`, margin included.
    #[inline(always)]
    pub fn before(&self, i: usize) -> &[f64] {
        &self.values[..self.margin + i]
    }

    /// The shortest range of the first `n` beams.
    pub fn nearest(&self, n: usize) -> f64 {
        let beams = &self.values[self.margin..self.margin + n];
        beams.iter().fold(f64::INFINITY, |least, rho| if *rho < least { *rho } else { least })
    }

    /// Range of beam `i`.
    #[inline(always)]
    pub fn at(&self, i: usize) -> f64 {
        self.values[self.margin + i]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reach_holds_every_neighbour() {
        for (closed_by, beams) in [(TAU, 3600), (3.0, 3000)] {
            let step = closed_by / 3600.0;
            let geometry = BeamGeometry {
                angle_min: 0.0,
                angle_increment: step,
                time_increment: 0.0,
                range_min: 0.0,
                range_max: 1.0,
            };
            let layout = Layout::new(&geometry, beams);
            assert_eq!(layout.closed, closed_by > 6.0);
            for ratio in (1..1000).map(|k| f64::from(k) / 1000.0) {
                let most = (ratio.asin() / step) as usize;
                assert!(layout.reach_at(ratio) >= most && layout.reach_at(0.1) < 240, "{ratio}");
            }
        }
    }
}

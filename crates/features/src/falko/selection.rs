//! Which of the scored beams are corners, by a score that means the same in every scan.
//!
//! The published definition compares scores that grow with the number of neighbours, and a threshold that depends on the worst
//! corner of the same scan: one ragged object more, and other corners pass. Here
//!
//! ```text
//! score        sigma_i = (S_L + S_R) / (s/2 pairs),   pairs = N_L (N_L - 1) / 2 + N_R (N_R - 1) / 2;   0 to 1
//! threshold    sigma_i < tau
//! suppression  i is left out if a better j is a corner and |p_j - p_i| < r_i: one corner a neighbourhood
//! better       lower sigma; of equals the one with the higher triangle (H / r_i); of those the first
//! ```
//!
//! sigma is the mean distance of the sectors of two points of an arm in units of the greatest. Equal scores are common, as straight
//! arms within a sector each have 0; the height then tells the apex from its neighbours.
//!
//! Distances are by the law of cosines from ranges and the angle between the beams, so that nothing depends on where beam 0 lies;
//! beams more than a quarter turn apart are never near.

use super::layout::{Layout, PaddedRanges};
use std::cmp::Ordering;

/// A beam with a corner's triangle, scored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    pub index: usize,
    /// sigma, and H / r squared.
    pub score: f64,
    pub height_sq: f64,
    /// Radius of the neighbourhood [m].
    pub radius: f64,
}

impl Ranked {
    fn better_first(&self, other: &Self) -> Ordering {
        let by_score = self.score.total_cmp(&other.score);
        by_score.then(other.height_sq.total_cmp(&self.height_sq)).then(self.index.cmp(&other.index))
    }
}

/// The choice over one scan.
pub(super) struct Selection<'a> {
    pub ranges: &'a PaddedRanges,
    pub layout: &'a Layout,
    /// tau.
    pub threshold: f64,
}

impl Selection<'_> {
    /// The corners among the ranked, in index order.
    pub fn corners(&self, ranked: &mut Vec<Ranked>, corners: &mut Vec<usize>) {
        corners.clear();
        ranked.retain(|r| r.score < self.threshold);
        ranked.sort_unstable_by(Ranked::better_first);
        for r in ranked.iter() {
            if corners.iter().all(|&corner| self.apart(corner, r)) {
                corners.push(r.index);
            }
        }
        corners.sort_unstable();
    }

    /// Whether a better corner is outside the neighbourhood of a beam.
    fn apart(&self, better: usize, beam: &Ranked) -> bool {
        let steps = better.abs_diff(beam.index);
        let steps = if self.layout.closed { steps.min(self.layout.beams - steps) } else { steps };
        let (a, b) = (self.ranges.at(better), self.ranges.at(beam.index));
        let distance_sq = |cos: &f64| (a - b) * (a - b) + 2.0 * a * b * (1.0 - cos);
        self.layout.cos.get(steps).map(distance_sq).is_none_or(|d| d >= beam.radius * beam.radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;
    use std::f64::consts::TAU;

    fn geometry(increment: f64) -> BeamGeometry {
        BeamGeometry { angle_min: 0.0, angle_increment: increment, time_increment: 0.0, range_min: 0.1, range_max: 9.0 }
    }

    fn select(beams: usize, increment: f64, ranked: &[(usize, f64, f64)]) -> Vec<usize> {
        let (geometry, mut ranges) = (geometry(increment), PaddedRanges::default());
        let layout = Layout::new(&geometry, beams);
        ranges.load(&vec![2.0; beams], &geometry, &layout, 0);
        let ranked = ranked.iter().map(|&(index, score, height_sq)| Ranked { index, score, height_sq, radius: 0.1 });
        let (mut ranked, mut corners) = (ranked.collect(), Vec::new());
        Selection { ranges: &ranges, layout: &layout, threshold: 0.25 }.corners(&mut ranked, &mut corners);
        corners
    }

    #[test]
    fn the_best_within_the_radius_stays() {
        // Beams are 0.02 m apart: five steps are as far as the radius.
        let corners =
            select(300, 0.01, &[(10, 0.1, 0.5), (13, 0.05, 0.1), (18, 0.2, 0.9), (19, 0.06, 0.3), (100, 0.25, 1.0)]);
        assert_eq!(corners, [13, 19]);
    }

    #[test]
    fn of_equal_scores_the_higher_triangle_stays() {
        assert_eq!(
            select(300, 0.01, &[(10, 0.0, 0.5), (11, 0.0, 0.7), (12, 0.0, 0.6), (200, 0.0, 0.2), (201, 0.0, 0.2)]),
            [11, 200]
        );
    }

    #[test]
    fn there_is_no_seam() {
        assert_eq!(select(628, TAU / 628.0, &[(1, 0.1, 0.5), (627, 0.0, 0.5), (300, 0.1, 0.4)]), [300, 627]);
        assert_eq!(select(400, TAU / 628.0, &[(1, 0.1, 0.5), (399, 0.0, 0.5)]), [1, 399]);
    }
}

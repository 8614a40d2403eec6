//! Non-maximum suppression along the scan, by a forward search.
//!
//! `q_i >= 0` is the quality of beam i, 0 for all but the candidates. The window of a beam is the index distance within
//! which the suppression radius r reaches: `w_i = floor(asin(r / rho_i) / d)`, with 0.8 for the ratio where r >= rho_i.
//!
//! ```text
//! i = last = 0
//! while i < n:
//!     if last + w_i < i:  last = i and the search begins at i - w_i, otherwise at i
//!     j = best of the search up to i + w_i  (i unless strictly better; the earliest of equals)
//!     if q_j >= q_last:  last = j
//!     i is a peak if last = i and q_i > threshold
//!     i = max(j, i + 1)
//! ```
//!
//! Nearly, but not exactly, "no better beam within the window": windows of neighbouring beams differ, and the search
//! jumps. It is the published procedure, without its merging of consecutive peaks of equal quality.
//! A closed scan is searched from its best candidate on, so that where beam 0 lies does not matter.

use super::layout::{Layout, PaddedRanges};

/// A beam that may be a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub index: usize,
    pub quality: u64,
}

/// The search over one scan.
pub(super) struct Search<'a> {
    pub ranges: &'a PaddedRanges,
    pub layout: &'a Layout,
    /// Suppression radius [m].
    pub radius: f64,
    pub threshold: u64,
    /// The largest window of all beams.
    pub widest: usize,
}

impl Search<'_> {
    /// The peaks among the candidates (sorted by index), in index order.
    pub fn peaks(&self, candidates: &mut Vec<Candidate>, peaks: &mut Vec<usize>) {
        peaks.clear();
        if !self.layout.closed {
            return self.forward(candidates, 0, peaks);
        }
        if let Some(start) = best_to_start(candidates, self.layout.beams) {
            unroll(candidates, start, self.layout.beams);
            self.forward(candidates, candidates[0].index, peaks);
            peaks.iter_mut().for_each(|i| *i %= self.layout.beams);
            peaks.sort_unstable();
        }
    }

    /// One turn of the search from beam `start`.
    fn forward(&self, candidates: &[Candidate], start: usize, peaks: &mut Vec<usize>) {
        let mut i = start;
        let mut last = Candidate { index: start, quality: 0 };
        let mut next = 0; // first candidate not before i
        while i < start + self.layout.beams {
            while next < candidates.len() && candidates[next].index < i {
                next += 1;
            }
            if next == candidates.len() {
                return; // no candidate left that could be a peak
            }
            if let Some(empty) = self.empty_until(candidates[next].index, i, last) {
                (i, last) = (empty, Candidate { index: empty - 1, quality: 0 });
            }
            let here = candidates.get(next).filter(|c| c.index == i).map_or(0, |c| c.quality);
            let mut best = Candidate { index: i, quality: here };
            if !self.reaches(i, i - last.index) {
                last = best;
                best = self.best_behind(&candidates[..next], best);
            }
            best = self.best_ahead(&candidates[next..], i, best);
            if best.quality >= last.quality {
                last = best;
            }
            if last.index == i && here > self.threshold {
                peaks.push(i);
            }
            i = best.index.max(i + 1);
        }
    }

    /// The beam from which on candidates matter, if that is ahead: between candidates farther apart than any window the
    /// search finds nothing, beam by beam.
    fn empty_until(&self, next: usize, i: usize, last: Candidate) -> Option<usize> {
        let empty = next.saturating_sub(self.widest + 1);
        (empty > i && empty > last.index + self.widest + 1).then_some(empty)
    }

    /// The best candidate within the window before `own`; own unless strictly better.
    fn best_behind(&self, before: &[Candidate], own: Candidate) -> Candidate {
        let near = before.iter().rev().take_while(|c| self.reaches(own.index, own.index - c.index));
        near.fold(own, |best, &c| {
            let earlier_of_equals = c.quality == best.quality && best.index != own.index;
            if c.quality > best.quality || earlier_of_equals { c } else { best }
        })
    }

    /// The best candidate within the window of beam `i` and after it; `best` unless strictly better.
    fn best_ahead(&self, after: &[Candidate], i: usize, best: Candidate) -> Candidate {
        let near = after.iter().take_while(|c| self.reaches(i, c.index - i));
        near.fold(best, |best, &c| if c.quality > best.quality { c } else { best })
    }

    /// Whether `distance` beams are within the window of beam `i`: rho sin(distance d) <= r, without an arc sine.
    fn reaches(&self, i: usize, distance: usize) -> bool {
        let rho = self.ranges.at(if i < self.layout.beams { i } else { i - self.layout.beams });
        let rho = if rho <= self.radius { self.radius / 0.8 } else { rho };
        distance == 0 || self.layout.sin.get(distance).is_some_and(|sin| rho * sin <= self.radius)
    }
}

/// Position in the list of the best candidate; of equals the one with the longest way to the candidate before it.
fn best_to_start(candidates: &[Candidate], beams: usize) -> Option<usize> {
    let way = |k: usize| match k {
        0 => candidates[0].index + beams - candidates[candidates.len() - 1].index,
        _ => candidates[k].index - candidates[k - 1].index,
    };
    (0..candidates.len()).max_by_key(|&k| (candidates[k].quality, way(k)))
}

/// Turn the list so that it begins at `start` and ends with the same beam one turn later.
fn unroll(candidates: &mut Vec<Candidate>, start: usize, beams: usize) {
    candidates.rotate_left(start);
    let first = candidates[0];
    candidates.iter_mut().filter(|c| c.index < first.index).for_each(|c| c.index += beams);
    candidates.push(Candidate { index: first.index + beams, quality: first.quality });
}

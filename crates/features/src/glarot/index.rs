//! The signatures nearest to a given one, exactly, without comparing with all of them.
//!
//! Two bounds of the distance come before it. Turning a set does not change the distribution of its lengths alone, and half the
//! bins differ by no more than all (see `halves.rs`):
//!
//! ```text
//! sum_r | g(r) - f(r) |  <=  sum_{b, r} | G(b, r) - F(b + t, r) |    for every shift t,    g(r) = sum_b G(b, r)
//! bound of the halves at t  <=  sum_{b, r} | G(b, r) - F(b + t, r) |
//! ```
//!
//! The k signatures of least first bound are compared in full, then, of the others that this bound lets pass, the k of least second
//! bound; the rest in turn where the second bound is within the k-th best distance so far, and only at the shifts where it is. A
//! signature is left out only if it is farther than k others: the result is that of comparing with all. Equal distances are
//! distinguished by the order of adding.
//!
//! Signatures lie end to end in memory, as a query is over sooner than ten thousand of them could be fetched one by one.

use super::Signature;
use super::difference::{Doubled, Line, l1, lines};
use super::halves::{GROUP, Halves, words_per_row};
use super::signature::{rotation, share};
use pulp::{Arch, Simd, WithSimd};
use std::collections::BinaryHeap;

/// A signature near the query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Which one, in the order of adding.
    pub index: usize,
    /// Distance, 0 to 1.
    pub distance: f64,
    /// Rotation that takes the points of the query onto those of the candidate, up to half a turn [rad].
    pub rotation: f64,
}

/// A growing collection of signatures with the bins of the first one that has pairs; others keep their place and are never found.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// Bins over direction and length.
    shape: Option<(usize, usize)>,
    /// Whether the signature at a place can be found; the others are zeros.
    usable: Vec<bool>,
    marginals: Vec<Line>,
    halves: Halves,
    bins: Vec<Line>,
}

/// Distance, place and shift of a signature visited: ordered as they are ranked.
type Visited = (u16, usize, usize);

/// A bound of the distance of the signature at a place.
type Bound = (u16, usize);

impl Index {
    /// An index of nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Add a signature; the place it gets.
    pub fn add(&mut self, signature: &Signature) -> usize {
        let shape = (signature.n_theta, signature.n_rho);
        let usable = !signature.is_empty() && *self.shape.get_or_insert(shape) == shape;
        self.usable.push(usable);
        let place = self.usable.len() - 1;
        if usable {
            put(&mut self.marginals, place, &signature.marginal);
            put(&mut self.bins, place, &signature.bins);
            self.halves.set(place, &signature.halves);
        }
        place
    }

    /// Number of signatures.
    #[must_use]
    pub fn len(&self) -> usize {
        self.usable.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.usable.is_empty()
    }

    /// The `k` nearest among those that pass the filter, nearest first; none that has no pairs or other bins.
    #[must_use]
    pub fn query(&self, query: &Signature, k: usize, filter: impl Fn(usize) -> bool) -> Vec<Candidate> {
        if k == 0 || query.is_empty() || self.shape != Some((query.n_theta, query.n_rho)) {
            return Vec::new();
        }
        let passing = (0..self.len()).filter(|&i| self.usable[i] && filter(i)).collect();
        Arch::new().dispatch(Search::new(self, query, k, passing))
    }
}

/// Put lines at the place of their signature, zeros at those between that have none.
fn put(all: &mut Vec<Line>, place: usize, lines: &[Line]) {
    all.resize(place * lines.len(), Line::ZERO);
    all.extend(lines);
}

/// One query, compiled for each instruction set.
struct Search<'a> {
    index: &'a Index,
    query: &'a Signature,
    half: Doubled<u64>,
    whole: Doubled<Line>,
    k: usize,
    passing: Vec<usize>,
    /// Of the signatures that the lengths let pass, the bounds at every shift.
    by_half: Vec<[u16; GROUP]>,
    /// The nearest so far, the worst on top.
    best: BinaryHeap<Visited>,
}

impl WithSimd for Search<'_> {
    type Output = Vec<Candidate>;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> Vec<Candidate> {
        let mut by_length = Vec::with_capacity(self.passing.len());
        for &i in &self.passing {
            by_length.push((self.bound_by_length(i), i));
        }
        let (likely, rest) = least(&mut by_length, self.k);
        for &(_, i) in likely {
            self.visit(i, |_| true);
        }
        let mut by_half = self.bounds_by_half(rest);
        let (likely, rest) = least(&mut by_half, self.k);
        for &(bound, i) in likely.iter().chain(rest) {
            let worst = self.worst();
            if bound <= worst {
                let (group, lane) = (i / GROUP * self.query.n_theta, i % GROUP);
                let bounds = std::mem::take(&mut self.by_half);
                self.visit(i, |shift| bounds[group + shift][lane] <= worst);
                self.by_half = bounds;
            }
        }
        std::mem::take(&mut self.best).into_sorted_vec().into_iter().map(|visited| self.candidate(visited)).collect()
    }
}

/// The k of least bound; the others.
fn least(bounds: &mut [Bound], k: usize) -> (&[Bound], &[Bound]) {
    if k < bounds.len() {
        bounds.select_nth_unstable(k);
    }
    bounds.split_at(k.min(bounds.len()))
}

impl<'a> Search<'a> {
    fn new(index: &'a Index, query: &'a Signature, k: usize, passing: Vec<usize>) -> Self {
        Self {
            index,
            query,
            half: Doubled::new(&query.halves, words_per_row(query.n_rho)),
            whole: Doubled::new(&query.bins, lines(query.n_rho)),
            k,
            passing,
            by_half: Vec::new(),
            best: BinaryHeap::with_capacity(k.min(index.len()) + 1),
        }
    }

    #[inline(always)]
    fn bound_by_length(&self, i: usize) -> u16 {
        let own = &self.query.marginal;
        l1(own, &self.index.marginals[i * own.len()..][..own.len()])
    }

    /// Of the signatures that their lengths let pass, the bound at the best shift; those at every shift are kept.
    fn bounds_by_half(&mut self, by_length: &[Bound]) -> Vec<Bound> {
        let (worst, n_theta) = (self.worst(), self.query.n_theta);
        let groups = self.index.len().div_ceil(GROUP);
        self.by_half = vec![[0; GROUP]; groups * n_theta];
        let (mut done, mut bounds) = (vec![false; groups], Vec::with_capacity(by_length.len()));
        for &(_, i) in by_length.iter().filter(|(bound, _)| *bound <= worst) {
            let (group, lane) = (i / GROUP, i % GROUP);
            let of_group = &mut self.by_half[group * n_theta..][..n_theta];
            if !std::mem::replace(&mut done[group], true) {
                self.index.halves.bounds(group, &self.half, of_group);
            }
            bounds.push((of_group.iter().map(|shift| shift[lane]).min().unwrap_or(0), i));
        }
        bounds
    }

    #[inline(always)]
    fn at(&self, shift: usize, i: usize) -> u16 {
        let whole = self.whole.shifted(shift);
        l1(whole, &self.index.bins[i * whole.len()..][..whole.len()])
    }

    /// Distance of the k-th best so far.
    #[inline(always)]
    fn worst(&self) -> u16 {
        self.best.peek().filter(|_| self.best.len() == self.k).map_or(u16::MAX, |worst| worst.0)
    }

    /// Compare at the shifts that can be among the best.
    #[inline(always)]
    fn visit(&mut self, i: usize, can: impl Fn(usize) -> bool) {
        let mut nearest = None;
        for shift in 0..self.query.n_theta {
            if can(shift) {
                let visited = (self.at(shift, i), i, shift);
                nearest = Some(nearest.map_or(visited, |n: Visited| n.min(visited)));
            }
        }
        self.best.extend(nearest);
        if self.best.len() > self.k {
            self.best.pop();
        }
    }

    fn candidate(&self, (l1, index, shift): Visited) -> Candidate {
        let n = self.query.n_theta;
        let around = [n - 1, 0, 1].map(|step| self.at((shift + step) % n, index));
        let rotation = rotation(n, shift, around);
        Candidate { index, distance: share(l1), rotation }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::glarot::Options;
    use nalgebra::Vector2;
    use proptest::prelude::*;

    fn signatures() -> impl Strategy<Value = Vec<Signature>> {
        // Coordinates on a coarse lattice: equal distances, empty sets and twins do occur.
        let point = (0..6, 0..6).prop_map(|(x, y)| Vector2::new(f64::from(x), f64::from(y)));
        let set = prop::collection::vec(point, 0..6);
        prop::collection::vec(set.prop_map(|p| Signature::from_points(&p, &Options::default())), 1..60)
    }

    proptest! {
        #[test]
        fn equals_brute_force(all in signatures(), k in 0_usize..12, modulus in 1_usize..4) {
            let mut index = Index::new();
            for signature in &all[1..] {
                index.add(signature);
            }
            let filter = |i: usize| i.is_multiple_of(modulus);
            let mut brute: Vec<_> = (0..index.len())
                .filter(|&i| filter(i))
                .map(|i| (all[0].compare(&all[i + 1]).0, i))
                .filter(|v| v.0 < u16::MAX)
                .collect();
            brute.sort_unstable();
            brute.truncate(k);
            let found = index.query(&all[0], k, filter);
            prop_assert_eq!(found.iter().map(|c| c.index).collect::<Vec<_>>(), brute.iter().map(|v| v.1).collect::<Vec<_>>());
            for (candidate, (l1, i)) in found.iter().zip(&brute) {
                prop_assert_eq!(candidate.distance, share(*l1));
                prop_assert_eq!(candidate.rotation, all[0].difference(&all[i + 1]).rotation);
            }
        }
    }
}

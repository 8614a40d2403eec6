//! The signatures nearest to a given one, exactly, without comparing with all of them.
//!
//! Turning a set does not change the distribution of its lengths alone, so for every shift
//!
//! ```text
//! sum_r | g(r) - f(r) |  <=  sum_{b, r} | G(b, r) - F(b + t, r) |,     g(r) = sum_b G(b, r)
//! ```
//!
//! The marginals are compared with all (a fraction 1 / n_theta^2 of the work), then the signatures are visited in the
//! order of that bound until it exceeds the k-th best distance. Equal distances are told apart by the order of adding.

use super::Signature;
use super::signature::share;
use std::cmp::Reverse;
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

/// A growing collection of signatures.
#[derive(Clone, Debug, Default)]
pub struct Index {
    signatures: Vec<Signature>,
}

/// Distance, place and shift of a signature visited: ordered as they are ranked.
type Visited = (u16, usize, usize);

impl Index {
    /// An index of nothing.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Add a signature; the place it gets.
    pub fn add(&mut self, signature: Signature) -> usize {
        self.signatures.push(signature);
        self.signatures.len() - 1
    }

    /// The signature at a place.
    #[must_use]
    pub fn get(&self, index: usize) -> Option<&Signature> {
        self.signatures.get(index)
    }

    /// Number of signatures.
    #[must_use]
    pub fn len(&self) -> usize {
        self.signatures.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.signatures.is_empty()
    }

    /// The `k` nearest among those that pass the filter, nearest first; none at distance 1.
    #[must_use]
    pub fn query(&self, query: &Signature, k: usize, filter: impl Fn(usize) -> bool) -> Vec<Candidate> {
        let passing = self.signatures.iter().enumerate().filter(|(i, _)| filter(*i));
        let bounds = passing.map(|(i, s)| Reverse((query.bound(s), i))).filter(|b| b.0.0 < u16::MAX);
        let mut queue: BinaryHeap<_> = bounds.collect();
        let mut best: BinaryHeap<Visited> = BinaryHeap::with_capacity(k + 1);
        while let Some(Reverse((bound, i))) = queue.pop() {
            if best.len() == k && best.peek().is_none_or(|worst| bound > worst.0) {
                break;
            }
            let (l1, shift) = query.best_shift(&self.signatures[i]);
            best.push((l1, i, shift));
            if best.len() > k {
                best.pop();
            }
        }
        best.into_sorted_vec().into_iter().map(|visited| self.candidate(query, visited)).collect()
    }

    fn candidate(&self, query: &Signature, (l1, index, shift): Visited) -> Candidate {
        Candidate { index, distance: share(l1), rotation: query.rotation(&self.signatures[index], shift) }
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
                index.add(signature.clone());
            }
            let filter = |i: usize| i.is_multiple_of(modulus);
            let mut brute: Vec<_> = (0..index.len())
                .filter(|&i| filter(i))
                .map(|i| (all[0].best_shift(&all[i + 1]).0, i))
                .filter(|v| v.0 < u16::MAX)
                .collect();
            brute.sort_unstable();
            brute.truncate(k);
            let found = index.query(&all[0], k, filter);
            prop_assert_eq!(found.iter().map(|c| c.index).collect::<Vec<_>>(), brute.iter().map(|v| v.1).collect::<Vec<_>>());
            for (candidate, (l1, i)) in found.iter().zip(&brute) {
                prop_assert_eq!(candidate.distance, share(*l1));
                prop_assert_eq!(candidate.rotation, all[0].distance(&all[i + 1]).1);
            }
        }
    }
}

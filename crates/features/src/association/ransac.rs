//! Motions from pairs of landmarks of equal length, drawn at random.
//!
//! A draw takes a pair of a, uniformly, a pair of b of the same length to the tolerance, uniformly, and either way round;
//! the motion that puts the one onto the other is kept when enough landmarks of b fall near one of a. The random numbers
//! are those of the seed, so that it gives the same outcome on every machine. Source: Fischler, Bolles, CACM 24(6), 1981.

use super::problem::Problem;
use super::search::motion;
use super::segments::{Equal, segments};
use super::verify::Neighbourhood;
use groma_estimation::random::SplitMix64;
use groma_geometry::Se2;
use std::cmp::Reverse;

/// The motions drawn, those that put most landmarks near others first.
pub(super) fn propose<F: Fn(usize, usize) -> bool>(problem: &Problem<F>, seed: u64, draws: usize) -> Vec<(usize, Se2)> {
    let &Problem { a, b, options, .. } = problem;
    let (of_a, of_b) = (segments(a, options), segments(b, options));
    if of_a.is_empty() || of_b.is_empty() {
        return Vec::new();
    }
    let grid = Neighbourhood::new(a, options.tolerance);
    let mut random = SplitMix64::new(seed);
    let mut ranked = Vec::new();
    for _ in 0..draws {
        let a_drawn = of_a[random.below(of_a.len())];
        let start = of_b.partition_point(|s| s.length < a_drawn.length - options.tolerance);
        let end = of_b.partition_point(|s| s.length <= a_drawn.length + options.tolerance);
        if start == end {
            continue;
        }
        let b_drawn = of_b[start + random.below(end - start)];
        let equal = Equal { a: a_drawn, b: b_drawn, swapped: random.below(2) == 1 };
        if equal.is_allowed(&problem.compatible) {
            let motion = motion(&equal, a, b);
            ranked.push((grid.count(&motion, b), motion));
        }
    }
    ranked.retain(|(count, _)| *count >= options.min_pairs);
    ranked.sort_by_key(|(count, _)| Reverse(*count));
    ranked
}

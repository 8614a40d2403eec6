//! Mutual nearest neighbours at a motion known beforehand.
//!
//! ```text
//! (i, j) is a pair  <=>  i = argmin_k |a_k - T b_j|,  j = argmin_k |a_i - T b_k|,  |a_i - T b_j| <= tolerance
//! ```
//!
//! over the k that are compatible; of equal distances the lower index. One-to-one by being mutual, and independent of the
//! order in which pairs are looked at, which greedy pairing is not. The motion is fitted to the pairs once.

use super::problem::Problem;
use super::search::Hypothesis;
use crate::rigid_fit::rigid_fit;
use groma_geometry::Se2;

/// The hypothesis at `prior`, if it has enough pairs.
pub(super) fn pair<F: Fn(usize, usize) -> bool>(problem: &Problem<F>, prior: [f64; 3]) -> Vec<Hypothesis> {
    let (a, b, options) = (problem.a, problem.b, problem.options);
    let prior = Se2::new(prior[0], prior[1], prior[2]);
    let landed: Vec<_> = b.iter().map(|&p| prior.act(p)).collect();
    let distance = |i: usize, j: usize| {
        let d = (a[i] - landed[j]).norm();
        (d <= options.tolerance && (problem.compatible)(i, j)).then_some(d)
    };
    let of_a: Vec<_> = (0..a.len()).map(|i| nearest(b.len(), |j| distance(i, j))).collect();
    let of_b: Vec<_> = (0..b.len()).map(|j| nearest(a.len(), |i| distance(i, j))).collect();
    let mutual = |(i, j): (usize, &Option<usize>)| j.filter(|&j| of_b[j] == Some(i)).map(|j| (i, j));
    let pairs: Vec<_> = of_a.iter().enumerate().filter_map(mutual).collect();
    if pairs.len() < options.min_pairs {
        return Vec::new();
    }
    let points: Vec<_> = pairs.iter().map(|&(i, j)| (a[i], b[j])).collect();
    let fit = rigid_fit(&points, options.point_noise * std::f64::consts::SQRT_2);
    fit.map(|fit| Hypothesis::from((pairs, fit))).into_iter().collect()
}

/// The first of the nearest.
fn nearest(n: usize, distance: impl Fn(usize) -> Option<f64>) -> Option<usize> {
    let near = (0..n).filter_map(|k| distance(k).map(|d| (d, k)));
    near.min_by(|s, t| s.0.total_cmp(&t.0)).map(|(_, k)| k)
}

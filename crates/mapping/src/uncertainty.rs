//! How far the relative pose of two local maps can be trusted: covariance along the least uncertain path of the graph.
//!
//! The joint covariance of a pose graph is smaller than what any single path between two nodes gives, so a path is a safe
//! bound, and Dijkstra's search finds the best one for all nodes at once (M. Bosse et al., "An Atlas framework for
//! scalable mapping", ICRA 2003). Covariances are of right perturbations and compose as
//!
//! ```text
//! P_ac = Ad(T_bc^-1) P_ab Ad(T_bc^-1)^T + P_bc,      P_ba = Ad(T_ab) P_ab Ad(T_ab)^T
//! ```

use groma_geometry::Se2;
use nalgebra::Matrix3;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

/// Lever at which a radian costs as much as a metre in the search for the best path [m].
const LEVER: f64 = 5.0;

/// An edge with its covariance in the body frame of `to`.
#[derive(Clone, Debug)]
pub struct Link {
    /// Node a.
    pub from: usize,
    /// Node b.
    pub to: usize,
    /// `T_a_b`.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
}

/// A cost with a total order, for the queue.
#[derive(PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// Covariance of `T_source_k` for every node k, `None` where no path leads.
#[must_use]
pub fn from_source(nodes: usize, links: &[Link], source: usize) -> Vec<Option<Matrix3<f64>>> {
    let mut adjacent: Vec<Vec<(usize, Se2, Matrix3<f64>)>> = vec![Vec::new(); nodes];
    for link in links {
        let back = link.pose.adjoint() * link.covariance * link.pose.adjoint().transpose();
        adjacent[link.from].push((link.to, link.pose, link.covariance));
        adjacent[link.to].push((link.from, link.pose.inverse(), back));
    }
    let mut best: Vec<Option<Matrix3<f64>>> = vec![None; nodes];
    let mut queue = BinaryHeap::from([(Reverse(Cost(0.0)), source)]);
    let mut reached = vec![f64::INFINITY; nodes];
    let mut pending = vec![Matrix3::zeros(); nodes];
    reached[source] = 0.0;
    while let Some((_, k)) = queue.pop() {
        if best[k].is_some() {
            continue;
        }
        best[k] = Some(pending[k]);
        for (to, pose, covariance) in &adjacent[k] {
            let ad = pose.inverse().adjoint();
            let p = ad * pending[k] * ad.transpose() + covariance;
            let cost = p[(0, 0)] + p[(1, 1)] + LEVER * LEVER * p[(2, 2)];
            if cost < reached[*to] && best[*to].is_none() {
                reached[*to] = cost;
                pending[*to] = p;
                queue.push((Reverse(Cost(cost)), *to));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn link(from: usize, to: usize, variance: f64) -> Link {
        Link { from, to, pose: Se2::new(1.0, 0.0, 0.0), covariance: Matrix3::identity() * variance }
    }

    #[test]
    fn takes_the_better_path_and_knows_the_unreachable() {
        let links = [link(0, 1, 0.01), link(1, 2, 0.01), link(0, 2, 0.001)];
        let p = from_source(4, &links, 0);
        assert!((p[2].unwrap() - Matrix3::identity() * 0.001).norm() < 1e-15);
        assert!(p[3].is_none());
    }

    #[test]
    fn a_heading_error_grows_with_the_lever() {
        let p = from_source(3, &[link(0, 1, 0.01), link(1, 2, 0.01)], 0)[2].unwrap();
        // y of node 2 = its own 0.01, that of node 1, and 1 m times the heading error of node 1.
        assert!((p[(1, 1)] - 0.03).abs() < 1e-12 && (p[(0, 0)] - 0.02).abs() < 1e-12);
    }
}

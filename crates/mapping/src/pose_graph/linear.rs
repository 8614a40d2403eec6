//! The normal equations of a pose graph: `H = sum w J^T Omega J`, `g = sum w J^T Omega e`, node 0 left out.
//!
//! With `t = R_i^T (t_j - t_i)`, `M = R_z^T` and `R = R_i^T R_j`, for steps `x * exp(xi)`:
//!
//! ```text
//! J_i = [[-M, M (t_y, -t_x)^T], [0, -1]]      J_j = [[M R, 0], [0, 1]]
//! ```

use super::{Edge, PoseGraph};
use groma_estimation::BlockMatrix;
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Error of an edge with its derivatives.
pub(super) struct Linearization {
    pub error: Vector3<f64>,
    pub j_from: Matrix3<f64>,
    pub j_to: Matrix3<f64>,
}

/// The system of one graph; the pattern stays, the numbers change with the nodes and the weights.
pub(super) struct System<'a> {
    edges: &'a [Edge],
    slots: Vec<Option<usize>>,
    pub matrix: BlockMatrix<3>,
    pub gradient: Vec<Vector3<f64>>,
}

impl Edge {
    /// `e` at the poses of its ends.
    pub(super) fn error(&self, from: &Se2, to: &Se2) -> Vector3<f64> {
        let (back, unturn) = (from.rotation.inverse(), self.measurement.rotation.inverse());
        let seen = back.act(to.translation - from.translation);
        let shift = unturn.act(seen - self.measurement.translation);
        Vector3::new(shift.x, shift.y, (unturn * back * to.rotation).log())
    }

    /// `e^T Omega e` at given nodes.
    pub(super) fn chi_square(&self, nodes: &[Se2]) -> f64 {
        let e = self.error(&nodes[self.from], &nodes[self.to]);
        e.dot(&(self.information * e))
    }

    pub(super) fn linearize(&self, from: &Se2, to: &Se2) -> Linearization {
        let unturn = self.measurement.rotation.inverse();
        let seen = from.between(to);
        let m = unturn.matrix();
        let lever = unturn.act(Vector2::new(seen.translation.y, -seen.translation.x));
        let turned = (unturn * seen.rotation).matrix();
        let (mut j_from, mut j_to) = (-Matrix3::identity(), Matrix3::identity());
        j_from.fixed_view_mut::<2, 2>(0, 0).copy_from(&-m);
        j_from.fixed_view_mut::<2, 1>(0, 2).copy_from(&lever);
        j_to.fixed_view_mut::<2, 2>(0, 0).copy_from(&turned);
        Linearization { error: self.error(from, to), j_from, j_to }
    }
}

impl<'a> System<'a> {
    /// The pattern of the edges whose weight is not zero.
    pub(super) fn new(graph: &'a PoseGraph, weights: &[f64]) -> Self {
        let unknown = |e: &Edge| (e.from > 0 && e.to > 0).then(|| (e.from.min(e.to) - 1, e.from.max(e.to) - 1));
        let used = graph.edges.iter().zip(weights).filter(|(_, w)| **w > 0.0);
        let matrix = BlockMatrix::zeros(graph.nodes.len() - 1, used.filter_map(|(e, _)| unknown(e)));
        let slots = graph.edges.iter().map(|e| unknown(e).and_then(|(i, j)| matrix.slot(i, j))).collect();
        let gradient = vec![Vector3::zeros(); matrix.blocks()];
        Self { edges: &graph.edges, slots, matrix, gradient }
    }

    /// The share of the pattern that edges with these weights use; nothing when one of them is not in the pattern.
    pub(super) fn usage(&self, weights: &[f64]) -> Option<f64> {
        let mut used = vec![false; self.matrix.upper.len()];
        for ((edge, slot), weight) in self.edges.iter().zip(&self.slots).zip(weights) {
            if *weight > 0.0 && edge.from > 0 && edge.to > 0 {
                used[(*slot)?] = true;
            }
        }
        let count = used.iter().filter(|u| **u).count();
        Some(if used.is_empty() { 1.0 } else { count as f64 / used.len() as f64 })
    }

    /// Fills the system at `nodes`, each edge with its weight.
    pub(super) fn linearize(&mut self, nodes: &[Se2], weights: &[f64]) {
        self.matrix.clear();
        self.gradient.fill(Vector3::zeros());
        for (k, edge) in self.edges.iter().enumerate() {
            if weights[k] > 0.0 {
                let at = edge.linearize(&nodes[edge.from], &nodes[edge.to]);
                self.add(edge, self.slots[k], &at, edge.information * weights[k]);
            }
        }
    }

    fn add(&mut self, edge: &Edge, slot: Option<usize>, at: &Linearization, omega: Matrix3<f64>) {
        let (from, to) = (omega * at.j_from, omega * at.j_to);
        for (node, jacobian, weighted) in [(edge.from, &at.j_from, &from), (edge.to, &at.j_to, &to)] {
            if let Some(unknown) = node.checked_sub(1) {
                self.matrix.diagonal[unknown] += jacobian.tr_mul(weighted);
                self.gradient[unknown] += weighted.tr_mul(&at.error);
            }
        }
        if let Some(slot) = slot {
            let upper = if edge.from < edge.to { at.j_from.tr_mul(&to) } else { at.j_to.tr_mul(&from) };
            self.matrix.upper[slot] += upper;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobians_equal_differences() {
        let h = 1e-6;
        for k in 0..50 {
            let a = f64::from(k);
            let (from, to) = (Se2::new(a.sin() * 9.0, a, 3.0 * a), Se2::new(2.0 - a, (2.0 * a).cos(), -a));
            let measurement = Se2::new(0.3 * a, 1.0 - a, 0.7 * a);
            let edge = Edge { from: 0, to: 1, measurement, information: Matrix3::identity(), robust: false };
            let at = edge.linearize(&from, &to);
            for axis in 0..3 {
                let mut step = Vector3::zeros();
                step[axis] = h;
                let along_from = edge.error(&from.plus(step), &to) - edge.error(&from.plus(-step), &to);
                let along_to = edge.error(&from, &to.plus(step)) - edge.error(&from, &to.plus(-step));
                assert!((along_from / (2.0 * h) - at.j_from.column(axis)).amax() < 1e-6);
                assert!((along_to / (2.0 * h) - at.j_to.column(axis)).amax() < 1e-6);
            }
        }
    }
}

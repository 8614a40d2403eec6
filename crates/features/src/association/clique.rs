//! The most correspondences that agree with each other in their distances (combined constraint data association).
//!
//! ```text
//! nodes  compatible (i, j)
//! edges  (i, j) - (k, l):  i != k,  j != l,  | |a_i - a_k| - |b_j - b_l| | <= tolerance
//! clique with root (i, j): its members pairwise joined, and of one sense of turning about the root:
//!        (a_k - a_i) x (a_m - a_i) and (b_l - b_j) x (b_n - b_j) of one sign, unless either point is within the tolerance
//!        of the line through the other and the root
//! ```
//!
//! Distances cannot tell a set from its mirror image; the sense of turning can, so mirror images are no cliques here. The
//! maximum clique is found by branch and bound: for each root the nodes after it, as bits, and a greedy colouring as the
//! bound (Tomita, Seki 2003, with bitsets after San Segundo et al. 2011). The time is exponential at worst: after
//! `max_steps` the best so far is taken, and the search counts as cut short.
//!
//! Source: T. Bailey, "Mobile robot localisation and mapping in extensive outdoor environments", thesis, 2002.

use super::problem::{Problem, Proposed};
use crate::rigid_fit::rigid_fit;
use nalgebra::Vector2;

/// The motion of the maximum clique, the first found of equal ones.
pub(super) fn propose<F: Fn(usize, usize) -> bool>(problem: &Problem<F>, max_steps: usize) -> Proposed {
    let &Problem { a, b, options, .. } = problem;
    let all = (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| (i, j)));
    let nodes: Vec<Pair> =
        all.filter(|&(i, j)| (problem.compatible)(i, j)).map(|(i, j)| Pair { i, j, a: a[i], b: b[j] }).collect();
    let mut steps = Steps { left: max_steps };
    let mut best: Vec<Pair> = Vec::new();
    for root in 0..nodes.len() {
        if steps.left == 0 {
            break;
        }
        grow(&nodes[root], &nodes[root + 1..], options.tolerance, &mut best, &mut steps);
    }
    let points: Vec<_> = best.iter().map(|p| (p.a, p.b)).collect();
    let fit = rigid_fit(&points, options.point_noise).filter(|_| best.len() >= options.min_pairs);
    (fit.map(|f| (best.len(), f.transform)).into_iter().collect(), steps.left > 0)
}

/// A correspondence.
#[derive(Clone, Copy, Debug)]
struct Pair {
    i: usize,
    j: usize,
    a: Vector2<f64>,
    b: Vector2<f64>,
}

/// What may still be done.
struct Steps {
    left: usize,
}

impl Steps {
    fn spend(&mut self, steps: usize) {
        self.left = self.left.saturating_sub(steps);
    }
}

impl Pair {
    fn agrees(&self, other: &Self, tolerance: f64) -> bool {
        let apart = (self.a - other.a).norm() - (self.b - other.b).norm();
        self.i != other.i && self.j != other.j && apart.abs() <= tolerance
    }

    /// Whether `p` and `q` turn about self in the same sense in both sets, as far as that can be decided.
    fn turns_alike(&self, p: &Self, q: &Self, tolerance: f64) -> bool {
        let (of_a, clear_a) = sense(p.a - self.a, q.a - self.a, tolerance);
        let (of_b, clear_b) = sense(p.b - self.b, q.b - self.b, tolerance);
        !(clear_a && clear_b) || (of_a > 0.0) == (of_b > 0.0)
    }
}

/// Cross product of two arms, and whether both ends are farther than the tolerance from the line of the other.
fn sense(p: Vector2<f64>, q: Vector2<f64>, tolerance: f64) -> (f64, bool) {
    let cross = p.perp(&q);
    (cross, cross.abs() > tolerance * p.norm().max(q.norm()))
}

/// Replace `best` by a larger clique of the root and some of `later`, if there is one.
fn grow(root: &Pair, later: &[Pair], tolerance: f64, best: &mut Vec<Pair>, steps: &mut Steps) {
    steps.spend(later.len() + 1);
    let near: Vec<Pair> = later.iter().filter(|p| root.agrees(p, tolerance)).copied().collect();
    if near.len() < best.len() {
        return;
    }
    steps.spend(near.len() * near.len() / 2);
    let joined = |p: &Pair, q: &Pair| p.agrees(q, tolerance) && root.turns_alike(p, q, tolerance);
    let graph = Graph::new(&near, joined);
    let mut search = Search { graph: &graph, best: Vec::new(), at_least: best.len(), steps };
    search.expand(&mut Vec::new(), Bits::full(near.len()));
    if !search.best.is_empty() || best.is_empty() {
        *best = std::iter::once(*root).chain(search.best.iter().map(|&v| near[v])).collect();
    }
}

/// A set of nodes.
#[derive(Clone, Debug)]
struct Bits(Vec<u64>);

impl Bits {
    fn empty(n: usize) -> Self {
        Self(vec![0; n.div_ceil(64)])
    }

    fn full(n: usize) -> Self {
        let mut all = Self::empty(n);
        (0..n).for_each(|k| all.insert(k));
        all
    }

    fn insert(&mut self, k: usize) {
        self.0[k / 64] |= 1 << (k % 64);
    }

    fn remove(&mut self, k: usize) {
        self.0[k / 64] &= !(1 << (k % 64));
    }

    fn first(&self) -> Option<usize> {
        let word = self.0.iter().position(|w| *w != 0)?;
        Some(word * 64 + self.0[word].trailing_zeros() as usize)
    }

    fn and(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(s, t)| s & t).collect())
    }

    fn subtract(&mut self, other: &Self) {
        self.0.iter_mut().zip(&other.0).for_each(|(s, t)| *s &= !t);
    }
}

/// Who is joined to whom.
struct Graph {
    adjacent: Vec<Bits>,
}

impl Graph {
    fn new(nodes: &[Pair], joined: impl Fn(&Pair, &Pair) -> bool) -> Self {
        let mut adjacent = vec![Bits::empty(nodes.len()); nodes.len()];
        for (v, p) in nodes.iter().enumerate() {
            for (u, _) in nodes[..v].iter().enumerate().filter(|(_, q)| joined(p, q)) {
                adjacent[v].insert(u);
                adjacent[u].insert(v);
            }
        }
        Self { adjacent }
    }

    /// The nodes with colours 1, 2, ..., no two joined of one colour, by growing colour: a clique within the first nodes
    /// up to a colour is no larger than the colour.
    fn colour(&self, nodes: &Bits) -> Vec<(usize, usize)> {
        let (mut left, mut coloured, mut colour) = (nodes.clone(), Vec::new(), 0);
        while left.first().is_some() {
            colour += 1;
            let mut free = left.clone();
            while let Some(v) = free.first() {
                free.remove(v);
                free.subtract(&self.adjacent[v]);
                left.remove(v);
                coloured.push((v, colour));
            }
        }
        coloured
    }
}

/// The search below one root.
struct Search<'a> {
    graph: &'a Graph,
    best: Vec<usize>,
    /// Members, without the root, that a clique needs to be better than the best so far.
    at_least: usize,
    steps: &'a mut Steps,
}

impl Search<'_> {
    /// Extend a clique by the candidates, all of which are joined to all of it.
    fn expand(&mut self, clique: &mut Vec<usize>, mut candidates: Bits) {
        if clique.len() >= self.at_least.max(1) {
            self.best.clone_from(clique);
            self.at_least = clique.len() + 1;
        }
        for (v, colour) in self.graph.colour(&candidates).into_iter().rev() {
            if clique.len() + colour < self.at_least.max(1) || self.steps.left == 0 {
                return;
            }
            self.steps.spend(1);
            clique.push(v);
            self.expand(clique, candidates.and(&self.graph.adjacent[v]));
            clique.pop();
            candidates.remove(v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn search(graph: &Graph, n: usize, at_least: usize) -> Vec<usize> {
        let mut steps = Steps { left: usize::MAX };
        let mut search = Search { graph, best: Vec::new(), at_least, steps: &mut steps };
        search.expand(&mut Vec::new(), Bits::full(n));
        search.best
    }

    proptest! {
        #[test]
        fn equals_the_largest_of_all_subsets(edges in prop::collection::vec(0_u8..10, 78), least in 0_usize..13) {
            let n = 13;
            let mut graph = Graph { adjacent: vec![Bits::empty(n); n] };
            let all = (0..n).flat_map(|v| (0..v).map(move |u| (u, v)));
            for ((u, v), _) in all.zip(&edges).filter(|(_, e)| **e < 6) {
                graph.adjacent[u].insert(v);
                graph.adjacent[v].insert(u);
            }
            let joined = |u: usize, v: usize| graph.adjacent[u].0[0] >> v & 1 == 1;
            let is_clique = |s: &u32| {
                let members: Vec<_> = (0..n).filter(|v| s >> v & 1 == 1).collect();
                members.iter().all(|&v| members.iter().all(|&u| u == v || joined(u, v)))
            };
            let largest = (1_u32..1 << n).filter(is_clique).map(|s| s.count_ones() as usize).max().unwrap();
            let found = search(&graph, n, least);
            prop_assert_eq!(found.len(), if largest >= least { largest } else { 0 });
            prop_assert!(is_clique(&found.iter().fold(0, |s, v| s | 1 << v)));
        }
    }
}

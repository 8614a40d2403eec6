//! JCBB: the largest set of pairings of one scan that are compatible together.
//!
//! ```text
//! innovation v_H and covariance C_H = H_H P H_H^T + R of all pairings of a hypothesis H:
//! D^2(H) = v_H^T C_H^-1 v_H  <=  chi2(2 |H|, p)
//! ```
//!
//! Branch and bound: observations one after the other, those with the fewest candidates first, each to every candidate not
//! yet taken or to none. A branch is cut where its pairings so far fail the gate (as in the source: a hypothesis is found
//! only if all its beginnings pass too), where it cannot reach the pairings of the best hypothesis, and where it has as
//! many but a larger D^2, for D^2 grows with every pairing. The Cholesky factor of C_H grows by two rows per pairing:
//!
//! ```text
//! C = [ C_H  c ; c^T  S ],   L = [ L_H  0 ; y^T  l ],   L_H y = c,   l l^T = S - y^T y,   D^2 += | l^-1 (v - y^T w) |^2
//! ```
//!
//! where `L_H w = v_H`. The worst case is exponential, so the steps are capped; beyond the cap the answer is that of the
//! mutual nearest neighbours whose distance is `RATIO` times that of the second best at most, nearest first, each
//! compatible with those before.
//!
//! Source: J. Neira, J. D. Tardos, "Data association in stochastic mapping using the joint compatibility test", IEEE T-RA
//! 17(6), 2001.

use crate::gates::Gates;
use crate::joint::{Joint, Linear};
use nalgebra::{Matrix2, Vector2};

/// A nearest neighbour is clear when the second is at least twice as far, squared.
const RATIO: f64 = 0.5;

/// A pairing that passed the gates of its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Which landmark: a number that is the same for the same landmark.
    pub landmark: usize,
    /// The sighting as the filter takes it.
    pub linear: Linear,
    /// Covariance of its innovation before anything of the scan was learned.
    pub covariance: Matrix2<f64>,
    /// Squared Mahalanobis distance of its own.
    pub distance_sq: f64,
    /// Which of several it is stays open: what that has added to the residual and to the noise.
    pub doubt: Option<(Vector2<f64>, Matrix2<f64>)>,
}

/// For each observation the candidate chosen, by place.
pub(crate) type Choice = Vec<Option<usize>>;

/// What the search found.
#[derive(Clone, Debug)]
pub(crate) struct Hypothesis {
    pub choice: Choice,
    /// False where the cap cut the search short and nearest neighbours were taken.
    pub complete: bool,
}

/// The best hypothesis for `candidates` of each observation; its pairings pass the joint gate.
pub(crate) fn jcbb(joint: &Joint, candidates: &[Vec<Candidate>], gates: &Gates, max_nodes: usize) -> Hypothesis {
    let mut order: Vec<usize> = (0..candidates.len()).filter(|&o| !candidates[o].is_empty()).collect();
    order.sort_by_key(|&o| candidates[o].len());
    let mut search = Search {
        joint,
        candidates,
        order,
        gates,
        factor: Factor::default(),
        choice: vec![None; candidates.len()],
        best: vec![None; candidates.len()],
        best_score: (0, 0.0),
        nodes_left: max_nodes,
    };
    search.branch(0);
    if search.nodes_left > 0 {
        return Hypothesis { choice: search.best, complete: true };
    }
    search.nearest()
}

struct Search<'a> {
    joint: &'a Joint,
    candidates: &'a [Vec<Candidate>],
    order: Vec<usize>,
    gates: &'a Gates,
    factor: Factor,
    choice: Choice,
    best: Choice,
    best_score: (usize, f64),
    nodes_left: usize,
}

impl Search<'_> {
    fn branch(&mut self, depth: usize) {
        let (pairs, distance_sq) = (self.factor.pairs(), self.factor.distance_sq());
        if depth == self.order.len() {
            if pairs > self.best_score.0 || (pairs == self.best_score.0 && distance_sq < self.best_score.1) {
                (self.best, self.best_score) = (self.choice.clone(), (pairs, distance_sq));
            }
            return;
        }
        let observation = self.order[depth];
        for k in 0..self.candidates[observation].len() {
            self.try_pairing(observation, k, depth);
        }
        let reachable = pairs + self.order.len() - depth - 1;
        if self.may_win(reachable, distance_sq) {
            self.branch(depth + 1);
        }
    }

    fn try_pairing(&mut self, observation: usize, k: usize, depth: usize) {
        let candidate = &self.candidates[observation][k];
        let reachable = self.factor.pairs() + self.order.len() - depth;
        if self.nodes_left == 0 || self.is_taken(candidate.landmark) {
            return;
        }
        self.nodes_left -= 1;
        if self.factor.push(self.joint, &candidate.linear) {
            let (pairs, distance_sq) = (self.factor.pairs(), self.factor.distance_sq());
            if distance_sq <= self.gates.of(pairs) && self.may_win(reachable, distance_sq) {
                self.choice[observation] = Some(k);
                self.branch(depth + 1);
                self.choice[observation] = None;
            }
            self.factor.pop();
        }
    }

    /// Whether a hypothesis with `pairs` in the end and `distance_sq` already may be better than the best.
    fn may_win(&self, pairs: usize, distance_sq: f64) -> bool {
        pairs > self.best_score.0 || (pairs == self.best_score.0 && distance_sq < self.best_score.1)
    }

    fn is_taken(&self, landmark: usize) -> bool {
        let chosen = self.choice.iter().zip(self.candidates).filter_map(|(c, of)| c.map(|k| of[k].landmark));
        chosen.into_iter().any(|l| l == landmark)
    }

    /// Clear mutual nearest neighbours, nearest first, each compatible with those before.
    fn nearest(mut self) -> Hypothesis {
        let mut clear: Vec<(f64, usize, usize)> = Vec::new();
        for &observation in &self.order {
            let of = &self.candidates[observation];
            let (k, least) = nearest_of(of);
            let rival = |o: usize, j: usize, c: &Candidate| {
                (o, j) != (observation, k) && (o == observation || c.landmark == of[k].landmark)
            };
            let all = self.candidates.iter().enumerate();
            let rivals = all.flat_map(|(o, cs)| cs.iter().enumerate().map(move |(j, c)| (o, j, c)));
            let second = rivals.filter(|(o, j, c)| rival(*o, *j, c)).map(|(_, _, c)| c.distance_sq);
            if least <= RATIO * second.fold(f64::INFINITY, f64::min) {
                clear.push((least, observation, k));
            }
        }
        clear.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.factor = Factor::default();
        let mut choice = vec![None; self.candidates.len()];
        for (_, observation, k) in clear {
            if self.factor.push(self.joint, &self.candidates[observation][k].linear) {
                if self.factor.distance_sq() <= self.gates.of(self.factor.pairs()) {
                    choice[observation] = Some(k);
                } else {
                    self.factor.pop();
                }
            }
        }
        Hypothesis { choice, complete: false }
    }
}

fn nearest_of(candidates: &[Candidate]) -> (usize, f64) {
    let distances = candidates.iter().map(|c| c.distance_sq).enumerate();
    distances.fold((0, f64::INFINITY), |best, (k, d)| if d < best.1 { (k, d) } else { best })
}

/// The Cholesky factor of C_H in blocks of two, with the innovations it has whitened.
#[derive(Clone, Debug, Default)]
struct Factor {
    pairings: Vec<Linear>,
    /// Row i of L: blocks 0 to i.
    rows: Vec<Vec<Matrix2<f64>>>,
    whitened: Vec<Vector2<f64>>,
    /// D^2 of the first pairings.
    sums: Vec<f64>,
}

impl Factor {
    fn pairs(&self) -> usize {
        self.pairings.len()
    }

    fn distance_sq(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }

    /// Adds a pairing; false, and nothing added, where the covariance is not positive definite.
    fn push(&mut self, joint: &Joint, linear: &Linear) -> bool {
        let mut row: Vec<Matrix2<f64>> = Vec::with_capacity(self.pairs() + 1);
        let (mut left, mut v) = (joint.innovation_covariance(linear), joint.innovation(linear));
        for (other, above) in self.pairings.iter().zip(&self.rows) {
            let mut c = joint.cross(linear, other);
            row.iter().zip(above).for_each(|(y, l)| c -= y * l.transpose());
            let Some(y) = above.last().and_then(|l| l.solve_lower_triangular(&c.transpose())) else { return false };
            row.push(y.transpose());
        }
        for (y, w) in row.iter().zip(&self.whitened) {
            left -= y * y.transpose();
            v -= y * w;
        }
        let Some(l) = left.cholesky().map(|c| c.l()) else { return false };
        let Some(w) = l.solve_lower_triangular(&v) else { return false };
        row.push(l);
        self.sums.push(self.distance_sq() + w.norm_squared());
        self.rows.push(row);
        self.whitened.push(w);
        self.pairings.push(*linear);
        true
    }

    fn pop(&mut self) {
        self.pairings.pop();
        self.rows.pop();
        self.whitened.pop();
        self.sums.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gating::linearize;
    use crate::measurement::Viewpoint;
    use crate::observation::Observation;
    use groma_geometry::Se2;
    use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
    use proptest::prelude::*;

    /// A pose that is 10 cm and 3 degrees off, some landmarks in the joint state, and what is seen of them.
    fn scene(landmarks: &[(f64, f64)], seen: &[(f64, f64)], gate: f64) -> (Joint, Vec<Vec<Candidate>>) {
        let p = Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.0025));
        let mut joint = Joint::new(Se2::new(0.1, -0.05, 0.03), &p, None);
        let points: Vec<_> = landmarks.iter().map(|(x, y)| Vector2::new(*x, *y)).collect();
        points.iter().for_each(|p| {
            joint.insert(*p, &(Matrix2::identity() * 1e-4));
        });
        let view = Viewpoint { pose: joint.pose(), laser: Se2::IDENTITY };
        let candidates = |(x, y): &(f64, f64)| {
            let covariance = Matrix2::from_diagonal(&Vector2::new(4e-4, 1e-5));
            let o = Observation { covariance, ..Observation::at_point(0.0, Vector2::new(*x, *y), covariance) };
            let of = |slot: usize| {
                let linear = linearize(&view, &o, points[slot], Some(slot), &Matrix2::zeros())?;
                let distance_sq = joint.distance_sq(&linear)?;
                let covariance = joint.innovation_covariance(&linear);
                (distance_sq < gate).then_some(Candidate {
                    landmark: slot,
                    linear,
                    covariance,
                    distance_sq,
                    doubt: None,
                })
            };
            (0..points.len()).filter_map(of).collect()
        };
        let candidates = seen.iter().map(candidates).collect();
        (joint, candidates)
    }

    /// D^2 of a choice from the whole stacked covariance.
    fn stacked(joint: &Joint, candidates: &[Vec<Candidate>], choice: &Choice) -> (usize, f64) {
        let of: Vec<&Linear> = choice.iter().zip(candidates).filter_map(|(c, of)| c.map(|k| &of[k].linear)).collect();
        let n = 2 * of.len();
        let mut c = DMatrix::zeros(n, n);
        let mut v = DVector::zeros(n);
        for (i, a) in of.iter().enumerate() {
            for (j, b) in of.iter().enumerate() {
                let block = joint.cross(a, b) + if i == j { a.noise } else { Matrix2::zeros() };
                c.view_mut((2 * i, 2 * j), (2, 2)).copy_from(&block);
            }
            v.rows_mut(2 * i, 2).copy_from(&a.residual);
        }
        if n == 0 { (0, 0.0) } else { (of.len(), v.dot(&c.lu().solve(&v).unwrap())) }
    }

    /// The best of all choices that pass the gate with all their beginnings, one by one.
    fn exhaustive(joint: &Joint, candidates: &[Vec<Candidate>], gate: f64) -> (usize, f64) {
        let mut best = (0, 0.0);
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        order.sort_by_key(|&o| candidates[o].len());
        let mut choices: Vec<Choice> = vec![Vec::new()];
        for of in candidates {
            let longer = |c: &Choice| {
                (0..=of.len()).map(|k| [c.clone(), vec![(k < of.len()).then_some(k)]].concat()).collect::<Vec<_>>()
            };
            choices = choices.iter().flat_map(longer).collect();
        }
        for choice in choices {
            let mut taken: Vec<usize> =
                choice.iter().zip(candidates).filter_map(|(c, of)| c.map(|k| of[k].landmark)).collect();
            taken.sort_unstable();
            if taken.windows(2).any(|w| w[0] == w[1]) {
                continue;
            }
            let (pairs, d_sq) = stacked(joint, candidates, &choice);
            let passes = (1..=order.len()).all(|first| {
                let begun = (0..choice.len()).map(|o| choice[o].filter(|_| order[..first].contains(&o))).collect();
                let (pairs, d_sq) = stacked(joint, candidates, &begun);
                d_sq <= Gates::new(gate).of(pairs)
            });
            if passes && (pairs > best.0 || (pairs == best.0 && d_sq < best.1)) {
                best = (pairs, d_sq);
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]
        #[test]
        fn equals_exhaustive_search(
            landmarks in prop::collection::vec((1.0..3.5_f64, -1.5..1.5_f64), 2..6),
            seen in prop::collection::vec((1.0..3.5_f64, -1.5..1.5_f64), 1..5),
            shown in 0_usize..4,
        ) {
            let mut seen = seen;
            seen.iter_mut().zip(&landmarks).take(shown).for_each(|(s, l)| *s = (l.0 + 0.01, l.1 - 0.02));
            let (joint, candidates) = scene(&landmarks, &seen, 9.21);
            let found = jcbb(&joint, &candidates, &Gates::new(0.95), 1_000_000);
            prop_assert!(found.complete);
            let (pairs, d_sq) = stacked(&joint, &candidates, &found.choice);
            let (best_pairs, best) = exhaustive(&joint, &candidates, 0.95);
            prop_assert_eq!(pairs, best_pairs);
            prop_assert!((d_sq - best).abs() < 1e-6 * (1.0 + best), "{} {}", d_sq, best);
        }
    }

    #[test]
    fn what_passes_only_as_a_whole_is_not_found() {
        // Two pairings fail together, a third that fits well lifts the gate above them.
        let landmarks = [
            (2.9652260246690534, -1.015140924750921),
            (2.5975448596681985, -1.1187261773434114),
            (1.9836866480929334, 0.7549935085483711),
        ];
        let seen = [(2.9752260246690534, -1.035140924750921), (2.6075448596681985, -1.1387261773434114)];
        let third = (2.062658300883735, 0.6950901089940126);
        let (joint, candidates) = scene(&landmarks, &[seen[0], seen[1], third], 9.21);
        let found = jcbb(&joint, &candidates, &Gates::new(0.95), 1_000_000);
        let own = (0..3).map(|o| candidates[o].iter().position(|c| c.landmark == o)).collect();
        let whole = stacked(&joint, &candidates, &own);
        assert_eq!(whole.0, 3);
        assert!(whole.1 <= Gates::new(0.95).of(3), "{whole:?}");
        assert_eq!(found.choice.iter().flatten().count(), 2);
    }

    #[test]
    fn a_shift_of_all_pairs_is_resolved_together() {
        // The pose is off by half the spacing: the nearest neighbour of each is wrong or doubtful, together they are not.
        let fence: Vec<(f64, f64)> =
            (0..6).map(|k| (2.0 + 0.02 * f64::from(k * k), -0.6 + 0.25 * f64::from(k))).collect();
        let (joint, candidates) = scene(&fence, &fence, 9.21);
        assert!(candidates.iter().any(|c| c.len() > 1));
        let found = jcbb(&joint, &candidates, &Gates::new(0.99), 100_000);
        let landmarks: Vec<_> = found.choice.iter().zip(&candidates).map(|(c, of)| c.map(|k| of[k].landmark)).collect();
        assert_eq!(landmarks, (0..6).map(Some).collect::<Vec<_>>());
    }

    #[test]
    fn beyond_the_cap_only_clear_neighbours_are_taken() {
        let crowd: Vec<(f64, f64)> =
            (0..12).map(|k| (2.0 + 0.03 * f64::from(k % 4), 0.03 * f64::from(k / 4))).collect();
        let (joint, candidates) = scene(&crowd, &crowd, 9.21);
        let found = jcbb(&joint, &candidates, &Gates::new(0.99), 50);
        assert!(!found.complete);
        let (lone, candidates) = scene(&[(2.0, 0.0), (3.0, 2.0)], &[(2.0, 0.0), (3.0, 2.0)], 9.21);
        let found = jcbb(&lone, &candidates, &Gates::new(0.99), 1);
        assert!(!found.complete && found.choice == [Some(0), Some(0)]);
        assert_eq!(joint.points().len(), 12);
    }

    #[test]
    fn nothing_to_pair() {
        let (joint, candidates) = scene(&[], &[(1.0, 0.0)], 9.21);
        assert_eq!(jcbb(&joint, &candidates, &Gates::new(0.99), 10).choice, [None]);
        assert_eq!(jcbb(&joint, &[], &Gates::new(0.99), 10).choice, []);
    }
}

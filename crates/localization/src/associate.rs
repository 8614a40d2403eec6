//! Which observation of a scan is which landmark.
//!
//! Observations and the landmarks they may be form a graph; pairings in different components do not compete. So:
//!
//! 1. Where an observation and a landmark have only each other, the pairing is taken: reflectors first, then corners.
//! 2. The pose, better known by what was taken, gates what is left again; by the chain rule of Gaussians,
//!    `D^2(all) = D^2(first) + D^2(rest | first)`, this is the joint test, one pairing after the other.
//! 3. The smallest component left is searched by JCBB, given what was taken; and again from 2. Where, given all other
//!    pairings, an observation may still be one of several landmarks, it is taken with the mean of their innovations, and
//!    their spread as further noise (probabilistic data association, Bar-Shalom, Tse 1975): landmarks close together
//!    teach what they have in common, those far apart nearly nothing.
//! 4. If all together fail the joint test, or more than half of the observations were ambiguous from the beginning, one
//!    JCBB searches the whole scan instead.
//!
//! The joint state is used as a scratch pad and put back, unless what was learned is all there is to learn.

use crate::gates::Gates;
use crate::jcbb::{Candidate, jcbb};
use crate::joint::{Gain, Joint, Linear, inverse};
use crate::options::Options;
use nalgebra::{Matrix2, Vector2};

/// A pairing that was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pairing {
    pub observation: usize,
    pub landmark: usize,
    pub linear: Linear,
    /// Covariance of the innovation before anything of the scan was learned.
    pub covariance: Matrix2<f64>,
    /// As of the candidate.
    pub doubt: Option<(Vector2<f64>, Matrix2<f64>)>,
    /// Squared distance given the pairings before.
    pub distance_sq: f64,
}

/// An observation with what it may be.
#[derive(Clone, Debug)]
pub(crate) struct Open {
    pub observation: usize,
    /// Taken first.
    pub first: bool,
    pub candidates: Vec<Candidate>,
}

/// The association of one scan.
pub(crate) struct Association<'a, F> {
    pub joint: &'a mut Joint,
    pub options: &'a Options,
    pub gates: &'a Gates,
    /// Whether a landmark updates the pose.
    pub holds: F,
    pub taken: Vec<Pairing>,
    /// Whether a search met its cap.
    pub cut_short: bool,
}

impl<F: Fn(usize) -> bool> Association<'_, F> {
    /// Pairings of the scan; the joint state has learned from them in the end, the pose alone.
    pub fn run(&mut self, open: Vec<Open>) {
        let total = open.len();
        let before = self.joint.save_pose();
        let sure = certain(&open).iter().filter(|c| **c).count();
        if 2 * sure >= total {
            if sure == total {
                self.take_all(&open);
            } else {
                self.by_stages(open.clone());
            }
            if self.passes_jointly() {
                return;
            }
            self.joint.restore_pose(&before);
            self.taken.clear();
        }
        self.search(open);
    }

    /// Takes the only candidate of each, reflectors first.
    fn take_all(&mut self, open: &[Open]) {
        for first in [true, false] {
            open.iter().filter(|o| o.first == first).for_each(|o| self.take(o.observation, &o.candidates[0]));
        }
    }

    fn by_stages(&mut self, mut open: Vec<Open>) {
        while !open.is_empty() {
            let certain = certain(&open);
            let stage = |first: bool| open.iter().zip(&certain).any(|(o, c)| *c && o.first == first);
            let first = stage(true);
            if first || stage(false) {
                let mut marks = certain.iter();
                let (now, rest): (Vec<Open>, Vec<Open>) =
                    open.into_iter().partition(|o| marks.next().is_some_and(|c| *c) && (!first || o.first));
                now.iter().for_each(|o| self.take(o.observation, &o.candidates[0]));
                open = rest;
            } else {
                let (component, rest) = smallest_component(open);
                self.search(component);
                open = rest;
            }
            self.gate_again(&mut open);
        }
    }

    /// JCBB over some observations, given what was taken; what stays in doubt is taken with its doubt.
    fn search(&mut self, open: Vec<Open>) {
        let candidates: Vec<Vec<Candidate>> = open.iter().map(|o| o.candidates.clone()).collect();
        let found = jcbb(self.joint, &candidates, self.gates, self.options.max_nodes);
        self.cut_short |= !found.complete;
        let pick = |(o, choice): (&Open, Option<usize>)| choice.map(|k| (o.observation, o.candidates[k]));
        let chosen: Vec<(usize, Candidate)> = open.iter().zip(found.choice).filter_map(pick).collect();
        let doubtful = |(observation, chosen_one): &(usize, Candidate)| {
            let others = chosen.iter().filter(|(o, _)| o != observation).map(|(_, c)| *c).collect::<Vec<_>>();
            let of = open.iter().find(|o| o.observation == *observation).map_or(&[][..], |o| &o.candidates);
            (*observation, self.in_doubt(chosen_one, of, &others))
        };
        let taken: Vec<(usize, Candidate)> = chosen.iter().map(doubtful).collect();
        for (observation, candidate) in taken {
            self.accept(observation, &candidate, f64::INFINITY);
        }
    }

    /// A chosen candidate, its innovation the mean over all that are still possible given the other pairings, and its noise
    /// larger by their spread.
    fn in_doubt(&self, chosen: &Candidate, all: &[Candidate], others: &[Candidate]) -> Candidate {
        let free = |c: &&Candidate| others.iter().all(|o| o.landmark != c.landmark) && !self.is_taken(c.landmark);
        if all.len() < 2 || all.iter().filter(free).count() < 2 {
            return *chosen;
        }
        let mut given = self.joint.clone();
        for o in others.iter().filter(|o| (self.holds)(o.landmark)) {
            given.update(&o.linear, Gain::Pose, f64::INFINITY);
        }
        let weighed: Vec<(f64, Vector2<f64>)> = all.iter().filter(free).filter_map(|c| weight(&given, c)).collect();
        let total: f64 = weighed.iter().map(|(w, _)| w).sum();
        if total <= 0.0 {
            return *chosen;
        }
        let mean = weighed.iter().map(|(w, v)| v * *w).sum::<Vector2<f64>>() / total;
        let spread =
            weighed.iter().map(|(w, v)| (v - mean) * (v - mean).transpose() * *w).sum::<Matrix2<f64>>() / total;
        let mut blurred = *chosen;
        let offset = mean - given.innovation(&chosen.linear);
        blurred.linear.residual += offset;
        blurred.linear.noise += spread;
        blurred.doubt = Some((offset, spread));
        blurred
    }

    fn is_taken(&self, landmark: usize) -> bool {
        self.taken.iter().any(|p| p.landmark == landmark)
    }

    /// Takes a pairing if it still passes the gate.
    fn take(&mut self, observation: usize, candidate: &Candidate) {
        self.accept(observation, candidate, self.gates.of(1));
    }

    fn accept(&mut self, observation: usize, candidate: &Candidate, gate: f64) {
        let distance_sq = if (self.holds)(candidate.landmark) {
            self.joint.update(&candidate.linear, Gain::Pose, gate)
        } else {
            self.joint.distance_sq(&candidate.linear).filter(|d_sq| *d_sq <= gate)
        };
        let Some(distance_sq) = distance_sq else { return };
        let Candidate { landmark, linear, covariance, doubt, .. } = *candidate;
        self.taken.push(Pairing { observation, landmark, linear, covariance, doubt, distance_sq });
    }

    /// What the better pose leaves of the candidates.
    fn gate_again(&self, open: &mut Vec<Open>) {
        let gate = self.gates.of(1);
        let taken: Vec<usize> = self.taken.iter().map(|p| p.landmark).collect();
        for o in open.iter_mut() {
            o.candidates.retain_mut(|c| {
                c.distance_sq = self.joint.distance_sq(&c.linear).unwrap_or(f64::INFINITY);
                c.distance_sq <= gate && !taken.contains(&c.landmark)
            });
        }
        open.retain(|o| !o.candidates.is_empty());
    }

    fn passes_jointly(&self) -> bool {
        let sum: f64 = self.taken.iter().map(|p| p.distance_sq).sum();
        self.taken.is_empty() || sum <= self.gates.of(self.taken.len())
    }
}

/// Likelihood of a candidate and its innovation.
fn weight(given: &Joint, candidate: &Candidate) -> Option<(f64, Vector2<f64>)> {
    let v = given.innovation(&candidate.linear);
    let s = given.innovation_covariance(&candidate.linear);
    let d_sq = v.dot(&(inverse(&s)? * v));
    Some(((-0.5 * d_sq).exp() / s.determinant().sqrt(), v))
}

/// For each observation whether it and a landmark have only each other.
fn certain(open: &[Open]) -> Vec<bool> {
    let mut all: Vec<usize> = open.iter().flat_map(|o| &o.candidates).map(|c| c.landmark).collect();
    all.sort_unstable();
    let once = |landmark: usize| {
        let at = all.partition_point(|l| *l < landmark);
        all.get(at + 1) != Some(&landmark)
    };
    open.iter().map(|o| o.candidates.len() == 1 && once(o.candidates[0].landmark)).collect()
}

/// The component with the fewest observations, and the rest.
fn smallest_component(open: Vec<Open>) -> (Vec<Open>, Vec<Open>) {
    let mut label: Vec<usize> = (0..open.len()).collect();
    let shares =
        |a: &Open, b: &Open| a.candidates.iter().any(|c| b.candidates.iter().any(|d| c.landmark == d.landmark));
    for i in 0..open.len() {
        for j in 0..i {
            if label[i] != label[j] && shares(&open[i], &open[j]) {
                let (from, to) = (label[i].max(label[j]), label[i].min(label[j]));
                label.iter_mut().filter(|l| **l == from).for_each(|l| *l = to);
            }
        }
    }
    let size = |l: usize| label.iter().filter(|m| **m == l).count();
    let smallest = label.iter().copied().min_by_key(|l| (size(*l), *l));
    let mut labels = label.iter();
    open.into_iter().partition(|_| labels.next().copied() == smallest)
}

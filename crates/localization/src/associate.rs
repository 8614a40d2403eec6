//! Which observation of a scan is which landmark.
//!
//! Observations and the landmarks they may be form a graph; pairings in different components do not compete. So:
//!
//! 1. Where an observation and a landmark have only each other, the pairing is taken: reflectors first, then corners.
//! 2. The pose, better known by what was taken, gates what is left again; by the chain rule of Gaussians,
//!    `D^2(all) = D^2(first) + D^2(rest | first)`, this is the joint test, one pairing after the other.
//! 3. The smallest component left is searched by JCBB, given what was taken; and again from 2.
//! 4. If all together fail the joint test, or more than half of the observations were ambiguous from the beginning, one
//!    JCBB searches the whole scan instead.
//!
//! The joint state is used as a scratch pad and put back, unless what was learned is all there is to learn.

use crate::jcbb::{Candidate, jcbb};
use crate::joint::{Gain, Joint, Linear};
use crate::options::Options;
use groma_estimation::chi_square;
use nalgebra::Matrix2;

/// A pairing that was taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pairing {
    pub observation: usize,
    pub landmark: usize,
    pub linear: Linear,
    /// Covariance of the innovation before anything of the scan was learned.
    pub covariance: Matrix2<f64>,
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
    /// chi2(2, p) of the gate.
    pub gate: f64,
    /// Whether a landmark holds the pose.
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
        let ambiguous = total - certain(&open).iter().filter(|c| **c).count();
        if 2 * ambiguous <= total {
            self.by_stages(open.clone());
            if self.passes_jointly() {
                return;
            }
            self.joint.restore_pose(&before);
            self.taken.clear();
        }
        self.search(open);
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

    /// JCBB over some observations, given what was taken.
    fn search(&mut self, open: Vec<Open>) {
        let candidates: Vec<Vec<Candidate>> = open.iter().map(|o| o.candidates.clone()).collect();
        let found = jcbb(self.joint, &candidates, self.options.gate, self.options.max_nodes);
        self.cut_short |= !found.complete;
        for (o, choice) in open.iter().zip(found.choice) {
            if let Some(k) = choice {
                self.accept(o.observation, &o.candidates[k], f64::INFINITY);
            }
        }
    }

    /// Takes a pairing if it still passes the gate.
    fn take(&mut self, observation: usize, candidate: &Candidate) {
        self.accept(observation, candidate, self.gate);
    }

    fn accept(&mut self, observation: usize, candidate: &Candidate, gate: f64) {
        let Some(distance_sq) = self.joint.distance_sq(&candidate.linear) else { return };
        if distance_sq > gate {
            return;
        }
        if (self.holds)(candidate.landmark) {
            self.joint.update(&candidate.linear, Gain::Pose);
        }
        let Candidate { landmark, linear, covariance, .. } = *candidate;
        self.taken.push(Pairing { observation, landmark, linear, covariance, distance_sq });
    }

    /// What the better pose leaves of the candidates.
    fn gate_again(&self, open: &mut Vec<Open>) {
        let taken: Vec<usize> = self.taken.iter().map(|p| p.landmark).collect();
        for o in open.iter_mut() {
            o.candidates.retain_mut(|c| {
                c.distance_sq = self.joint.distance_sq(&c.linear).unwrap_or(f64::INFINITY);
                c.distance_sq <= self.gate && !taken.contains(&c.landmark)
            });
        }
        open.retain(|o| !o.candidates.is_empty());
    }

    fn passes_jointly(&self) -> bool {
        let sum: f64 = self.taken.iter().map(|p| p.distance_sq).sum();
        self.taken.is_empty() || chi_square::passes_gate(sum, 2 * self.taken.len(), self.options.gate)
    }
}

/// For each observation whether it and a landmark have only each other.
fn certain(open: &[Open]) -> Vec<bool> {
    let count = |landmark: usize| open.iter().flat_map(|o| &o.candidates).filter(|c| c.landmark == landmark).count();
    open.iter().map(|o| o.candidates.len() == 1 && count(o.candidates[0].landmark) == 1).collect()
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

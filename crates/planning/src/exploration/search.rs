//! The walk through the known building of least cost: A* over walks, with the whole covariance as their state.
//!
//! ```text
//! J(walk) = length + cost(end) + lambda [ sum_i tr P_position(camera_i)  (+ tr P_position(robot)) ]
//! ```
//!
//! over walks from the robot to a place where a walk may end. J depends on the whole walk, not on its end, so that no
//! shortest-path method applies; walks are taken from a queue in the order of `length + left + lambda trace`, where
//! `left` is the least that any walk to an end still costs, and dropped when
//!
//! - no continuation can beat the best walk found ([`super::bound`], admissible), or
//! - another walk that ended at the same place through the same exit is no longer, has no larger map trace and no larger
//!   robot trace. (Exact dominance would compare matrices; the test of the crate holds the loss on small graphs.)
//!
//! The search starts with the best shortest path ([`cheapest`]) as the walk to beat, may be stopped after any number of
//! expansions, and then says by how much a better walk could still be cheaper. No way is driven more than
//! [`Limits::passes`] times in one walk, against shuttling.
//!
//! Source: D. Meger, I. Rekleitis, G. Dudek, "Heuristic search planning to reduce exploration uncertainty", IROS 2008,
//! for the idea; bound, dominance and the low-rank covariance are ours.

use super::belief::Belief;
use super::bound::{Bound, Goal};
use super::branch::Branches;
use super::known::{KnownPlace, Link, distances, shortest};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// How long to think.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Walks that one decision may expand.
    pub expansions: usize,
    /// How often one walk may drive the same way.
    pub passes: usize,
}

impl Default for Limits {
    fn default() -> Self {
        Self { expansions: 2000, passes: 4 }
    }
}

/// What to decide.
pub(super) struct Problem<'a> {
    pub belief: &'a Belief,
    pub places: &'a [KnownPlace],
    pub links: &'a [Vec<Link>],
    pub here: usize,
    pub heading: f64,
    /// Cost with which a walk ends at a place; infinite where it must not end.
    pub ends: &'a [f64],
    pub lambda: f64,
    /// Whether the robot's own variance counts.
    pub robot: bool,
    /// No walk may be longer [m].
    pub reach: f64,
}

/// A walk and its cost.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Walk {
    /// The exits to take, one after the other.
    pub exits: Vec<usize>,
    /// The place where it ends.
    pub end: usize,
    /// Heading there [rad].
    pub heading: f64,
    /// What it costs, J.
    pub cost: f64,
    /// A better walk costs at least this share less than `cost`, or there is none: 0 where the search came to its end.
    pub gap: f64,
    /// Walks that were expanded.
    pub expansions: usize,
}

impl<'a> Problem<'a> {
    /// The walks that begin here, none of them thought of yet.
    pub fn branches(&self) -> Branches<'a> {
        Branches::new(self.belief, self.places, self.here, self.heading)
    }

    fn cost(&self, branches: &Branches<'_>, i: usize) -> f64 {
        let end = &branches.reached[i];
        let robot = if self.robot { end.robot_trace } else { 0.0 };
        end.length + self.ends[end.at] + self.lambda * (end.map_trace + robot)
    }

    fn walk(&self, branches: &Branches<'_>, i: usize) -> Walk {
        let (cost, end) = (self.cost(branches, i), &branches.reached[i]);
        Walk { exits: branches.exits(i), end: end.at, heading: end.heading, cost, gap: 0.0, expansions: 0 }
    }
}

/// The best of the shortest paths to the ends: the rule that needs no search.
pub(super) fn cheapest(problem: &Problem<'_>, branches: &mut Branches<'_>) -> Option<Walk> {
    let mut best: Option<Walk> = None;
    for end in (0..problem.places.len()).filter(|&i| problem.ends[i].is_finite()) {
        let Some(path) = shortest(problem.links, problem.here, end) else { continue };
        if path.iter().map(|link| link.passage.length).sum::<f64>() > problem.reach {
            continue;
        }
        let last = path.iter().fold(0, |at, link| branches.step(at, link));
        if best.as_ref().is_none_or(|b| problem.cost(branches, last) < b.cost - 1e-9) {
            best = Some(problem.walk(branches, last));
        }
    }
    best
}

/// The best walk that the limits allow to find; `branches` are those of the problem, or of one with another weight.
pub(super) fn search(problem: &Problem<'_>, branches: &mut Branches<'_>, limits: &Limits) -> Option<Walk> {
    let first = cheapest(problem, branches)?;
    let Problem { belief, places, links, here, ends, lambda, robot, .. } = *problem;
    let goal = Goal { here, ends, lambda, robot, limit: first.cost };
    let bound = Bound::new(belief, places, links, &goal);
    Some(Search::new(problem, branches, bound, first).run(limits))
}

/// A walk that may be made one link longer.
struct Open {
    promise: f64,
    parent: usize,
    /// Of the place where the parent ends: which link to take.
    link: usize,
    floor: f64,
    order: usize,
}

struct Search<'a, 'b> {
    problem: &'a Problem<'a>,
    branches: &'a mut Branches<'b>,
    bound: Bound,
    left: Vec<f64>,
    queue: BinaryHeap<Open>,
    fronts: HashMap<(usize, Option<usize>), Vec<[f64; 3]>>,
    best: Walk,
    pushed: usize,
}

impl<'a, 'b> Search<'a, 'b> {
    fn new(problem: &'a Problem<'a>, branches: &'a mut Branches<'b>, bound: Bound, best: Walk) -> Self {
        let left = distances(problem.links, problem.ends);
        Self { problem, branches, bound, left, queue: BinaryHeap::new(), fronts: HashMap::new(), best, pushed: 0 }
    }

    fn run(mut self, limits: &Limits) -> Walk {
        self.expand(0, limits);
        let mut expansions = 1;
        while let Some(open) = self.queue.pop() {
            if open.floor >= self.best.cost {
                continue;
            }
            if expansions >= limits.expansions {
                self.queue.push(open);
                break;
            }
            let link = &self.problem.links[self.branches.reached[open.parent].at][open.link];
            let reached = self.branches.step(open.parent, link);
            self.consider(reached);
            expansions += 1;
            if !self.dominated(reached) {
                self.expand(reached, limits);
            }
        }
        let floor = self.queue.iter().map(|open| open.floor).fold(self.best.cost, f64::min);
        Walk { gap: 1.0 - floor / self.best.cost.max(f64::MIN_POSITIVE), expansions, ..self.best }
    }

    /// Keeps what was reached if it is an end and better than the best.
    fn consider(&mut self, reached: usize) {
        let cost = self.problem.cost(self.branches, reached);
        if cost < self.best.cost - 1e-9 {
            self.best = self.problem.walk(self.branches, reached);
        }
    }

    fn expand(&mut self, parent: usize, limits: &Limits) {
        let from = &self.branches.reached[parent];
        for (link, next) in self.problem.links[from.at].iter().enumerate() {
            let length = from.length + next.passage.length;
            let floor = self.bound.at_least(length + self.left[next.to]);
            let far = length > self.problem.reach || floor >= self.best.cost;
            if far || self.passes(parent, from.at, next) >= limits.passes {
                continue;
            }
            let promise = length + self.left[next.to] + self.problem.lambda * from.map_trace;
            self.pushed += 1;
            self.queue.push(Open { promise, parent, link, floor, order: self.pushed });
        }
    }

    /// How often the walk drove a way already, in either direction.
    fn passes(&self, end: usize, at: usize, link: &Link) -> usize {
        let (mut i, mut count) = (end, 0);
        while let Some(parent) = self.branches.reached[i].parent {
            let (to, from) = (&self.branches.reached[i], &self.branches.reached[parent]);
            let there = (from.at, to.exit) == (at, link.exit);
            let back = (from.at, to.exit) == (link.to, link.enters);
            count += usize::from(there || back);
            i = parent;
        }
        count
    }

    /// Whether another walk is at least as good in all that counts; else it joins those that are not worse.
    fn dominated(&mut self, reached: usize) -> bool {
        let r = &self.branches.reached[reached];
        let value = [r.length, r.map_trace, r.robot_trace];
        let front = self.fronts.entry((r.at, r.entered)).or_default();
        let beats = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).all(|(a, b)| *a <= b + 1e-12);
        if front.iter().any(|other| beats(other, &value)) {
            return true;
        }
        front.retain(|other| !beats(&value, other));
        front.push(value);
        false
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    /// The heap gives the largest: the least promise, the oldest of equals.
    fn cmp(&self, other: &Self) -> Ordering {
        other.promise.total_cmp(&self.promise).then(other.order.cmp(&self.order))
    }
}

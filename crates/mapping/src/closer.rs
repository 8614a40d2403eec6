//! Loop closure: which local maps show the same place, and where that puts them.
//!
//! For a local map, earlier ones are candidates when the graph says that they may overlap (the window of search follows
//! from the covariance along the best path), or when their corner signatures look alike (GLAROT), however far away the
//! graph believes them. Each is searched, registered, shown to the views of the other ([`check`]) and judged
//! ([`judge`]).
//!
//! All closures then enter a pose graph of local maps with a robust cost; one that the others contradict is rejected.
//! Online, [`Closer::close`] runs at each finished local map and sees only the past; offline, [`Closer::revisit`] then
//! goes over all pairs again with what has been learned, until nothing new is found.

use crate::closure::{Closure, Expected, GATE, REACH, Verdict, invert, judge};
use crate::keyframe::Keyframe;
use crate::local_map::{LocalMap, step};
use crate::pose_graph::{Edge, Error, Options, PoseGraph};
use crate::uncertainty::{Link, from_source};
use crate::verify::{Check, check};
use groma_features::association::{self, associate};
use groma_features::glarot::Index;
use groma_geometry::Se2;
use groma_models::{Cancelled, Token};
use groma_registration::Window;
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Local maps this close in the sequence share scans: nothing to close.
const LEAST_GAP: usize = 3;
/// Paths farther apart than this, beyond the uncertainty, are no candidates [m].
const NEAR: f64 = 5.0;
/// Candidates tried for one local map.
const MOST_CANDIDATES: usize = 8;
/// Within this no search is needed, registration finds its way [m], [rad].
const DIRECT: (f64, f64) = (0.4, 0.12);
/// Least score of a peak, and share of the best that another must reach to be looked at.
const PEAK: (f64, f64) = (0.15, 0.8);
const MOST_PEAKS: usize = 4;
/// How often all pairs are gone over again, and how far a pair must have moved to be looked at again [m], [rad].
const ROUNDS: usize = 3;
const ELSEWHERE: (f64, f64) = (0.5, 0.1);
/// Local maps with as many corners have a signature; as many of the most similar ones are tried.
const LEAST_CORNERS: usize = 6;
const MOST_ALIKE: usize = 6;
/// Local maps this close in the sequence may confirm each other.
const NEIGHBOURS: usize = 6;

/// The local maps, their poses and what ties them together. A copy shares the maps.
#[derive(Clone, Default)]
pub struct Closer {
    /// Local maps in order of time.
    pub maps: Vec<Arc<LocalMap>>,
    /// Measured pose of each map's anchor in the frame of the one before, and its covariance; none for the first.
    steps: Vec<(Se2, Matrix3<f64>)>,
    /// `T_map_anchor`.
    pub poses: Vec<Se2>,
    /// Everything that was verified.
    pub closures: Vec<Closure>,
    /// Pairs that were looked at, and where the graph had them then.
    tried: BTreeMap<(usize, usize), Se2>,
    index: Index,
}

/// A pair to look at.
struct Candidate {
    a: usize,
    b: usize,
    expected: Expected,
    distance: f64,
    /// Poses that corners suggest, where the window is too wide to be searched.
    suggested: Option<Vec<Se2>>,
}

impl Closer {
    /// Appends a local map.
    pub fn add(&mut self, map: LocalMap, keyframes: &[Keyframe]) {
        let mut pose = map.anchor;
        if let (Some(before), Some(last)) = (self.maps.last(), self.poses.last()) {
            let step = step(before, &map, keyframes);
            pose = *last * step.0;
            self.steps.push(step);
        }
        self.index.add(&map.signature);
        self.maps.push(Arc::new(map));
        self.poses.push(pose);
    }

    /// Looks for closures of local map `b` with those before it; returns how many were accepted.
    ///
    /// # Errors
    /// When `token` is cancelled; nothing has changed then, or poses alone are not yet arranged.
    pub fn close(&mut self, b: usize, keyframes: &[Keyframe], token: &Token) -> Result<usize, Cancelled> {
        token.check()?;
        let candidates = self.candidates(b, token)?;
        let found = candidates.par_iter().map(|c| self.examine(c, keyframes, token));
        let found: Vec<Option<Closure>> = found.collect::<Result<_, Cancelled>>()?;
        self.closures.retain(|c| !candidates.iter().any(|n| (n.a, n.b) == (c.from, c.to)));
        self.tried.extend(candidates.iter().map(|c| ((c.a, c.b), c.expected.pose)));
        let before = self.accepted();
        self.closures.extend(found.into_iter().flatten());
        self.confirm(b);
        let accepted = self.accepted() - before;
        if accepted > 0 {
            self.optimize(token)?;
        }
        Ok(accepted)
    }

    fn accepted(&self) -> usize {
        self.closures.iter().filter(|c| c.verdict == Verdict::Accepted).count()
    }

    /// Goes over all pairs again that were not looked at, or stand elsewhere since, until nothing new is found.
    ///
    /// # Errors
    /// When `token` is cancelled; what was found until then stays.
    pub fn revisit(&mut self, keyframes: &[Keyframe], token: &Token) -> Result<(), Cancelled> {
        for _ in 0..ROUNDS {
            token.begin(self.maps.len());
            let mut news = 0;
            for b in 0..self.maps.len() {
                news += self.close(b, keyframes, token)?;
                token.step()?;
            }
            if news == 0 {
                break;
            }
        }
        Ok(())
    }

    /// Earlier maps that may overlap map `b`: nearest first, then those that look alike.
    fn candidates(&self, b: usize, token: &Token) -> Result<Vec<Candidate>, Cancelled> {
        let spread = from_source(self.maps.len(), &self.links(), b);
        let candidate = |a: usize| {
            let predicted = self.poses[a].between(&self.poses[b]);
            let ad = predicted.inverse().adjoint();
            let expected = Expected { pose: predicted, covariance: ad * spread[a]? * ad.transpose() };
            let slack = 2.0 / 3.0 * expected.whole_reach();
            let distance = self.maps[a].path_distance(&self.maps[b], &predicted) - slack;
            Some(Candidate { a, b, expected, distance, suggested: None })
        };
        let all = (0..b.saturating_sub(LEAST_GAP - 1)).filter_map(candidate).filter(|c| self.is_news(c));
        let (mut near, mut far): (Vec<Candidate>, Vec<Candidate>) =
            all.filter(|c| c.distance < NEAR).partition(|c| c.expected.whole_reach() < 1.5 * REACH.1);
        near.sort_by(|x, y| x.distance.total_cmp(&y.distance).then(x.a.cmp(&y.a)));
        near.truncate(MOST_CANDIDATES);
        near.extend(self.alike(b, &mut far, token)?);
        Ok(near)
    }

    /// Whether a pair was never looked at, or was turned down and stands elsewhere since.
    fn is_news(&self, c: &Candidate) -> bool {
        let Some(before) = self.tried.get(&(c.a, c.b)) else { return true };
        let moved = before.between(&c.expected.pose);
        let elsewhere = moved.translation.norm() > ELSEWHERE.0 || moved.theta().abs() > ELSEWHERE.1;
        elsewhere && !self.closures.iter().any(|k| (k.from, k.to, k.verdict) == (c.a, c.b, Verdict::Accepted))
    }

    /// Of maps whose place is too uncertain to be searched, those with the most similar signatures, with the poses that their
    /// corners suggest.
    fn alike(&self, b: usize, far: &mut Vec<Candidate>, token: &Token) -> Result<Vec<Candidate>, Cancelled> {
        if self.maps[b].corners.len() < LEAST_CORNERS || far.is_empty() {
            return Ok(Vec::new());
        }
        let eligible: BTreeSet<usize> =
            far.iter().map(|c| c.a).filter(|a| self.maps[*a].corners.len() >= LEAST_CORNERS).collect();
        let best = self.index.query(&self.maps[b].signature, MOST_ALIKE, |a| eligible.contains(&a));
        let chosen: BTreeSet<usize> = best.iter().map(|m| m.index).collect();
        far.retain(|c| chosen.contains(&c.a));
        std::mem::take(far)
            .into_par_iter()
            .map(|mut c| {
                token.check()?;
                let hypotheses =
                    associate(&self.maps[c.a].corners, &self.maps[c.b].corners, &association::Options::default());
                c.suggested = Some(hypotheses.iter().map(|h| h.transform).collect());
                Ok(c)
            })
            .collect()
    }

    /// Steps and accepted closures.
    #[must_use]
    pub fn links(&self) -> Vec<Link> {
        let steps = self.steps.iter().enumerate().map(|(k, (pose, covariance))| Link {
            from: k,
            to: k + 1,
            pose: *pose,
            covariance: *covariance,
        });
        let closed = self.closures.iter().filter(|c| c.verdict == Verdict::Accepted).map(|c| Link {
            from: c.from,
            to: c.to,
            pose: c.check.pose,
            covariance: c.covariance(),
        });
        steps.chain(closed).collect()
    }

    /// Searches, verifies and judges a candidate; `None` when not even a peak was found.
    fn examine(&self, c: &Candidate, keyframes: &[Keyframe], token: &Token) -> Result<Option<Closure>, Cancelled> {
        token.check()?;
        let (a, b) = (&self.maps[c.a], &self.maps[c.b]);
        let (reach, turn) = (c.expected.reach(), c.expected.turn());
        let starts = if let Some(suggested) = &c.suggested {
            suggested.clone()
        } else if reach <= DIRECT.0 && turn <= DIRECT.1 {
            vec![c.expected.pose]
        } else {
            let window = Window { center: c.expected.pose, reach, turn };
            let points: Vec<_> = b.sample.points.iter().step_by(2).copied().collect();
            let peaks = a.field().search(&points, &window, PEAK.0, PEAK.1);
            peaks.iter().take(MOST_PEAKS).map(|p| p.pose).collect()
        };
        let checks = starts.iter().map(|s| token.check().map(|()| check(a, b, *s, keyframes)));
        let mut checks: Vec<Check> = checks.collect::<Result<_, Cancelled>>()?;
        checks.sort_by(|x, y| y.overlap.total_cmp(&x.overlap));
        let Some(best) = checks.first().cloned() else { return Ok(None) };
        let verdict = judge(&best, &checks[1..], &c.expected, c.suggested.is_some());
        Ok(Some(Closure { from: c.a, to: c.b, check: best, predicted: c.expected.pose, verdict }))
    }

    /// Accepts unconfirmed closures of map `b` that one of a neighbouring map agrees with.
    fn confirm(&mut self, b: usize) {
        let links = self.links();
        let waiting: Vec<usize> = (0..self.closures.len())
            .filter(|k| {
                self.closures[*k].verdict == Verdict::Unconfirmed && b - self.closures[*k].to.min(b) <= NEIGHBOURS
            })
            .collect();
        let mut confirmed = BTreeSet::new();
        for (n, &x) in waiting.iter().enumerate() {
            for &y in &waiting[..n] {
                if self.closures[x].to != self.closures[y].to && self.agree(x, y, &links) {
                    confirmed.extend([x, y]);
                }
            }
        }
        for k in confirmed {
            self.closures[k].verdict = Verdict::Accepted;
        }
    }

    /// Whether two closures agree about the drive between their local maps.
    fn agree(&self, x: usize, y: usize, links: &[Link]) -> bool {
        let (x, y) = (&self.closures[x], &self.closures[y]);
        let from_a = from_source(self.maps.len(), links, x.from);
        let from_b = from_source(self.maps.len(), links, x.to);
        let (Some(p_a), Some(p_b)) = (from_a[y.from], from_b[y.to]) else { return false };
        let known = |p: &Matrix3<f64>| 9.0 * (p[(0, 0)] + p[(1, 1)]) < REACH.1 * REACH.1;
        if !known(&p_a) || !known(&p_b) {
            return false;
        }
        // T_xa_ya T_ya_yb = T_xa_xb T_xb_yb, each side a way from the one to the other.
        let left = self.poses[x.from].between(&self.poses[y.from]) * y.check.pose;
        let right = x.check.pose * self.poses[x.to].between(&self.poses[y.to]);
        let e = left.minus(&right);
        let ad = y.check.pose.inverse().adjoint();
        let step = self.poses[x.to].between(&self.poses[y.to]).inverse().adjoint();
        let spread = ad * p_a * ad.transpose() + p_b + y.covariance() + step * x.covariance() * step.transpose();
        e.dot(&(invert(&spread) * e)) < GATE
    }

    /// Arranges the local maps; closures that the others contradict are rejected. A graph that cannot be solved stays as it
    /// is.
    fn optimize(&mut self, token: &Token) -> Result<(), Cancelled> {
        let (graph, held) = self.graph();
        let solution = match graph.optimize(&Options::default(), token) {
            Err(Error::Cancelled(cancelled)) => return Err(cancelled),
            Err(_) => return Ok(()),
            Ok(solution) => solution,
        };
        self.poses = solution.nodes;
        let steps = graph.edges.len() - held.len();
        for (k, index) in held.iter().enumerate() {
            if solution.weights[steps + k] < 0.5 {
                self.closures[*index].verdict = Verdict::Contradicted;
            }
        }
        Ok(())
    }

    /// The graph of local maps, and the closures behind its last edges.
    fn graph(&self) -> (PoseGraph, Vec<usize>) {
        let step = |(k, (pose, covariance)): (usize, &(Se2, Matrix3<f64>))| Edge {
            from: k,
            to: k + 1,
            measurement: *pose,
            information: invert(covariance),
            robust: false,
        };
        let mut edges: Vec<Edge> = self.steps.iter().enumerate().map(step).collect();
        let mut held = Vec::new();
        for (index, c) in self.closures.iter().enumerate().filter(|(_, c)| c.verdict == Verdict::Accepted) {
            let information = c.information();
            edges.push(Edge { from: c.from, to: c.to, measurement: c.check.pose, information, robust: true });
            held.push(index);
        }
        (PoseGraph { nodes: self.poses.clone(), edges }, held)
    }
}

//! A lower bound on the cost of every walk of a given length, from what such a walk could learn at best.
//!
//! The cost of a walk of length L is `J = L + lambda u(P)`, `u` the traces that count, and `u` falls when information is
//! added. Relax: (1) the robot is told exactly where each camera is that it stands below, so that a way driven is a
//! measurement between its two ends, with the noise of the way and no noise of turning; (2) a junction recognises the
//! robot like a camera; (3) a walk of length L from the start s to an end in F may drive a way (a, b) of length l up to k
//! times, for every way at once, where
//!
//! ```text
//! min(d(s, a), d(s, b)) + k l + min(d(a, F), d(b, F)) <= L.
//! ```
//!
//! Each of these gives the walk at least the information that it has, so the relaxed covariance is below the true one
//! (information is additive, inversion reverses the order of matrices) and `L' + lambda u_relaxed(L')`, minimised over
//! L' >= L, bounds J from below. Ways become available one after the other as L grows; repetitions in powers of two, all
//! of a power at once, which again gives away information only. Where the work allowed ends, `u` is bounded by 0.

use super::belief::{Belief, factor};
use super::known::{KnownPlace, Link, distances};
use super::noise::position_trace;
use nalgebra::{Matrix3, Matrix3xX};

/// Multiply-adds that the table may take.
const WORK: usize = 3_000_000;
/// Variance of a junction before it is reached; any finite value keeps the bound below [m^2, rad^2].
const UNKNOWN: f64 = 1e4;
/// Share by which rounding may have put the bound too high.
const ROUNDING: f64 = 1e-9;

/// What a table is made for.
pub(super) struct Goal<'a> {
    pub here: usize,
    /// Cost with which a walk ends at a place; infinite where it must not end.
    pub ends: &'a [f64],
    pub lambda: f64,
    /// Whether the robot's own variance counts.
    pub robot: bool,
    /// No walk as costly as this is of interest.
    pub limit: f64,
}

/// The bound as a function of the length of the walk.
pub(super) struct Bound {
    /// From this length on [m] the traces are no less than this [m^2].
    steps: Vec<(f64, f64)>,
    /// Least cost over the steps from each on.
    least: Vec<f64>,
    lambda: f64,
}

impl Bound {
    /// From the belief, before the first step.
    pub fn new(belief: &Belief, places: &[KnownPlace], links: &[Vec<Link>], goal: &Goal<'_>) -> Self {
        let mut relaxed = Relaxed::new(belief, places, goal);
        let (mut steps, mut work) = (vec![(0.0, relaxed.traces())], 0);
        for event in events(links, goal) {
            work += relaxed.belief.covariance.len() * 6;
            if work > WORK {
                steps.push((event.length, 0.0));
                break;
            }
            relaxed.drive(&event);
            steps.push((event.length, relaxed.traces()));
        }
        let mut least: Vec<f64> = steps.iter().map(|&(length, u)| length + goal.lambda * u).collect();
        (1..least.len()).rev().for_each(|i| least[i - 1] = least[i - 1].min(least[i]));
        Self { steps, least, lambda: goal.lambda }
    }

    /// No walk whose whole length is at least this costs less.
    pub fn at_least(&self, length: f64) -> f64 {
        let after = self.steps.partition_point(|&(from, _)| from <= length + 1e-9);
        let here = after.checked_sub(1).map_or(0.0, |i| length + self.lambda * self.steps[i].1);
        self.least.get(after).map_or(here, |later| here.min(*later)) * (1.0 - ROUNDING)
    }
}

/// A way that may be driven `times` more often from a certain length on.
struct Event {
    length: f64,
    ends: [usize; 2],
    covariance: Matrix3<f64>,
}

fn events(links: &[Vec<Link>], goal: &Goal<'_>) -> Vec<Event> {
    let mut start = vec![f64::INFINITY; links.len()];
    start[goal.here] = 0.0;
    let (out, home) = (distances(links, &start), distances(links, goal.ends));
    let mut events = vec![];
    for (a, link) in links.iter().enumerate().flat_map(|(a, row)| row.iter().map(move |link| (a, link))) {
        if (a, link.exit) > (link.to, link.enters) {
            continue;
        }
        let (b, each) = (link.to, link.passage.length);
        let apart = out[a].min(out[b]) + home[a].min(home[b]);
        let mut times = 1.0;
        while apart + times * each < goal.limit {
            let covariance = link.passage.noise / times;
            events.push(Event { length: apart + times * each, ends: [a, b], covariance });
            times *= 2.0;
        }
    }
    events.sort_by(|a, b| a.length.total_cmp(&b.length));
    events
}

/// Cameras and junctions under the relaxed problem; the robot's block serves as a place of no meaning.
struct Relaxed {
    belief: Belief,
    /// Number of each known place in the belief.
    number: Vec<usize>,
    cameras: usize,
    /// The places where a walk may end, if the robot counts.
    ends: Vec<usize>,
}

impl Relaxed {
    fn new(belief: &Belief, places: &[KnownPlace], goal: &Goal<'_>) -> Self {
        let mut relaxed = belief.clone();
        let cameras = relaxed.cameras.len();
        let robot = relaxed.robot();
        let number = places.iter().enumerate().map(|(i, place)| {
            place.camera.unwrap_or_else(|| {
                // A junction: exactly where the robot is if it stands there, else anywhere.
                let camera = relaxed.meet(place.at);
                let variance = if i == goal.here { robot } else { Matrix3::identity() * UNKNOWN };
                let (row, n) = (3 * camera + 3, relaxed.covariance.nrows());
                if i != goal.here {
                    relaxed.covariance.view_mut((row, 0), (3, n)).fill(0.0);
                    relaxed.covariance.view_mut((0, row), (n, 3)).fill(0.0);
                }
                relaxed.covariance.view_mut((row, row), (3, 3)).copy_from(&variance);
                camera
            })
        });
        let number: Vec<usize> = number.collect();
        let ends = (0..places.len()).filter(|&i| goal.robot && goal.ends[i].is_finite()).collect();
        let mut relaxed = Self { number, cameras, ends, belief: relaxed };
        if let Some(camera) = places[goal.here].camera {
            let difference = relaxed.belief.difference(camera);
            relaxed.update(factor(&difference, camera, &Matrix3::zeros()));
        }
        relaxed
    }

    fn drive(&mut self, event: &Event) {
        let [a, b] = event.ends.map(|i| 3 * self.number[i] + 3);
        let p = &self.belief.covariance;
        let difference: Matrix3xX<f64> = p.fixed_rows::<3>(a) - p.fixed_rows::<3>(b);
        let innovation = difference.fixed_columns::<3>(a) - difference.fixed_columns::<3>(b) + event.covariance;
        let lower = nalgebra::Cholesky::new((innovation + innovation.transpose()) / 2.0);
        self.update(lower.and_then(|l| l.unpack().solve_lower_triangular(&difference)));
    }

    fn update(&mut self, gain: Option<Matrix3xX<f64>>) {
        if let Some(gain) = gain {
            self.belief.covariance.gemm_tr(-1.0, &gain, &gain, 1.0);
        }
    }

    fn traces(&self) -> f64 {
        let trace = |i: usize| position_trace(&self.belief.camera(i), self.belief.cameras[i]);
        let map: f64 = (0..self.cameras).map(trace).sum();
        let robot = self.ends.iter().map(|&i| trace(self.number[i])).min_by(f64::total_cmp);
        (map + robot.unwrap_or(0.0)).max(0.0)
    }
}

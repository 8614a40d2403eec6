//! The covariance at the end of a walk that is only thought of, without a copy of the covariance.
//!
//! From the belief `P0` on, a walk adds noise to the robot's block alone and takes away one product per view:
//!
//! ```text
//! P = P0 + E_R (sum Q) E_R' - sum_k V_k' V_k,   V_k of size (3, n)
//! ```
//!
//! so that a step costs `O(n)` times the views before it instead of `O(n^2)`, and nothing but `V_k` is kept. These are
//! the equations of [`super::belief`], not an approximation. They do not know the cost of a walk, so that searches
//! with other weights from the same belief find the walks that were thought of before.

use super::belief::Belief;
use super::known::{KnownPlace, Link};
use super::noise::position_trace;
use super::rows::Rows;
use groma_geometry::wrap;
use nalgebra::Matrix3;
use std::collections::HashMap;

/// Where a walk that is thought of has come to.
#[derive(Clone, Debug)]
pub(super) struct Reached {
    pub parent: Option<usize>,
    /// The place.
    pub at: usize,
    /// The exit through which the place was entered, and the heading then; None at the root.
    pub entered: Option<usize>,
    pub heading: f64,
    /// The exit taken from the parent.
    pub exit: usize,
    pub length: f64,
    /// Sum of the position variances of the cameras [m^2].
    pub map_trace: f64,
    /// Position variance of the robot [m^2].
    pub robot_trace: f64,
    added: Matrix3<f64>,
    robot: Matrix3<f64>,
    /// V of the view.
    gain: Option<Rows>,
}

/// All walks that were thought of from one belief.
pub(super) struct Branches<'a> {
    belief: &'a Belief,
    places: &'a [KnownPlace],
    pub reached: Vec<Reached>,
    /// What was reached from where by which exit to which place: guesses may lead one exit to several.
    steps: HashMap<(usize, usize, usize), usize>,
}

impl<'a> Branches<'a> {
    /// With the place and heading of the robot as root, number 0.
    pub fn new(belief: &'a Belief, places: &'a [KnownPlace], at: usize, heading: f64) -> Self {
        let robot = belief.robot();
        let root = Reached {
            parent: None,
            at,
            entered: None,
            heading,
            exit: 0,
            length: 0.0,
            map_trace: belief.map_trace(),
            robot_trace: position_trace(&robot, places[at].at),
            added: Matrix3::zeros(),
            robot,
            gain: None,
        };
        Self { belief, places, reached: vec![root], steps: HashMap::new() }
    }

    /// One link further; returns the number of what is reached.
    pub fn step(&mut self, parent: usize, link: &Link) -> usize {
        let key = (parent, link.exit, link.to);
        if let Some(&known) = self.steps.get(&key) {
            return known;
        }
        let number = self.think(parent, link);
        self.steps.insert(key, number);
        number
    }

    fn think(&mut self, parent: usize, link: &Link) -> usize {
        let from = &self.reached[parent];
        let turn = self.belief.noise.turning(self.places[from.at].at, wrap(link.passage.depart - from.heading));
        let noise = turn + link.passage.noise;
        let mut next = Reached {
            parent: Some(parent),
            at: link.to,
            entered: Some(link.enters),
            heading: link.passage.arrive,
            exit: link.exit,
            length: from.length + link.passage.length,
            map_trace: from.map_trace,
            robot_trace: 0.0,
            added: from.added + noise,
            robot: from.robot + noise,
            gain: None,
        };
        if let Some(camera) = self.places[link.to].camera {
            self.look(&mut next, camera);
        }
        next.robot_trace = position_trace(&next.robot, self.places[next.at].at);
        self.reached.push(next);
        self.reached.len() - 1
    }

    /// The exits taken from the root to what was reached.
    pub fn exits(&self, mut end: usize) -> Vec<usize> {
        let mut exits = vec![];
        while let Some(parent) = self.reached[end].parent {
            exits.push(self.reached[end].exit);
            end = parent;
        }
        exits.reverse();
        exits
    }

    fn look(&self, next: &mut Reached, camera: usize) {
        let column = 3 * camera + 3;
        let mut difference = Rows::difference(&self.belief.covariance, 0, column);
        difference.add_to_first(&next.added);
        let mut ancestor = next.parent;
        while let Some(i) = ancestor {
            if let Some(gain) = &self.reached[i].gain {
                difference.subtract(&(gain.block(0) - gain.block(column)).transpose(), gain);
            }
            ancestor = self.reached[i].parent;
        }
        let look = self.belief.noise.look(self.belief.cameras[camera]);
        let innovation = difference.block(0) - difference.block(column) + look;
        let root = nalgebra::Cholesky::new((innovation + innovation.transpose()) / 2.0);
        if let Some(whiten) = root.and_then(|root| root.l().try_inverse()) {
            difference.times(&whiten);
            next.map_trace -= self.taken(&difference);
            next.robot -= difference.block(0).transpose() * difference.block(0);
            next.gain = Some(difference);
        }
    }

    /// By how much a view lowers the sum of the position variances.
    fn taken(&self, gain: &Rows) -> f64 {
        let cameras = self.belief.cameras.iter().enumerate();
        cameras.map(|(i, at)| gain.position(3 * i + 3, at.x, at.y).norm_squared()).sum()
    }
}

//! The covariance at the end of a walk that is only thought of, without a copy of the covariance.
//!
//! From the belief `P0` on, a walk adds noise to the robot's block alone and takes away one product a look:
//!
//! ```text
//! P = P0 + E_R (sum Q) E_R' - sum_k V_k' V_k,   V_k of size (3, n)
//! ```
//!
//! so that a step costs `O(n)` times the looks before it instead of `O(n^2)`, and nothing but `V_k` is kept. These are
//! the equations of [`super::belief`], not an approximation.

use super::belief::{Belief, factor};
use super::known::{KnownPlace, Link};
use super::noise::position_trace;
use groma_geometry::wrap;
use nalgebra::{Matrix3, Matrix3xX, Vector3};

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
    gain: Option<Matrix3xX<f64>>,
}

/// All walks that were thought of from one belief.
pub(super) struct Branches<'a> {
    belief: &'a Belief,
    places: &'a [KnownPlace],
    pub reached: Vec<Reached>,
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
        Self { belief, places, reached: vec![root] }
    }

    /// One link further; returns the number of what is reached.
    pub fn step(&mut self, parent: usize, link: &Link) -> usize {
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
        let mut difference = self.belief.difference(camera);
        let mut robot = difference.fixed_columns_mut::<3>(0);
        robot += next.added;
        let mut ancestor = next.parent;
        while let Some(i) = ancestor {
            if let Some(gain) = &self.reached[i].gain {
                let weight: Matrix3<f64> = gain.fixed_columns::<3>(0) - gain.fixed_columns::<3>(3 * camera + 3);
                difference.gemm(-1.0, &weight.transpose(), gain, 1.0);
            }
            ancestor = self.reached[i].parent;
        }
        let look = self.belief.noise.look(self.belief.cameras[camera]);
        if let Some(gain) = factor(&difference, camera, &look) {
            next.map_trace -= self.taken(&gain);
            next.robot -= gain.fixed_columns::<3>(0).transpose() * gain.fixed_columns::<3>(0);
            next.gain = Some(gain);
        }
    }

    /// By how much a look lowers the sum of the position variances.
    fn taken(&self, gain: &Matrix3xX<f64>) -> f64 {
        let cameras = self.belief.cameras.iter().enumerate();
        cameras
            .map(|(i, at)| {
                let theta: Vector3<f64> = gain.column(3 * i + 5).into_owned();
                let x = gain.column(3 * i + 3) - theta * at.y;
                let y = gain.column(3 * i + 4) + theta * at.x;
                x.norm_squared() + y.norm_squared()
            })
            .sum()
    }
}

//! What a walk is worth, tried out: the filter itself, with noise drawn for the wheels and for every look.
//!
//! Truth follows the walk exactly; the wheels report each step of at most 0.25 m with noise,
//! `T' = T Exp(u) Exp(w)`; a camera is seen from the robot as `Z = Exp(v) T_R^-1 T_C`. The filter knows neither the walk
//! nor the building: it moves its own estimate, linearises there, and is the world-frame filter of
//! [`super::belief`] with estimates beside the covariance, `T <- Exp(K y) T`. Compared are the root mean square error of
//! the cameras' positions over runs and cameras with the standard deviation that planning promised, and the normalised
//! squared error of the whole map (3 numbers a camera, all jointly) with its degrees of freedom.

use super::belief::Belief;
use super::graph::Graph;
use super::noise::Noise;
use super::run::line;
use crate::error::Error;
use groma_geometry::{Se2, wrap};
use groma_simulation::random::{Purpose, Random};
use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};
use serde::Serialize;

/// Length of a step of the wheels [m], and of a turn [rad].
const STEP: f64 = 0.25;

/// What the runs say.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Tried {
    /// Root mean square error of the cameras' positions [m].
    pub sigma: f64,
    /// Mean over the runs of the normalised squared error of the map over its degrees of freedom.
    pub nees: f64,
    /// Runs.
    pub runs: usize,
}

/// Drives a walk, given as ways with their direction from the start, many times.
pub fn try_walk(graph: &Graph, walk: &[usize], noise: &Noise, runs: usize, seed: u64) -> Result<Tried, Error> {
    graph.validate()?;
    noise.validate()?;
    Error::unless(runs > 0, "runs", runs as f64, "must be at least 1")?;
    let (mut square, mut nees) = (0.0, 0.0);
    for run in 0..runs as u64 {
        let filter = Filter::new(graph, noise, seed.wrapping_add(run)).drive(walk)?;
        let (position, map) = filter.errors();
        square += position / runs as f64;
        nees += map / runs as f64;
    }
    Ok(Tried { sigma: square.sqrt(), nees, runs })
}

struct Filter<'a> {
    graph: &'a Graph,
    noise: &'a Noise,
    wheels: Random,
    looks: Random,
    /// Where robot and cameras are thought to be, in the order of the belief.
    estimates: Vec<Se2>,
    robot: Se2,
    /// The places of the cameras, in the order in which they were met.
    met: Vec<usize>,
    belief: Belief,
    here: usize,
}

impl<'a> Filter<'a> {
    fn new(graph: &'a Graph, noise: &'a Noise, seed: u64) -> Self {
        let at = graph.nodes[graph.start].at();
        let heading = graph.exits(graph.start).first().map_or(0.0, |&(edge, forward)| {
            let points = line(graph, edge, forward);
            angle(points[1] - points[0])
        });
        let robot = Se2::new(at.x, at.y, heading);
        let (wheels, looks) = (Random::new(seed, Purpose::Wheels), Random::new(seed, Purpose::Ranges));
        let (estimates, met, belief, here) = (vec![robot], vec![], Belief::new(*noise), graph.start);
        Self { graph, noise, wheels, looks, estimates, robot, met, belief, here }
    }

    fn drive(mut self, walk: &[usize]) -> Result<Self, Error> {
        self.look();
        for &edge in walk {
            let ends = self.graph.edges.get(edge).map(|e| e.ends).filter(|ends| ends.contains(&self.here));
            let Some(ends) = ends else {
                return Err(Error::Graph(format!(
                    "the walk takes way {edge}, which does not begin at place {}",
                    self.here
                )));
            };
            let forward = ends[0] == self.here;
            for pair in line(self.graph, edge, forward).windows(2) {
                self.straight(pair[1]);
            }
            self.here = ends[usize::from(forward)];
            self.look();
        }
        Ok(self)
    }

    fn straight(&mut self, to: Vector2<f64>) {
        let d = to - self.robot.translation;
        let turn = wrap(angle(d) - self.robot.theta());
        self.steps(Vector3::new(0.0, 0.0, turn), turn.abs(), Vector3::new(0.0, 0.0, self.noise.turn));
        let Noise { along, across, heading, .. } = *self.noise;
        self.steps(Vector3::new(d.norm(), 0.0, 0.0), d.norm(), Vector3::new(along, across, heading));
        self.robot.translation = to;
    }

    /// Moves by a tangent in equal steps; `sigma` is that after one unit of `extent`.
    fn steps(&mut self, whole: Vector3<f64>, extent: f64, sigma: Vector3<f64>) {
        let count = (extent / STEP).ceil().max(1.0);
        let (u, sigma) = (whole / count, sigma * (extent / count).sqrt());
        for _ in 0..count as usize {
            let w = sigma.map(|s| s * self.wheels.normal());
            // The wheels report u; the robot moved by u Exp(w). Truth keeps to the walk, so the report carries -w.
            self.robot = self.robot.plus(u);
            self.estimates[0] = self.estimates[0] * Se2::exp(u) * Se2::exp(-w);
            let adjoint = self.estimates[0].adjoint();
            self.belief.drive(&(adjoint * Matrix3::from_diagonal(&sigma.map(|s| s * s)) * adjoint.transpose()));
        }
    }

    fn look(&mut self) {
        if !self.graph.nodes[self.here].camera {
            return;
        }
        let Noise { position, bearing, .. } = *self.noise;
        let v = Vector3::new(position, position, bearing).map(|s| s * self.looks.normal());
        let seen = self.estimates[0] * Se2::exp(v) * self.robot.inverse() * self.truth(self.here);
        match self.met.iter().position(|&node| node == self.here) {
            Some(camera) => self.update(camera, &seen),
            None => {
                self.belief.meet(self.estimates[0].translation);
                self.met.push(self.here);
                self.estimates.push(seen);
            }
        }
    }

    /// A camera stands where its place is, not turned.
    fn truth(&self, node: usize) -> Se2 {
        let at = self.graph.nodes[node].at();
        Se2::new(at.x, at.y, 0.0)
    }

    fn update(&mut self, camera: usize, seen: &Se2) {
        self.belief.cameras[camera] = self.estimates[0].translation;
        let y = -(*seen * self.estimates[camera + 1].inverse()).log();
        let difference = self.belief.difference(camera);
        let look = self.noise.look(self.estimates[0].translation);
        let s = difference.fixed_columns::<3>(0) - difference.fixed_columns::<3>(3 * camera + 3) + look;
        let Some(weighted) = s.try_inverse().map(|inverse| inverse * y) else { return };
        let correction = difference.transpose() * weighted;
        for (i, estimate) in self.estimates.iter_mut().enumerate() {
            *estimate = Se2::exp(correction.fixed_rows::<3>(3 * i).into_owned()) * *estimate;
        }
        self.belief.meet_again(camera);
    }

    /// Mean square error of the cameras' positions, and the normalised squared error of the map over its freedom.
    fn errors(&self) -> (f64, f64) {
        let n = self.met.len();
        let truth: Vec<Se2> = self.met.iter().map(|&node| self.truth(node)).collect();
        let pairs = truth.iter().zip(&self.estimates[1..]);
        let square: f64 = pairs.clone().map(|(t, e)| (t.translation - e.translation).norm_squared()).sum();
        let error: Vec<f64> = pairs.flat_map(|(t, e)| (*t * e.inverse()).log().data.0[0]).collect();
        let (error, size) = (DVector::from_vec(error), 3 * n);
        let map: DMatrix<f64> = self.belief.covariance.view((3, 3), (size, size)).into_owned();
        let nees = map.cholesky().map_or(f64::NAN, |c| error.dot(&c.solve(&error)));
        (square / n.max(1) as f64, nees / size.max(1) as f64)
    }
}

fn angle(d: Vector2<f64>) -> f64 {
    d.y.atan2(d.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exploration::scenes::{Kind, Scene};
    use crate::exploration::{Goal, Settings, Strategy, explore};

    /// Ratio of tried to promised sigma, and NEES over freedom.
    fn compare(scene: Scene, strategy: Strategy, lambda: f64, runs: usize) -> (f64, f64) {
        let graph = scene.graph().unwrap();
        let run = explore(&graph, &Settings { strategy, goal: Goal::Lambda(lambda), ..Settings::default() }).unwrap();
        let walk: Vec<usize> = run.stops.iter().filter_map(|stop| stop.edge).collect();
        let tried = try_walk(&graph, &walk, &Noise::default(), runs, 1).unwrap();
        (tried.sigma / run.sigma, tried.nees)
    }

    const SCENES: [(Kind, usize, f64); 5] = [
        (Kind::Corridor, 10, 8.0),
        (Kind::Ring, 8, 6.25),
        (Kind::Squares, 25, 8.0),
        (Kind::Hexagons, 22, 8.0),
        (Kind::Sparse, 16, 8.0),
    ];

    #[test]
    fn the_sigma_promised_is_the_sigma_found() {
        let scene = Scene { kind: Kind::Ring, size: 8, step: 6.25, ..Scene::default() };
        let (ratio, nees) = compare(scene, Strategy::Survey, 100.0, 400);
        assert!((0.85..1.15).contains(&ratio) && (0.9..1.1).contains(&nees), "{ratio} {nees}");
    }

    #[test]
    #[allow(clippy::print_stdout)]
    #[ignore = "half a minute: 1000 filters along each of 20 walks"]
    fn the_sigma_promised_is_the_sigma_found_in_every_scene() {
        // A survey looks back late, after up to 200 m, where the filter (not the promise) suffers from linearisation.
        let rules = [
            (Strategy::Nearest, 1.1),
            (Strategy::ReturnToNearest, 1.1),
            (Strategy::Search, 1.1),
            (Strategy::Survey, 1.3),
        ];
        let mut bad = vec![];
        for ((kind, size, step), (strategy, most)) in SCENES.into_iter().flat_map(|s| rules.map(|r| (s, r))) {
            let (ratio, nees) = compare(Scene { kind, size, step, ..Scene::default() }, strategy, 100.0, 1000);
            println!("{kind:?} {strategy:?}: ratio {ratio:.3}, NEES/dof {nees:.3}");
            if !(0.9..1.1).contains(&ratio) || !(0.9..most).contains(&nees) {
                bad.push((kind, strategy, ratio, nees));
            }
        }
        assert!(bad.is_empty(), "{bad:?}");
    }

    #[test]
    fn a_walk_that_jumps_is_refused() {
        let graph = Scene { kind: Kind::Corridor, size: 4, ..Scene::default() }.graph().unwrap();
        let refused = try_walk(&graph, &[0, 2], &Noise::default(), 1, 1).unwrap_err().to_string();
        assert!(refused.contains("way 2, which does not begin at place 1"), "{refused}");
    }
}

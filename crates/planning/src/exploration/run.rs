//! An exploration of a building that the simulation knows and the robot does not: the mean drive, without noise in what
//! happens, with all noise in the covariance.

use super::belief::Belief;
use super::explorer::{Decision, Event, Explorer, Settings};
use super::graph::{Graph, Node, Passage};
use super::known::Place;
use super::noise::{Noise, position_covariance};
use crate::error::Error;
use nalgebra::{Matrix3, Vector2};
use serde::Serialize;

/// Passages that a run may take; a guard against a graph or a goal that nobody thought of.
const MOST_STOPS: usize = 100_000;

/// Where the robot came to, and what was known then.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stop {
    /// The place.
    pub node: usize,
    /// The way by which it came; none at the start.
    pub edge: Option<usize>,
    /// Distance driven so far [m].
    pub length: f64,
    /// Covariance of the robot's position: xx, xy, yy [m^2].
    pub robot: [f64; 3],
    /// Standard deviation of its heading [rad].
    pub heading: f64,
    /// Root mean square standard deviation of the cameras found so far [m].
    pub sigma: f64,
    /// Whether all cameras were found.
    pub complete: bool,
    /// Covariances of the cameras' positions in the order of `Run::cameras`: xx, xy, yy [m^2].
    pub cameras: Vec<[f64; 3]>,
}

/// A whole exploration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// The stops, the start first.
    pub stops: Vec<Stop>,
    /// Places of the cameras in the order in which they were found.
    pub cameras: Vec<usize>,
    /// Distance driven [m].
    pub length: f64,
    /// Root mean square standard deviation of the cameras' positions [m].
    pub sigma: f64,
    /// The searches.
    pub decisions: Vec<Decision>,
}

/// Explores a graph.
pub fn explore(graph: &Graph, settings: &Settings) -> Result<Run, Error> {
    explore_while(graph, settings, &mut |_| true)
}

/// Explores a graph until a callback, called at each stop, ends it.
pub fn explore_while(graph: &Graph, settings: &Settings, goes_on: &mut dyn FnMut(&Stop) -> bool) -> Result<Run, Error> {
    graph.validate()?;
    let start = place(graph, graph.start);
    let mut explorer = Explorer::new(*settings, graph.cameras(), &start, start.exits.first().copied().unwrap_or(0.0))?;
    let mut run = Run { stops: vec![], cameras: vec![], length: 0.0, sigma: 0.0, decisions: vec![] };
    run.stop(graph, &explorer, graph.start, None);
    let mut here = graph.start;
    while run.stops.last().is_none_or(&mut *goes_on)
        && let Some(exit) = explorer.next_exit()
    {
        let (edge, next, event) = arrival(graph, here, exit)?;
        explorer.observe(&event)?;
        here = next;
        run.stop(graph, &explorer, here, Some(edge));
        if run.stops.len() > MOST_STOPS {
            return Err(Error::Unreachable(format!("no end after {MOST_STOPS} passages: ask for less accuracy")));
        }
    }
    run.decisions = explorer.decisions().to_vec();
    (run.length, run.sigma) = (explorer.driven(), explorer.belief().sigma());
    Ok(run)
}

/// What the robot finds at a place.
#[must_use]
pub fn place(graph: &Graph, node: usize) -> Place {
    let heading =
        |(edge, forward): (usize, bool)| Passage::along(&line(graph, edge, forward), &Noise::default()).depart;
    let exits = graph.exits(node).into_iter().map(heading).collect();
    let Node { position, camera } = graph.nodes[node];
    Place { key: node, position, camera, exits }
}

/// The points of a way in one of its directions.
#[must_use]
pub fn line(graph: &Graph, edge: usize, forward: bool) -> Vec<Vector2<f64>> {
    let mut points = graph.points(edge);
    if !forward {
        points.reverse();
    }
    points
}

/// What happens to a robot that leaves a place by an exit: the way it takes, where it arrives, and what it finds there.
pub fn arrival(graph: &Graph, node: usize, left: usize) -> Result<(usize, usize, Event), Error> {
    let exits = graph.exits(node);
    let Some(&(edge, forward)) = exits.get(left) else {
        return Err(Error::Graph(format!("place {node} has {} exits, none numbered {left}", exits.len())));
    };
    let to = graph.edges[edge].ends[usize::from(forward)];
    let enters = graph.exits(to).iter().position(|&e| e == (edge, !forward)).unwrap_or(0);
    let points = line(graph, edge, forward);
    let via = Some(points[1..points.len() - 1].iter().map(|&p| p.into()).collect());
    Ok((edge, to, Event::Arrived { left, place: place(graph, to), enters, via }))
}

impl Run {
    fn stop(&mut self, graph: &Graph, explorer: &Explorer, node: usize, edge: Option<usize>) {
        let belief = explorer.belief();
        if belief.cameras().len() > self.cameras.len() {
            self.cameras.push(node);
        }
        let robot = belief.robot();
        self.stops.push(Stop {
            node,
            edge,
            length: explorer.driven(),
            robot: shape(&robot, graph.nodes[node].at()),
            heading: robot[(2, 2)].max(0.0).sqrt(),
            sigma: belief.sigma(),
            complete: explorer.has_found_all(),
            cameras: cameras(belief),
        });
    }
}

fn cameras(belief: &Belief) -> Vec<[f64; 3]> {
    belief.cameras().iter().enumerate().map(|(i, &at)| shape(&belief.camera(i), at)).collect()
}

fn shape(covariance: &Matrix3<f64>, at: Vector2<f64>) -> [f64; 3] {
    let position = position_covariance(covariance, at);
    [position[(0, 0)], position[(0, 1)], position[(1, 1)]]
}

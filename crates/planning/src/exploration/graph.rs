//! A building as the robot may drive through it: places, some of them under a camera, and the ways between them.

use super::noise::Noise;
use crate::error::Error;
use nalgebra::{Matrix3, Vector2};
use serde::{Deserialize, Serialize};

/// How far from the origin a place may be [m].
const FARTHEST: f64 = 1e5;

/// A place where ways meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Where it is [m].
    pub position: [f64; 2],
    /// Whether a camera of the network sees a robot there.
    pub camera: bool,
}

impl Node {
    /// Where it is [m].
    #[must_use]
    pub fn at(&self) -> Vector2<f64> {
        self.position.into()
    }
}

/// A way between two places, straight from bend to bend.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edge {
    /// Indices of the places.
    pub ends: [usize; 2],
    /// The bends on the way from the first to the second [m].
    #[serde(default)]
    pub via: Vec<[f64; 2]>,
}

/// Places and ways.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Graph {
    /// The places.
    pub nodes: Vec<Node>,
    /// The ways.
    pub edges: Vec<Edge>,
    /// Index of the place where the robot starts: the origin of what it maps.
    pub start: usize,
}

/// One way, driven in one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Passage {
    /// How far [m].
    pub length: f64,
    /// Heading at its begin [rad].
    pub depart: f64,
    /// Heading at its end [rad].
    pub arrive: f64,
    /// What it adds to the covariance of the robot, without the turn at its begin.
    pub noise: Matrix3<f64>,
}

impl Passage {
    /// Along a line of two points or more, no two neighbours equal.
    #[must_use]
    pub fn along(points: &[Vector2<f64>], noise: &Noise) -> Self {
        let headings: Vec<f64> = points.windows(2).map(|p| heading(p[1] - p[0])).collect();
        let straight: Matrix3<f64> = points.windows(2).map(|p| noise.straight(p[0], p[1])).sum();
        let bends: Matrix3<f64> =
            headings.windows(2).zip(&points[1..]).map(|(h, &p)| noise.turning(p, h[1] - h[0])).sum();
        Self {
            length: points.windows(2).map(|p| (p[1] - p[0]).norm()).sum(),
            depart: headings.first().copied().unwrap_or(0.0),
            arrive: headings.last().copied().unwrap_or(0.0),
            noise: straight + bends,
        }
    }
}

fn heading(d: Vector2<f64>) -> f64 {
    d.y.atan2(d.x)
}

impl Graph {
    /// Refuses a graph that no robot can drive.
    pub fn validate(&self) -> Result<(), Error> {
        let count = self.nodes.len();
        if self.start >= count {
            return Err(Error::Graph(format!("the start is place {} of {count}: name one that exists", self.start)));
        }
        for (i, node) in self.nodes.iter().enumerate() {
            if !node.position.iter().all(|x| x.abs() <= FARTHEST) {
                return Err(Error::Graph(format!(
                    "place {i} is at {:?}: must be finite and in a building",
                    node.position
                )));
            }
        }
        if self.cameras() == 0 {
            return Err(Error::Graph("no place bears a camera: there is nothing to map".into()));
        }
        self.edges.iter().enumerate().try_for_each(|(i, edge)| self.check_edge(i, edge))?;
        match self.unreachable() {
            Some(i) => Err(Error::Graph(format!("no way leads from the start to place {i}: add one or drop it"))),
            None => Ok(()),
        }
    }

    /// The bends and ends of a way, from its first end to its second.
    #[must_use]
    pub fn points(&self, edge: usize) -> Vec<Vector2<f64>> {
        let Edge { ends: [a, b], via } = &self.edges[edge];
        let bends = via.iter().map(|&p| Vector2::from(p));
        std::iter::once(self.nodes[*a].at()).chain(bends).chain([self.nodes[*b].at()]).collect()
    }

    /// The ways out of a place, with their direction: `(edge, from its first end)`.
    #[must_use]
    pub fn exits(&self, node: usize) -> Vec<(usize, bool)> {
        let ends = self.edges.iter().enumerate().flat_map(|(i, e)| [(i, true, e.ends[0]), (i, false, e.ends[1])]);
        ends.filter(|&(_, _, at)| at == node).map(|(i, forward, _)| (i, forward)).collect()
    }

    /// Number of cameras.
    #[must_use]
    pub fn cameras(&self) -> usize {
        self.nodes.iter().filter(|node| node.camera).count()
    }

    fn check_edge(&self, i: usize, edge: &Edge) -> Result<(), Error> {
        if let Some(end) = edge.ends.iter().find(|&&end| end >= self.nodes.len()) {
            return Err(Error::Graph(format!("way {i} ends at place {end} of {}", self.nodes.len())));
        }
        if !edge.via.iter().flatten().all(|x| x.abs() <= FARTHEST) {
            return Err(Error::Graph(format!("way {i} bends at a point that is not finite or in no building")));
        }
        if self.points(i).windows(2).any(|p| (p[1] - p[0]).norm() < 1e-6) {
            return Err(Error::Graph(format!("way {i} has a stretch without length: drop the double point")));
        }
        Ok(())
    }

    fn unreachable(&self) -> Option<usize> {
        let mut seen = vec![false; self.nodes.len()];
        let mut open = vec![self.start];
        while let Some(node) = open.pop() {
            if std::mem::replace(&mut seen[node], true) {
                continue;
            }
            open.extend(self.exits(node).iter().map(|&(e, forward)| self.edges[e].ends[usize::from(forward)]));
        }
        seen.iter().position(|&reached| !reached)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two(via: Vec<[f64; 2]>) -> Graph {
        let node = |x| Node { position: [x, 0.0], camera: true };
        Graph { nodes: vec![node(0.0), node(8.0)], edges: vec![Edge { ends: [0, 1], via }], start: 0 }
    }

    #[test]
    fn a_way_with_bends_is_as_long_as_its_stretches_and_noisier_than_the_straight_one() {
        let (straight, bent) = (two(vec![]), two(vec![[0.0, 3.0], [8.0, 3.0]]));
        let noise = Noise::default();
        let (a, b) = (Passage::along(&straight.points(0), &noise), Passage::along(&bent.points(0), &noise));
        assert_eq!((a.length, b.length), (8.0, 14.0));
        assert!(b.noise[(2, 2)] > a.noise[(2, 2)] * 14.0 / 8.0);
        assert_eq!(b.arrive, -std::f64::consts::FRAC_PI_2);
    }

    #[test]
    fn what_cannot_be_driven_is_refused_with_the_place() {
        assert_eq!(two(vec![]).validate(), Ok(()));
        let refused = |change: fn(&mut Graph), word: &str| {
            let mut graph = two(vec![]);
            change(&mut graph);
            let said = graph.validate().unwrap_err().to_string();
            assert!(said.contains(word), "{said}");
        };
        refused(|g| g.start = 7, "start is place 7 of 2");
        refused(|g| g.nodes[1].position[0] = f64::NAN, "place 1");
        refused(|g| g.edges[0].ends[1] = 5, "way 0 ends at place 5");
        refused(|g| g.edges[0].ends[1] = 0, "without length");
        refused(|g| g.edges.clear(), "to place 1");
        refused(|g| g.edges[0].via = vec![[f64::INFINITY, 0.0]], "not finite");
        refused(|g| g.nodes[1].position[0] = 1e200, "in a building");
        refused(|g| g.nodes.iter_mut().for_each(|node| node.camera = false), "nothing to map");
    }
}

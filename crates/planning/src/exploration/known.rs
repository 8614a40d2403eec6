//! What the robot knows of the building: places it has been at, the exits it saw there, and where those lead that it took.
//!
//! An exit is seen with its direction, not with where it leads. Two untaken exits that face each other in a straight
//! line, with no nearer candidate on either side and no further apart than 1.25 times the length expected in that
//! direction, are guessed to be the two ends of one way. A guess serves as a way in plans; if it turns out wrong, the
//! arrival says so.

use super::graph::Passage;
use super::noise::Noise;
use crate::error::Error;
use groma_geometry::wrap;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// How far the direction of an exit may miss the other end for the two to be guessed one way [rad].
const FACING: f64 = 0.17;
/// How much longer than expected a guessed way may be.
const STRETCH: f64 = 1.25;
/// How far ways may differ in direction to count as alike [rad].
const ALIKE: f64 = 0.35;

/// A place as the robot finds it on arrival.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Place {
    /// What the place is recognised by: the camera's number, or one that the user keeps for a junction.
    pub key: usize,
    /// Where it is in the map [m].
    pub position: [f64; 2],
    /// Whether a camera sees the robot there.
    pub camera: bool,
    /// Directions of the ways out, that of arrival included [rad].
    pub exits: Vec<f64>,
}

/// A way out of a known place.
#[derive(Clone, Debug)]
pub(super) struct Exit {
    pub heading: f64,
    pub way: Way,
}

/// What is known of a way out.
#[derive(Clone, Debug)]
pub(super) enum Way {
    /// Nobody went there yet.
    Untaken,
    /// There is no getting through.
    Blocked,
    /// It leads to a known place.
    Leads(Link),
}

/// A way between known places, in one direction.
#[derive(Clone, Debug)]
pub(super) struct Link {
    pub exit: usize,
    pub to: usize,
    /// The exit of `to` through which one comes in.
    pub enters: usize,
    pub passage: Passage,
    pub guessed: bool,
}

/// A known place.
#[derive(Clone, Debug)]
pub(super) struct KnownPlace {
    pub key: usize,
    pub at: Vector2<f64>,
    /// Its number in the belief.
    pub camera: Option<usize>,
    pub exits: Vec<Exit>,
}

/// All that is known.
#[derive(Clone, Debug)]
pub(super) struct Known {
    pub places: Vec<KnownPlace>,
    noise: Noise,
}

impl Known {
    pub fn new(noise: Noise) -> Self {
        Self { places: vec![], noise }
    }

    /// The place with this key.
    pub fn find(&self, key: usize) -> Option<usize> {
        self.places.iter().position(|place| place.key == key)
    }

    /// Adds a place; `camera` is its number in the belief.
    pub fn add(&mut self, place: &Place, camera: Option<usize>) -> usize {
        let exits = place.exits.iter().map(|&heading| Exit { heading, way: Way::Untaken }).collect();
        self.places.push(KnownPlace { key: place.key, at: place.position.into(), camera, exits });
        self.places.len() - 1
    }

    /// Joins two exits by a way that was driven from the first to the second, with bends `via`.
    pub fn join(&mut self, from: (usize, usize), to: (usize, usize), via: &[Vector2<f64>]) -> Result<Link, Error> {
        let points = self.line(from.0, to.0, via);
        if points.windows(2).any(|p| (p[1] - p[0]).norm() < 1e-6) {
            return Err(Error::Graph(format!("a way without length into place {}", self.places[to.0].key)));
        }
        let (there, back) = self.passages(&points);
        let link = |from: (usize, usize), to: (usize, usize), passage| Link {
            exit: from.1,
            to: to.0,
            enters: to.1,
            passage,
            guessed: false,
        };
        let driven = link(from, to, there);
        self.places[from.0].exits[from.1].way = Way::Leads(driven.clone());
        self.places[to.0].exits[to.1].way = Way::Leads(link(to, from, back));
        Ok(driven)
    }

    /// Whether a known way out of a place is as long as one with these bends.
    pub fn is_as_long(&self, link: &Link, from: usize, via: &[Vector2<f64>]) -> bool {
        let points = self.line(from, link.to, via);
        let length: f64 = points.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
        (length - link.passage.length).abs() < 1e-6
    }

    /// Marks an exit, and the other end of its way if that is known, as one that there is no getting through.
    pub fn block(&mut self, place: usize, exit: usize) {
        let before = std::mem::replace(&mut self.places[place].exits[exit].way, Way::Blocked);
        if let Way::Leads(link) = before {
            self.places[link.to].exits[link.enters].way = Way::Blocked;
        }
    }

    /// Takes back where an exit leads, on both ends: somebody found it to lead elsewhere.
    pub fn forget(&mut self, place: usize, exit: usize) {
        let before = std::mem::replace(&mut self.places[place].exits[exit].way, Way::Untaken);
        if let Way::Leads(link) = before {
            self.places[link.to].exits[link.enters].way = Way::Untaken;
        }
    }

    /// Mean length of the ways in about a direction, forwards or backwards; of all ways if there are none; else 0 [m].
    pub fn expected_length(&self, heading: f64) -> f64 {
        let ways = self.places.iter().flat_map(|place| &place.exits);
        let driven =
            ways.filter_map(|exit| if let Way::Leads(l) = &exit.way { Some((exit, &l.passage)) } else { None });
        let (mut alike, mut all) = ((0.0, 0.0), (0.0, 0.0));
        for (exit, passage) in driven {
            let near = wrap(2.0 * (exit.heading - heading)).abs() < 2.0 * ALIKE;
            alike = if near { (alike.0 + passage.length, alike.1 + 1.0) } else { alike };
            all = (all.0 + passage.length, all.1 + 1.0);
        }
        let (sum, count) = if alike.1 > 0.0 { alike } else { all };
        if count > 0.0 { sum / count } else { 0.0 }
    }

    /// The exits that nobody took.
    pub fn untaken(&self, place: usize) -> impl Iterator<Item = usize> {
        let exits = self.places[place].exits.iter().enumerate();
        exits.filter(|(_, exit)| matches!(exit.way, Way::Untaken)).map(|(i, _)| i)
    }

    /// The ways out of every place that lead to known places; those that are guessed too, if requested.
    pub fn links(&self, guess: bool) -> Vec<Vec<Link>> {
        let leads = |exit: &Exit| if let Way::Leads(link) = &exit.way { Some(link.clone()) } else { None };
        let mut links: Vec<Vec<Link>> =
            self.places.iter().map(|place| place.exits.iter().filter_map(leads).collect()).collect();
        if guess {
            self.guesses().into_iter().for_each(|(from, link)| links[from].push(link));
        }
        links
    }

    /// Pairs of untaken exits that face each other, each way in both directions.
    fn guesses(&self) -> Vec<(usize, Link)> {
        let open: Vec<(usize, usize)> =
            (0..self.places.len()).flat_map(|p| self.untaken(p).map(move |e| (p, e))).collect();
        let partner: Vec<Option<usize>> = open.iter().map(|&end| self.opposite(end, &open)).collect();
        let mutual = |i: usize| partner[i].filter(|&j| partner[j] == Some(i)).map(|j| (i, j));
        let pairs = (0..open.len()).filter_map(mutual);
        pairs.map(|(i, j)| (open[i].0, self.guessed(open[i], open[j]))).collect()
    }

    fn guessed(&self, (from, exit): (usize, usize), (to, enters): (usize, usize)) -> Link {
        let passage = Passage::along(&self.line(from, to, &[]), &self.noise);
        Link { exit, to, enters, passage, guessed: true }
    }

    /// The nearest open exit that faces this one.
    fn opposite(&self, end: (usize, usize), open: &[(usize, usize)]) -> Option<usize> {
        let apart = |i: usize| (self.places[open[i].0].at - self.places[end.0].at).norm();
        let facing = (0..open.len()).filter(|&i| self.faces(end, open[i]) && self.faces(open[i], end));
        let limit = STRETCH * self.expected_length(self.places[end.0].exits[end.1].heading);
        facing.filter(|&i| apart(i) <= limit).min_by(|&i, &j| apart(i).total_cmp(&apart(j)))
    }

    fn faces(&self, (a, exit): (usize, usize), (b, _): (usize, usize)) -> bool {
        let d = self.places[b].at - self.places[a].at;
        a != b && wrap(d.y.atan2(d.x) - self.places[a].exits[exit].heading).abs() < FACING
    }

    fn line(&self, from: usize, to: usize, via: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
        let ends = (self.places[from].at, self.places[to].at);
        std::iter::once(ends.0).chain(via.iter().copied()).chain([ends.1]).collect()
    }

    fn passages(&self, points: &[Vector2<f64>]) -> (Passage, Passage) {
        let back: Vec<_> = points.iter().rev().copied().collect();
        (Passage::along(points, &self.noise), Passage::along(&back, &self.noise))
    }
}

/// Distance from every place to the nearest end, ends counted with the cost they begin with (infinite: no end); the plain
/// form of Dijkstra's method, quadratic in the places.
pub(super) fn distances(links: &[Vec<Link>], ends: &[f64]) -> Vec<f64> {
    let mut distance = ends.to_vec();
    let mut done = vec![false; links.len()];
    // Ways run in both directions with one length, so that the search may run backwards.
    while let Some(at) = nearest(&distance, &done) {
        done[at] = true;
        for link in &links[at] {
            distance[link.to] = distance[link.to].min(distance[at] + link.passage.length);
        }
    }
    distance
}

/// The shortest way from one place to another; None where there is none.
pub(super) fn shortest(links: &[Vec<Link>], from: usize, to: usize) -> Option<Vec<Link>> {
    let mut ends = vec![f64::INFINITY; links.len()];
    ends[to] = 0.0;
    let left = distances(links, &ends);
    let (mut at, mut walk) = (from, vec![]);
    while at != to {
        let ahead = |link: &&Link| left[link.to] + link.passage.length;
        let next = links[at].iter().filter(|l| left[l.to] < left[at]).min_by(|a, b| ahead(a).total_cmp(&ahead(b)))?;
        walk.push(next.clone());
        at = next.to;
    }
    Some(walk)
}

fn nearest(distance: &[f64], done: &[bool]) -> Option<usize> {
    let open = (0..distance.len()).filter(|&i| !done[i] && distance[i].is_finite());
    open.min_by(|&i, &j| distance[i].total_cmp(&distance[j]))
}

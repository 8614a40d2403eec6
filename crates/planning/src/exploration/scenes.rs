//! Buildings to explore: idealised ones, in size and density, some drawn from a seed.
//!
//! | | cameras |
//! |---|---|
//! | `corridor` | along a line |
//! | `ring` | on a circle, its circumference `step` a camera |
//! | `squares`, `rectangles` | on a lattice `step` by `step`, `3 step` by `step` |
//! | `triangles`, `hexagons` | on lattices of these, with ways of length `step` |
//! | `sparse` | on a square lattice, joined by a random spanning tree and a share `density` of the other ways: a family from a tree to the whole lattice |
//!
//! The number of cameras is the one requested, or, for the lattices of triangles and hexagons, the nearest that they
//! have. The start is the first camera, at the origin, which is a corner of a lattice.

use super::graph::{Edge, Graph, Node};
use crate::error::Error;
use groma_estimation::streams::{Purpose, Random};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A kind of building.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Along a line.
    Corridor,
    /// On a circle.
    Ring,
    /// A square lattice.
    Squares,
    /// A lattice with long ways in one direction.
    Rectangles,
    /// A lattice of triangles.
    Triangles,
    /// A lattice of hexagons.
    Hexagons,
    /// Part of a square lattice.
    Sparse,
}

/// A building to draw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Its kind.
    pub kind: Kind,
    /// Number of cameras.
    pub size: usize,
    /// Length of a way [m].
    pub step: f64,
    /// Of `sparse`: share of the ways beyond a tree.
    pub density: f64,
    /// Of `sparse`: draws the ways.
    pub seed: u64,
}

impl Default for Scene {
    fn default() -> Self {
        Self { kind: Kind::Sparse, size: 16, step: 8.0, density: 0.7, seed: 0 }
    }
}

impl Scene {
    /// Draws it.
    pub fn graph(&self) -> Result<Graph, Error> {
        let Self { kind, size, step, density, seed } = *self;
        Error::unless((2..=10_000).contains(&size), "size", size as f64, "must be 2 to 10000")?;
        Error::unless(step > 0.0 && step.is_finite(), "step", step, "must be above 0 and finite")?;
        Error::unless((0.0..=1.0).contains(&density), "density", density, "must be 0 to 1")?;
        Ok(match kind {
            Kind::Corridor => lattice(size, size, step, step),
            Kind::Ring => ring(size, step),
            Kind::Squares => lattice(size, columns(size, 1.0), step, step),
            Kind::Rectangles => lattice(size, columns(size, 0.75), 3.0 * step, step),
            Kind::Triangles => triangles(size, step),
            Kind::Hexagons => hexagons(size, step),
            Kind::Sparse => thinned(&lattice(size, columns(size, 1.0), step, step), density, seed),
        })
    }
}

/// Columns of a lattice whose columns are to its rows about as `ratio` to 1.
fn columns(size: usize, ratio: f64) -> usize {
    ((size as f64 * ratio).sqrt().round() as usize).max(1)
}

fn camera(x: f64, y: f64) -> Node {
    Node { position: [x, y], camera: true }
}

fn way(a: usize, b: usize) -> Edge {
    Edge { ends: [a, b], via: vec![] }
}

fn ring(size: usize, step: f64) -> Graph {
    let radius = size as f64 * step / TAU;
    let on = |i: usize| (TAU * i as f64 / size as f64).sin_cos();
    let nodes = (0..size).map(|i| camera(radius * on(i).0, radius * (1.0 - on(i).1))).collect();
    let closes = usize::from(size > 2);
    Graph { nodes, edges: (0..size - 1 + closes).map(|i| way(i, (i + 1) % size)).collect(), start: 0 }
}

fn lattice(size: usize, columns: usize, dx: f64, dy: f64) -> Graph {
    let nodes = (0..size).map(|k| camera((k % columns) as f64 * dx, (k / columns) as f64 * dy)).collect();
    let edges = (0..size).flat_map(|k| {
        let left = (k % columns > 0).then(|| way(k - 1, k));
        let below = (k >= columns).then(|| way(k - columns, k));
        left.into_iter().chain(below)
    });
    Graph { nodes, edges: edges.collect(), start: 0 }
}

fn triangles(size: usize, step: f64) -> Graph {
    let rows = ((size as f64 * 0.75).sqrt().round() as usize).max(2);
    let width = (((size as f64 + (rows / 2) as f64) / rows as f64).round() as usize).max(2);
    let row = |j: usize| (0..width - j % 2).map(move |i| (i as f64 + 0.5 * (j % 2) as f64, j));
    let spots: Vec<(f64, usize)> = (0..rows).flat_map(row).collect();
    near(spots.iter().map(|&(x, j)| [x * step, j as f64 * step * 0.75_f64.sqrt()]).collect(), step)
}

fn hexagons(size: usize, step: f64) -> Graph {
    let high = (((size + 2) as f64 / 2.0).sqrt() as usize).max(2);
    let wide = (((size + 2) as f64 / (2 * high) as f64).round() as usize).max(2);
    let (last, right) = (high - 1, 2 * wide - 1);
    let spots = (0..=last).flat_map(|k| {
        let from = usize::from(k == 0 || (k == last && last % 2 == 1));
        let to = right - usize::from(k == last && last.is_multiple_of(2));
        (from..=to).map(move |i| (k, i))
    });
    let at = |(k, i): (usize, usize)| {
        let up = 0.5 * ((i + k) % 2) as f64;
        [i as f64 * step * 0.75_f64.sqrt(), step * (1.5 * k as f64 + up)]
    };
    near(spots.map(at).collect(), step)
}

/// Joins places that are one step apart, and moves the first to the origin.
fn near(spots: Vec<[f64; 2]>, step: f64) -> Graph {
    let at: Vec<Vector2<f64>> = spots.iter().map(|&p| Vector2::from(p) - Vector2::from(spots[0])).collect();
    let pairs = (0..at.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
    let edges = pairs.filter(|&(a, b)| ((at[a] - at[b]).norm() - step).abs() < 1e-6 * step).map(|(a, b)| way(a, b));
    Graph { edges: edges.collect(), nodes: at.iter().map(|p| camera(p.x, p.y)).collect(), start: 0 }
}

/// A random spanning tree (Kruskal's over a random order), and a share of the other ways.
fn thinned(full: &Graph, density: f64, seed: u64) -> Graph {
    let mut random = Random::new(seed, Purpose::Building);
    let mut order: Vec<(f64, usize)> = (0..full.edges.len()).map(|i| (random.uniform(0.0, 1.0), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut group: Vec<usize> = (0..full.nodes.len()).collect();
    let mut edges = vec![];
    for &(_, i) in &order {
        let [a, b] = full.edges[i].ends.map(|end| group[end]);
        if a != b {
            group.iter_mut().filter(|g| **g == a).for_each(|g| *g = b);
        }
        if a != b || random.chance(density) {
            edges.push(full.edges[i].clone());
        }
    }
    Graph { nodes: full.nodes.clone(), edges, start: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(kind: Kind, size: usize) -> Graph {
        let graph = Scene { kind, size, ..Scene::default() }.graph().unwrap();
        graph.validate().unwrap();
        graph
    }

    #[test]
    fn lattices_have_the_ways_of_the_textbook() {
        let count = |kind, size| (drawn(kind, size).nodes.len(), drawn(kind, size).edges.len());
        assert_eq!(count(Kind::Corridor, 10), (10, 9));
        assert_eq!(count(Kind::Ring, 8), (8, 8));
        assert_eq!(count(Kind::Squares, 25), (25, 40));
        assert_eq!(count(Kind::Rectangles, 12), (12, 17));
        assert_eq!(count(Kind::Triangles, 14), (14, 27));
        assert_eq!(count(Kind::Hexagons, 22), (22, 27));
    }

    #[test]
    fn density_leads_from_a_tree_to_the_lattice() {
        let ways = |density| Scene { density, ..Scene::default() }.graph().unwrap().edges.len();
        assert_eq!((ways(0.0), ways(1.0)), (15, 24));
        assert!((16..24).contains(&ways(0.5)));
    }

    #[test]
    fn a_seed_draws_the_same_building_and_another_another() {
        let draw = |seed| Scene { seed, ..Scene::default() }.graph().unwrap();
        assert_eq!(draw(3), draw(3));
        assert_ne!(draw(3), draw(4));
    }

    #[test]
    fn every_size_is_drawn_connected() {
        for kind in [Kind::Corridor, Kind::Ring, Kind::Squares, Kind::Rectangles, Kind::Triangles, Kind::Hexagons] {
            (2..40).for_each(|size| assert!(!drawn(kind, size).edges.is_empty()));
        }
    }
}

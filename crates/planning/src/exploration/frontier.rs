//! Where new ground begins, and what it costs to leave it for later.
//!
//! A walk that ends at one place with untaken exits leaves the others to be fetched. Its cost at the end is therefore
//!
//! ```text
//! cost(end) = expected length of the exit + length of a short open tour from there through all other such places
//! ```
//!
//! the tour by nearest neighbour and 2-opt (Croes 1958) over shortest paths. An exit is expected to be as long as the
//! ways driven so far in about its direction, or as all if there are none: buildings have grain. Of the exits of a place
//! the shortest expected is taken, of equal ones the rightmost, which follows walls and leaves no pockets behind.

use super::known::{Known, Link, distances};
use groma_geometry::wrap;

/// The untaken exits of every place, and what a walk costs that ends there.
pub(super) struct Frontier {
    pub exits: Vec<Vec<usize>>,
    pub costs: Vec<f64>,
}

impl Frontier {
    /// Exits that a guess explains count only where no others are left.
    pub fn new(known: &Known, links: &[Vec<Link>]) -> Self {
        let all: Vec<Vec<usize>> = (0..links.len()).map(|p| known.untaken(p).collect()).collect();
        let guessed = |p: usize, e: usize| links[p].iter().any(|link| link.guessed && link.exit == e);
        let unexplained: Vec<Vec<usize>> =
            all.iter().enumerate().map(|(p, row)| row.iter().copied().filter(|&e| !guessed(p, e)).collect()).collect();
        let exits = if unexplained.iter().all(Vec::is_empty) { all } else { unexplained };
        let costs = exits.iter().map(|row| if row.is_empty() { f64::INFINITY } else { 0.0 }).collect();
        Self { exits, costs }
    }

    /// With the cost of what is left behind.
    pub fn with_tours(mut self, known: &Known, links: &[Vec<Link>]) -> Self {
        let ends: Vec<usize> = (0..links.len()).filter(|&p| !self.exits[p].is_empty()).collect();
        let apart: Vec<Vec<f64>> = ends.iter().map(|&end| between(links, end, &ends)).collect();
        for (i, &end) in ends.iter().enumerate() {
            let expected = self.exits[end].iter().map(|&e| known.expected_length(known.places[end].exits[e].heading));
            self.costs[end] = expected.fold(f64::INFINITY, f64::min) + tour(&apart, i);
        }
        self
    }

    /// The exit to take for a robot that comes to a place with a heading.
    pub fn choice(&self, known: &Known, place: usize, heading: f64) -> Option<usize> {
        let direction = |e: usize| known.places[place].exits[e].heading;
        let rank = |e: usize| (known.expected_length(direction(e)), wrap(direction(e) - heading));
        let less = |a: (f64, f64), b: (f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
        self.exits[place].iter().copied().min_by(|&a, &b| less(rank(a), rank(b)))
    }
}

/// Distances from one place to the others.
fn between(links: &[Vec<Link>], from: usize, to: &[usize]) -> Vec<f64> {
    let mut start = vec![f64::INFINITY; links.len()];
    start[from] = 0.0;
    let distance = distances(links, &start);
    to.iter().map(|&i| distance[i]).collect()
}

/// Length of a short open tour from the first through all.
fn tour(apart: &[Vec<f64>], first: usize) -> f64 {
    let mut order = nearest_neighbours(apart, first);
    while improve(apart, &mut order) {}
    order.windows(2).map(|pair| apart[pair[0]][pair[1]]).sum()
}

fn nearest_neighbours(apart: &[Vec<f64>], first: usize) -> Vec<usize> {
    let (mut order, mut last) = (vec![first], first);
    let mut left: Vec<usize> = (0..apart.len()).filter(|&i| i != first).collect();
    while let Some(k) = (0..left.len()).min_by(|&a, &b| apart[last][left[a]].total_cmp(&apart[last][left[b]])) {
        last = left.remove(k);
        order.push(last);
    }
    order
}

/// Turns a stretch of the tour round if that makes it shorter.
fn improve(apart: &[Vec<f64>], order: &mut [usize]) -> bool {
    let n = order.len();
    for (i, j) in (1..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))) {
        let onward = |from: usize| order.get(j + 1).map_or(0.0, |&next| apart[from][next]);
        let now = apart[order[i - 1]][order[i]] + onward(order[j]);
        if apart[order[i - 1]][order[j]] + onward(order[i]) < now - 1e-9 {
            order[i..=j].reverse();
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tour_along_a_line_from_its_middle_goes_to_the_near_end_first() {
        let at = [0.0_f64, 1.0, 3.0, 4.0, 9.0];
        let apart: Vec<Vec<f64>> = at.iter().map(|a| at.iter().map(|b| (a - b).abs()).collect()).collect();
        assert_eq!(tour(&apart, 2), 3.0 + 9.0);
        assert_eq!(tour(&apart, 0), 9.0);
    }
}

//! Votes of all pairs of landmarks for motions on a grid (affine Hough transform).
//!
//! ```text
//! for every theta of the grid, every compatible (i, j):   vote for t = a_i - R(theta) (b_j - middle of b)
//! cells of t:  side = tolerance, index = floor;    step of theta:  tolerance / (farthest b from the middle)
//! support of a corner of the grid = votes of the four cells around it
//! ```
//!
//! A motion is then off by at most 2 tolerances at the landmarks, the gate of the first refinement; one on the border of
//! cells is not split. The grid of t covers all places where the middle of b can lie with any landmark of a paired; one
//! theta is looked at at a time, and the cells it touched are cleared after it. The pairs of a cell are made one-to-one by
//! the refinement. Cells grow where the maps are so large that the grid would not fit.
//! Source: the idea is that of the association in the library of Kallasi, Rizzini, Caselli, RA-L 2016.

use super::problem::Problem;
use groma_geometry::{Se2, So2};
use nalgebra::Vector2;
use std::cmp::Reverse;
use std::f64::consts::{PI, TAU};

/// Most cells of the grid of t.
const MOST_CELLS: f64 = 4e6;
/// Most steps of theta.
const MOST_TURNS: f64 = 1440.0;
/// Motions kept of one theta, and in all, per requested hypothesis.
const KEPT: usize = 12;

/// The motions with most votes, best first.
pub(super) fn propose<F: Fn(usize, usize) -> bool>(problem: &Problem<F>) -> Vec<(usize, Se2)> {
    let &Problem { a, b, middle, options, .. } = problem;
    let radius = b.iter().map(|p| (p - middle).norm()).fold(0.0, f64::max);
    let turns = (TAU * radius / options.tolerance).ceil().clamp(8.0, MOST_TURNS);
    let mut grid = Grid::new(a, radius, options.tolerance);
    let most = KEPT * options.max_hypotheses;
    let (mut best, mut peaks) = (Vec::new(), Vec::new());
    for k in 0..turns as usize {
        let rotation = So2::exp(k as f64 * TAU / turns - PI);
        for (j, p) in b.iter().enumerate() {
            let arm = rotation.act(p - middle);
            let allowed = a.iter().enumerate().filter(|(i, _)| (problem.compatible)(*i, j));
            allowed.for_each(|(_, q)| grid.vote(q - arm));
        }
        grid.take_peaks(options.min_pairs, &mut peaks);
        keep(&mut peaks, most);
        best.extend(
            peaks
                .drain(..)
                .map(|(votes, landed)| (votes, Se2 { rotation, translation: landed - rotation.act(middle) })),
        );
        if best.len() > 64 * most {
            keep(&mut best, most);
        }
    }
    keep(&mut best, most);
    best
}

/// Leave those with most votes, the first of equals, in order.
fn keep<T>(ranked: &mut Vec<(usize, T)>, most: usize) {
    ranked.sort_by_key(|(votes, _)| Reverse(*votes));
    ranked.truncate(most);
}

/// Votes for where the middle of b lies.
struct Grid {
    low: Vector2<f64>,
    side: f64,
    columns: usize,
    votes: Vec<u16>,
    touched: Vec<usize>,
}

impl Grid {
    fn new(a: &[Vector2<f64>], radius: f64, tolerance: f64) -> Self {
        let low = a.iter().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(p)).add_scalar(-radius);
        let high = a.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(p)).add_scalar(radius);
        let extent = high - low;
        let side = tolerance.max((extent.x * extent.y / MOST_CELLS).sqrt()).max(extent.amax() / MOST_CELLS);
        // A cell to spare on every side, for the four cells around a corner.
        let size = extent.map(|x| (x / side) as usize + 3);
        let low = low.add_scalar(-side);
        Self { low, side, columns: size.x, votes: vec![0; size.x * size.y], touched: Vec::new() }
    }

    fn vote(&mut self, landed: Vector2<f64>) {
        let at = ((landed - self.low) / self.side).map(|x| x as usize);
        let cell = at.y * self.columns + at.x;
        if let Some(votes) = self.votes.get_mut(cell) {
            if *votes == 0 {
                self.touched.push(cell);
            }
            *votes = votes.saturating_add(1);
        }
    }

    /// The corners of the grid with `least` votes around them, and no more votes; clears the grid.
    fn take_peaks(&mut self, least: usize, peaks: &mut Vec<(usize, Vector2<f64>)>) {
        let votes = |cell: usize| usize::from(self.votes.get(cell).copied().unwrap_or(0));
        for &cell in &self.touched {
            // The corner at the high end of the cell: the cells beyond it.
            let sum = votes(cell) + votes(cell + 1) + votes(cell + self.columns) + votes(cell + self.columns + 1);
            if sum >= least {
                let at = Vector2::new((cell % self.columns + 1) as f64, (cell / self.columns + 1) as f64);
                peaks.push((sum, self.low + at * self.side));
            }
        }
        for cell in self.touched.drain(..) {
            self.votes[cell] = 0;
        }
    }
}

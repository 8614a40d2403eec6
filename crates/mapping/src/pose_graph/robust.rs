//! Which robust edges are false: truncated least squares by graduated non-convexity.
//!
//! The cost of a robust edge is `min(r^2, c^2)`, with `r^2` its chi-square. Graduated non-convexity puts a surrogate
//! with a parameter mu in its place, nearly convex for small mu and equal to the truncated cost for large mu, and
//! alternates a weighted descent step with the weights
//!
//! ```text
//! w = 0                              r^2 >= (mu + 1)/mu c^2
//! w = 1                              r^2 <= mu/(mu + 1) c^2
//! w = c/r sqrt(mu (mu + 1)) - mu     between
//! ```
//!
//! while mu grows from `c^2 / (2 max r^2 - c^2)`.
//! Source: Yang, Antonante, Tzoumas, Carlone, RA-L 5 (2020) 1127, section IV and equations (13)-(14).
//!
//! The truncated cost has many minima, so three candidates are made and the cheapest in that very cost is taken:
//! plain least squares (done at once when every robust edge fits: there is nothing to reject), the descent from the
//! given start with what does not fit there left out (so a good start is never made worse), and graduated
//! non-convexity. What it cannot do: tell a false set from a true one when the false set agrees with itself better.

use super::solve::{Solver, State};
use super::{Edge, Error};
use groma_geometry::Se2;

/// Beyond this mu the surrogate is the truncated cost to 1 %.
const LAST_CONTROL: f64 = 100.0;
/// Most rounds of leaving out and descending.
const MAX_ROUNDS: usize = 20;
/// In the graduated steps no edge loses all its weight, so that a node which only robust edges hold stays held.
const LEAST_WEIGHT: f64 = 1e-9;

/// The minimum of the truncated cost.
pub(super) fn minimize(solver: &mut Solver<'_>) -> Result<State, Error> {
    let all = vec![1.0; solver.graph.edges.len()];
    let plain = solver.descend(solver.graph.nodes.clone(), all)?;
    if kept(solver, &plain).iter().all(|&w| w == 1.0) {
        return Ok(plain);
    }
    let start = State { nodes: solver.graph.nodes.clone(), weights: plain.weights.clone(), converged: false };
    let mut best = truncate(solver, plain)?;
    for candidate in [start.clone(), graduate(solver, start)?] {
        let candidate = truncate(solver, candidate)?;
        if truncated_cost(solver, &candidate) < truncated_cost(solver, &best) {
            best = candidate;
        }
    }
    Ok(best)
}

/// Leaves out what does not fit and descends, until what is left out no longer changes.
fn truncate(solver: &mut Solver<'_>, mut state: State) -> Result<State, Error> {
    for _ in 0..MAX_ROUNDS {
        let weights = kept(solver, &state);
        let settled = state.converged && weights == state.weights;
        if settled {
            break;
        }
        state = solver.descend(state.nodes, weights)?;
    }
    Ok(state)
}

/// Graduated non-convexity from the nodes of `state`.
fn graduate(solver: &mut Solver<'_>, state: State) -> Result<State, Error> {
    let limit = solver.options.inlier_chi_square;
    let mut nodes = state.nodes;
    let worst = robust_chi_squares(solver, &nodes).fold(limit, f64::max);
    let mut control = limit / (2.0 * worst - limit);
    let mut radius = f64::INFINITY;
    while control < LAST_CONTROL {
        let weights: Vec<_> = graduated_weights(solver, &nodes, control);
        let cost = solver.cost(&nodes, &weights);
        if let Some(step) = solver.step(&nodes, &weights, cost, &mut radius)? {
            nodes = step.nodes;
        }
        control *= solver.options.convexity_step;
    }
    Ok(State { nodes, weights: state.weights, converged: false })
}

fn graduated_weights(solver: &Solver<'_>, nodes: &[Se2], control: f64) -> Vec<f64> {
    let limit = solver.options.inlier_chi_square;
    let weight = |chi_square: f64| graduated_weight(chi_square / limit, control).max(LEAST_WEIGHT);
    let edges = solver.graph.edges.iter();
    edges.map(|e| if e.robust { weight(e.chi_square(nodes)) } else { 1.0 }).collect()
}

/// The weight at `ratio = r^2 / c^2`.
fn graduated_weight(ratio: f64, control: f64) -> f64 {
    if ratio <= control / (control + 1.0) {
        1.0
    } else if ratio >= (control + 1.0) / control {
        0.0
    } else {
        (control * (control + 1.0) / ratio).sqrt() - control
    }
}

/// 1 for the edges that count at these nodes, 0 for the others.
fn kept(solver: &Solver<'_>, state: &State) -> Vec<f64> {
    let limit = solver.options.inlier_chi_square;
    let fits = |e: &Edge| !e.robust || e.chi_square(&state.nodes) <= limit;
    solver.graph.edges.iter().map(|e| if fits(e) { 1.0 } else { 0.0 }).collect()
}

fn truncated_cost(solver: &Solver<'_>, state: &State) -> f64 {
    let limit = solver.options.inlier_chi_square;
    let cost = |e: &Edge| {
        let chi_square = e.chi_square(&state.nodes);
        if e.robust { chi_square.min(limit) } else { chi_square }
    };
    solver.graph.edges.iter().map(cost).sum()
}

fn robust_chi_squares<'a>(solver: &'a Solver<'_>, nodes: &'a [Se2]) -> impl Iterator<Item = f64> + use<'a> {
    solver.graph.edges.iter().filter(|e| e.robust).map(|e| e.chi_square(nodes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_continuous_and_fall() {
        for control in [1e-6, 0.1, 1.0, 50.0] {
            let weights: Vec<_> =
                (0..4000).map(|k| graduated_weight(f64::from(k) * 0.002 / control, control)).collect();
            assert!(weights.windows(2).all(|w| w[1] <= w[0] && w[0] - w[1] < 0.06));
            assert_eq!((weights[0], weights[3999]), (1.0, 0.0));
        }
    }
}

//! Which robust edges are false: truncated least squares by graduated non-convexity.
//!
//! The cost of a robust edge is `min(r^2, c^2)`, with `r^2` its chi-square. Graduated non-convexity puts a surrogate
//! with a parameter mu in its place, nearly convex for small mu and equal to the truncated cost for large mu, and
//! alternates a short weighted descent with the weights
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
//! The truncated cost has many minima. So first plain least squares is tried: when every robust edge fits, there is
//! nothing to reject. Else two candidates compete in the truncated cost itself: the descent from the given start with
//! what does not fit there left out (so a good start is never made worse), and graduated non-convexity. The winner takes
//! back what was left out wrongly, as told in `admit.rs`. What it cannot do: tell a false set of edges from a true one
//! when the false set agrees with itself better.

use super::solve::{Effort, Solver, State};
use super::{Edge, Error, admit};
use groma_geometry::Se2;

/// Beyond this mu the surrogate is the truncated cost to 1 %.
const LAST_CONTROL: f64 = 100.0;
/// Most rounds of leaving out and descending, and of taking back.
const MAX_ROUNDS: usize = 20;
/// Enough to see which edges fit.
const BRIEF: Effort = Effort { iterations: 12, tolerance: 1e-3 };

/// Towards the minimum of one surrogate; the next one moves it anyway.
const GRADUAL: Effort = Effort { iterations: 3, tolerance: 1e-2 };

/// The minimum of the truncated cost.
pub(super) fn minimize(solver: &mut Solver<'_>) -> Result<State, Error> {
    let all = vec![1.0; solver.graph.edges.len()];
    let start = State { nodes: solver.graph.nodes.clone(), weights: all.clone(), converged: false };
    let plain = solver.descend(start.nodes.clone(), all, BRIEF)?;
    if kept(solver, &plain) == plain.weights {
        return truncate(solver, plain);
    }
    let graduated = graduate(solver, start.clone())?;
    let (mut best, other) = (truncate(solver, start)?, truncate(solver, graduated)?);
    if truncated_cost(solver, &other) < truncated_cost(solver, &best) {
        best = other;
    }
    for _ in 0..MAX_ROUNDS {
        let Some(weights) = admit::weights(solver, &best)? else { break };
        let wider = solver.descend(best.nodes.clone(), weights, BRIEF)?;
        let wider = truncate(solver, wider)?;
        if truncated_cost(solver, &wider) >= truncated_cost(solver, &best) {
            break;
        }
        best = wider;
    }
    Ok(best)
}

/// Leaves out what does not fit and descends, briefly and then fully, until what is left out no longer changes.
fn truncate(solver: &mut Solver<'_>, mut state: State) -> Result<State, Error> {
    for effort in [BRIEF, solver.full_effort()] {
        state.converged = false;
        for _ in 0..MAX_ROUNDS {
            let weights = kept(solver, &state);
            if state.converged && weights == state.weights {
                break;
            }
            state = solver.descend(state.nodes, weights, effort)?;
        }
    }
    Ok(state)
}

/// Graduated non-convexity from the nodes of `state`.
fn graduate(solver: &mut Solver<'_>, state: State) -> Result<State, Error> {
    let limit = solver.options.inlier_chi_square;
    let mut nodes = state.nodes;
    let robust = solver.graph.edges.iter().filter(|e| e.robust);
    let worst = robust.map(|e| e.chi_square(&nodes)).fold(limit, f64::max);
    let mut control = limit / (2.0 * worst - limit);
    while control < LAST_CONTROL {
        let weights = graduated_weights(solver, &nodes, control);
        nodes = solver.descend(nodes, weights, GRADUAL)?.nodes;
        control *= solver.options.convexity_step;
    }
    Ok(State { nodes, weights: state.weights, converged: false })
}

fn graduated_weights(solver: &Solver<'_>, nodes: &[Se2], control: f64) -> Vec<f64> {
    let limit = solver.options.inlier_chi_square;
    let weight = |e: &Edge| if e.robust { graduated_weight(e.chi_square(nodes) / limit, control) } else { 1.0 };
    solver.graph.edges.iter().map(weight).collect()
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_continuous_and_fall() {
        for control in [1e-6, 0.1, 1.0, 50.0] {
            let ratios = (0..4000).map(|k| f64::from(k) * 0.001 * (1.0 + 1.0 / control));
            let weights: Vec<_> = ratios.map(|ratio| graduated_weight(ratio, control)).collect();
            assert!(weights.windows(2).all(|w| w[1] <= w[0]));
            assert_eq!((weights[0], weights[3999]), (1.0, 0.0));
            let edge = control / (control + 1.0);
            assert!((graduated_weight(edge * (1.0 + 1e-12), control) - 1.0).abs() < 1e-9);
            assert!(graduated_weight((1.0 - 1e-12) / edge, control).abs() < 1e-9);
        }
    }
}

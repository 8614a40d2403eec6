//! The best mixture of arcs, with a certified bound: cutting planes.
//!
//! With w repetitions of arcs of information `N_k` and cost `c_k`, C the inverse of `sum w_k N_k`:
//!
//! ```text
//! minimise c^T w   with   C_ii <= tolerance_i^2,   w >= 0
//! f_i(w) = 1/C_ii is concave and homogeneous of degree one, so that for every v
//! f_i(w) <= sum_k w_k g_k,   g_k = (C_i^T N_k C_i)/C_ii^2 at v         a plane that cuts nothing allowed
//! ```
//!
//! A linear program over the planes so far bounds the cost from below; its solution, scaled until it is allowed, bounds
//! it from above. Planes are laid at the middle of both. Source: Kelley, J. SIAM 8 (1960), for the method; Pukelsheim,
//! "Optimal Design of Experiments", section 3, for the information function.

use groma_models::{Cancelled, Token};
use microlp::{ComparisonOp, OptimizationDirection, Problem, SolveOutcome};
use nalgebra::{Cholesky, DMatrix, DVector};

/// The gap at which the search ends, as a share of the cost.
const GAP: f64 = 1e-3;
/// Rounds at most.
const ROUNDS: usize = 60;
/// Rounds whose arcs are worth driving.
const RECENT: usize = 6;
/// A mixture is blended with this share of all arcs alike, so that every parameter is held.
const BLEND: f64 = 1e-6;

/// Arcs to choose from: what each tells, in units in which every tolerance is 1, and what it costs.
#[derive(Clone, Debug)]
pub struct Choice {
    /// Information.
    pub information: Vec<DMatrix<f64>>,
    /// Cost.
    pub cost: Vec<f64>,
}

/// A mixture that holds the tolerances.
#[derive(Clone, Debug, PartialEq)]
pub struct Mixture {
    /// Repetitions of every arc, not whole.
    pub repetitions: Vec<f64>,
    /// What they cost.
    pub cost: f64,
    /// No mixture costs less than this.
    pub bound: f64,
    /// The arcs of the last mixtures from below: those worth driving.
    pub support: Vec<usize>,
}

impl Choice {
    /// Covariance of a mixture; nothing when it does not hold all parameters.
    #[must_use]
    pub fn covariance(&self, repetitions: &[f64]) -> Option<DMatrix<f64>> {
        let n = self.information.first()?.nrows();
        let mut sum = DMatrix::zeros(n, n);
        for (information, w) in self.information.iter().zip(repetitions).filter(|(_, w)| **w > 0.0) {
            sum += information * *w;
        }
        Some(Cholesky::new(sum)?.inverse())
    }

    /// The largest variance: at most 1 when all tolerances hold, infinite when one is open.
    #[must_use]
    pub fn worst(&self, repetitions: &[f64]) -> f64 {
        let worst = |c: DMatrix<f64>| c.diagonal().max();
        let finite = |v: f64| if v.is_finite() { v } else { f64::INFINITY };
        self.covariance(repetitions).map_or(f64::INFINITY, |c| finite(worst(c)))
    }

    /// Cost of a mixture.
    #[must_use]
    pub fn total(&self, repetitions: &[f64]) -> f64 {
        self.cost.iter().zip(repetitions).map(|(c, w)| c * w).sum()
    }

    /// A mixture scaled so that the tolerances just hold.
    #[must_use]
    pub fn scaled(&self, repetitions: &[f64]) -> Option<Vec<f64>> {
        let worst = self.worst(repetitions);
        worst.is_finite().then(|| repetitions.iter().map(|w| w * worst).collect())
    }

    /// The planes at a mixture, one per parameter.
    fn planes(&self, repetitions: &[f64]) -> Vec<Vec<f64>> {
        let Some(c) = self.covariance(repetitions) else { return Vec::new() };
        let plane = |i: usize| {
            let column: DVector<f64> = c.column(i).into_owned();
            let slope = |n: &DMatrix<f64>| (n * &column).dot(&column) / c[(i, i)].powi(2);
            self.information.iter().map(slope).collect()
        };
        (0..c.nrows()).map(plane).collect()
    }
}

/// The best mixture; nothing when the arcs do not hold all parameters.
///
/// # Errors
/// When the token cancels the work.
pub fn best_mixture(choice: &Choice, token: &Token) -> Result<Option<Mixture>, Cancelled> {
    let even = vec![1.0; choice.cost.len()];
    let Some(mut best) = choice.scaled(&even) else { return Ok(None) };
    let blend: Vec<f64> = best.clone();
    let (mut planes, mut bound) = (choice.planes(&best), 0.0_f64);
    let mut recent: Vec<Vec<f64>> = Vec::new();
    for _ in 0..ROUNDS {
        token.check()?;
        let Some(lowest) = lowest(choice, &planes) else { break };
        bound = bound.max(choice.total(&lowest));
        recent.push(lowest.clone());
        let blended: Vec<f64> = lowest.iter().zip(&blend).map(|(w, b)| w + BLEND * b).collect();
        for share in [1.0, 0.5, 0.1] {
            let between: Vec<f64> = blended.iter().zip(&best).map(|(a, b)| share * a + (1.0 - share) * b).collect();
            planes.extend(choice.planes(&between));
            if let Some(scaled) = choice.scaled(&between).filter(|s| choice.total(s) < choice.total(&best)) {
                best = scaled;
            }
        }
        if choice.total(&best) - bound <= GAP * bound {
            break;
        }
    }
    let is_used = |k: &usize| recent.iter().rev().take(RECENT).any(|w| w[*k] > 0.0);
    let support = (0..choice.cost.len()).filter(is_used).collect();
    Ok(Some(Mixture { cost: choice.total(&best), bound, repetitions: best, support }))
}

/// The cheapest mixture on the right side of all planes.
fn lowest(choice: &Choice, planes: &[Vec<f64>]) -> Option<Vec<f64>> {
    let mut problem = Problem::new(OptimizationDirection::Minimize);
    let variables: Vec<_> = choice.cost.iter().map(|&c| problem.add_var(c, (0.0, f64::INFINITY))).collect();
    for plane in planes {
        let row: Vec<_> = variables.iter().copied().zip(plane.iter().copied()).collect();
        problem.add_constraint(row.as_slice(), ComparisonOp::Ge, 1.0);
    }
    let SolveOutcome::Solution(solution) = problem.solve().ok()? else { return None };
    Some(variables.iter().map(|&v| solution[v]).collect())
}

//! The covariance of an estimate.
//!
//! With white rows (residual y, design W, scaled by s and root weights), `u = W^T y` a score, N the sum of `W^T W`:
//!
//! ```text
//! Gaussian, independent:   s^2 N^-1
//! Student:                 B^-1 M B^-1,   B = N - 2/(tail + 3) sum u u^T,   M = sum u u^T
//! correlated in time:      M = G_0 + sum_j (1 - j/(lags + 1)) (G_j + G_j^T),   G_j = sum u_k u_k+j^T
//! ```
//!
//! B is the derivative of the summed influence: without its second term intervals are too short. For independent
//! motions B and M differ from N by a number each, if the residuals are alike in size and direction:
//! `B = N_1 mean(w - 2 w^2 d^2/(3 (tail + 3)))`, `M = N_1 mean(w^2 d^2)/3` with N_1 of weights 1. These means scatter
//! less than the matrices, so that few motions suffice; the plain sandwich is for many, or correlated ones. For few, C is
//! multiplied with Huber's `(1 + p/n var(slope)/mean(slope)^2)^2`, p parameters and n motions, and with `n/(n - p/3)`.
//! Lags: Andrews' rule for scores that are autoregressive of order one, for the parameter that asks for most, and those
//! of six seconds at least; as they are
//! a share b of few motions, intervals grow by the factor of Kiefer and Vogelsang.
//! Source: Huber, "Robust Statistics", sections 6.3 and 7.6; Newey, West, Econometrica 55 (1987); Andrews, Econometrica 59
//! (1991), equations (6.2), (6.4); Kiefer, Vogelsang, Econometric Theory 21 (2005), table 1.

use super::likelihood::{self, Row};
use super::motions::Motion;
use super::options::RESIDUAL;
use super::parameters::Layout;
use super::robust::{Fit, Problem};
use groma_estimation::Student;
use nalgebra::{DMatrix, DVector};

/// Autocorrelation beyond which Andrews' rule would ask for endless lags.
const CORRELATION_MAX: f64 = 0.97;
/// Memory of the errors of steering and slip, at least [s].
const MEMORY: f64 = 6.0;
/// Lags as a share of the motions, at most.
const LAGS_SHARE: f64 = 0.25;
/// Share of the information below which B is none.
const LEAST_CURVATURE: f64 = 0.05;
/// Motions per parameter from which scores tell their own scatter.
pub const ENOUGH: usize = 6;

/// Inverse of the information: what a covariance is built around, and the matrix that lies in its middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Bread {
    /// B, or the information of a Gaussian estimate.
    pub bread: DMatrix<f64>,
    /// M; the same as B for a Gaussian estimate of independent motions.
    pub middle: DMatrix<f64>,
    /// Lags that were summed.
    pub lags: usize,
}

impl Bread {
    /// For a fit; `correlated` where neighbouring motions share errors that their covariance does not tell.
    #[must_use]
    pub fn new(problem: &Problem<'_>, fit: &Fit, correlated: bool) -> Self {
        let layout = problem.layout;
        if correlated {
            return sandwich(problem, fit);
        }
        if problem.options.robust {
            return pooled(problem, fit);
        }
        let information = layout.reduced(&likelihood::normal(&fit.white).0) / fit.noise.scale_sq;
        Self { bread: information.clone(), middle: information, lags: 0 }
    }
}

/// B and M from the scores themselves.
fn sandwich(problem: &Problem<'_>, fit: &Fit) -> Bread {
    let least = (MEMORY / mean_duration(&problem.motions.motions)).ceil();
    let (layout, scores) = (problem.layout, scores(problem.layout, &fit.white));
    let normal = layout.reduced(&likelihood::normal(&fit.white).0) / fit.noise.scale_sq;
    let own: DMatrix<f64> = outer(&scores, 0) / fit.noise.scale_sq.powi(2);
    let student = problem.options.student();
    let bread = if problem.options.robust { curved(normal, &own, student) } else { normal };
    let lags = lags(&scores, least);
    let mut middle = own;
    for j in 1..=lags {
        let share = 1.0 - j as f64 / (lags as f64 + 1.0);
        let lagged = outer(&scores, j) * (share / fit.noise.scale_sq.powi(2));
        middle += &lagged + lagged.transpose();
    }
    let (count, free) = (fit.numbers() as f64, layout.len() as f64);
    let few = count / (count - free).max(1.0) * fixed_bandwidth(lags as f64 / scores.len() as f64).powi(2);
    Bread { bread, middle: middle * few, lags }
}

/// B, or the information where residuals without scatter leave none of it.
fn curved(normal: DMatrix<f64>, own: &DMatrix<f64>, student: Student) -> DMatrix<f64> {
    let bread = &normal - own * (2.0 / (student.dof + student.dimension));
    let holds = (&bread - &normal * LEAST_CURVATURE).cholesky().is_some();
    if holds { bread } else { normal }
}

/// B and M as multiples of the information without weights.
fn pooled(problem: &Problem<'_>, fit: &Fit) -> Bread {
    let (student, layout) = (problem.options.student(), problem.layout);
    let unweighted: Vec<Row> = fit.white.iter().zip(&fit.noise.weights).map(|(row, w)| row.weighted(1.0 / w)).collect();
    let information = layout.reduced(&likelihood::normal(&unweighted).0) / fit.noise.scale_sq;
    let count = fit.numbers() as f64 / RESIDUAL;
    let mean = |f: &dyn Fn(f64) -> f64| fit.noise.weights.iter().map(|&w| f(w)).sum::<f64>() / count;
    let slope = mean(&|w| influence_slope(w, student));
    let scatter = mean(&|w| w * w * student.distance_sq(w)) / RESIDUAL;
    let free = layout.len() as f64 / RESIDUAL;
    let spread = mean(&|w| (influence_slope(w, student) - slope).powi(2)) / slope.powi(2);
    let huber = 1.0 + layout.len() as f64 / count * spread;
    let correction = huber.powi(2) * count / (count - free).max(1.0 / RESIDUAL);
    Bread { bread: &information * slope, middle: information * (scatter * correction), lags: 0 }
}

/// Mean over directions of the derivative of the influence of a residual of this weight.
fn influence_slope(weight: f64, student: Student) -> f64 {
    let scale = student.dimension * (student.dof + student.dimension);
    weight - 2.0 * weight * weight * student.distance_sq(weight) / scale
}

/// By how much intervals grow because the lags are a share of all motions (Kiefer, Vogelsang, for 95 %).
fn fixed_bandwidth(share: f64) -> f64 {
    1.0 + share * (2.9694 + share * (0.4160 - 0.5324 * share)) / 1.96
}

fn scores(layout: &Layout, white: &[Row]) -> Vec<DVector<f64>> {
    white.iter().map(|row| layout.reduced_vector(&row.design.tr_mul(&row.residual))).collect()
}

/// `sum u_k u_(k+j)^T`.
fn outer(scores: &[DVector<f64>], j: usize) -> DMatrix<f64> {
    let n = scores.first().map_or(0, DVector::len);
    let mut sum = DMatrix::zeros(n, n);
    for (a, b) in scores.iter().zip(scores.iter().skip(j)) {
        sum.ger(1.0, a, b, 1.0);
    }
    sum
}

fn mean_duration(motions: &[Motion]) -> f64 {
    motions.iter().map(|m| m.end - m.start).sum::<f64>() / motions.len() as f64
}

/// Andrews' number of lags for Bartlett's kernel, the least or more.
fn lags(scores: &[DVector<f64>], least: f64) -> usize {
    let (n, free) = (scores.len(), scores.first().map_or(0, DVector::len));
    let mut most: f64 = 0.0;
    for k in 0..free {
        let (mut own, mut next) = (0.0, 0.0);
        for (t, u) in scores.iter().enumerate() {
            own += u[k] * u[k];
            next += scores.get(t + 1).map_or(0.0, |after| u[k] * after[k]);
        }
        let rho = if own > 0.0 { (next / own).clamp(-CORRELATION_MAX, CORRELATION_MAX) } else { 0.0 };
        most = most.max(4.0 * rho * rho / ((1.0 - rho).powi(2) * (1.0 + rho).powi(2)));
    }
    let lags = 1.1447 * (most * n as f64).cbrt();
    lags.max(least).min(LAGS_SHARE * n as f64) as usize
}

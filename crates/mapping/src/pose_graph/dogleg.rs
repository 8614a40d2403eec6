//! Powell's dogleg: the step of a quadratic model inside a trust region.
//!
//! With `H d = g` the step is `-d` when that is short enough; else it lies on the path from the steepest descent
//! `s = (g^T u / u^T H u) u`, `u = D^-1 g`, to `d`, where `|step|_D` equals the radius; `D = diag H`.
//! Source: Powell 1970; Nocedal, Wright, "Numerical Optimization", section 4.1.

use groma_estimation::BlockMatrix;
use nalgebra::Vector3;

pub(super) type Blocks = Vec<Vector3<f64>>;

/// The quadratic model at an iterate; every step is to be subtracted.
pub(super) struct Model {
    gauss_newton: Blocks,
    steepest: Blocks,
    gradient: Blocks,
    /// `H steepest`.
    curvature: Blocks,
    scale: Blocks,
    /// Length of the Gauss-Newton step in the metric D.
    pub whole: f64,
    /// By how much the Gauss-Newton step would lower the model: its squared length in standard deviations.
    pub promise: f64,
}

/// A step with its length in the metric D and the fall of the model along it.
pub(super) struct Step {
    pub delta: Blocks,
    pub length: f64,
    pub decrease: f64,
}

impl Model {
    /// From `H`, `g` and the solution of `H d = g`.
    pub(super) fn new(matrix: &BlockMatrix<3>, gradient: Blocks, gauss_newton: Blocks) -> Self {
        let scale: Blocks = matrix.diagonal.iter().map(|block| block.diagonal()).collect();
        let divide = |(g, s): (&Vector3<f64>, &Vector3<f64>)| g.zip_map(s, |g, s| if s > 0.0 { g / s } else { 0.0 });
        let uphill: Blocks = gradient.iter().zip(&scale).map(divide).collect();
        let bent = matrix.multiply(&uphill);
        let share = dot(&gradient, &uphill) / dot(&uphill, &bent).max(f64::MIN_POSITIVE);
        let scaled = |v: Blocks| v.into_iter().map(|x| x * share).collect();
        let (steepest, curvature) = (scaled(uphill), scaled(bent));
        let (whole, promise) = (inner(&gauss_newton, &gauss_newton, &scale).sqrt(), dot(&gauss_newton, &gradient));
        Self { gauss_newton, steepest, gradient, curvature, scale, whole, promise }
    }

    /// The step that the radius allows.
    pub(super) fn step(&self, radius: f64) -> Step {
        let (back, along) = self.shares(radius);
        let delta: Blocks = self.steepest.iter().zip(&self.gauss_newton).map(|(s, d)| s * back + d * along).collect();
        let downhill = dot(&self.gradient, &delta);
        let decrease = (2.0 - along) * downhill - back * dot(&self.curvature, &delta);
        Step { length: inner(&delta, &delta, &self.scale).sqrt(), delta, decrease }
    }

    /// The shares of the steepest descent and of the Gauss-Newton step.
    fn shares(&self, radius: f64) -> (f64, f64) {
        let first_sq = inner(&self.steepest, &self.steepest, &self.scale);
        if self.whole <= radius {
            return (0.0, 1.0);
        }
        if first_sq.sqrt() >= radius {
            return (radius / first_sq.sqrt(), 0.0);
        }
        let mixed = inner(&self.steepest, &self.gauss_newton, &self.scale);
        let (a, b, c) =
            (self.whole * self.whole - 2.0 * mixed + first_sq, mixed - first_sq, radius * radius - first_sq);
        let along = c / (b + (b * b + a * c).sqrt());
        (1.0 - along, along)
    }
}

fn dot(a: &Blocks, b: &Blocks) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

/// `a^T D b`.
fn inner(a: &Blocks, b: &Blocks, scale: &Blocks) -> f64 {
    a.iter().zip(b).zip(scale).map(|((a, b), s)| a.component_mul(b).dot(s)).sum()
}

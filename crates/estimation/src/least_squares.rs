//! Dense nonlinear least squares: `minimise |r(x)|^2` by Levenberg-Marquardt, with what the data leave open.
//!
//! The caller whitens: residuals have unit variance, so `|r|^2` is a chi-square and the covariance is
//! `(J^T J)^-1`, not rescaled by the fit. The state x may live on a manifold: the caller says how a step moves it, and
//! J is the derivative with respect to that step.
//!
//! ```text
//! (J^T J + lambda D^2) d = -J^T r,   D = column lengths of J
//! ```
//!
//! Rank: with `J D^-1 = U S V^T`, a direction with `S <= 1e-8 max S` is weak. It is returned as a value; the
//! covariance is that of the other directions (along `D^-1 v`), so it says nothing of the weak ones.
//! Source: More, LNM 630 (1978) 105; Nocedal, Wright, "Numerical Optimization", section 10.3.

use crate::Error;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Share of the largest scaled singular value at which a direction counts as weak.
const WEAK_SHARE: f64 = 1e-8;
/// Residuals this close to a right angle with every column of the Jacobian are at a minimum, up to rounding.
const FLAT_COSINE: f64 = 1e-8;
const FIRST_DAMPING: f64 = 1e-4;
const LAST_DAMPING: f64 = 1e16;

/// When to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Most steps taken.
    pub max_iterations: usize,
    /// The end is reached when a step promises to lower the cost by less than this share of `1 + cost`.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_iterations: 100, tolerance: 1e-12 }
    }
}

/// A minimum and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit<S> {
    /// The state of least cost.
    pub estimate: S,
    /// The residuals there.
    pub residuals: DVector<f64>,
    /// `|r|^2`.
    pub chi_square: f64,
    /// Number of residuals less the rank.
    pub dof: usize,
    /// Covariance of the step at the estimate, over the directions that are not weak.
    pub covariance: DMatrix<f64>,
    /// Directions of the step that the data do not hold, of unit length in units of the parameters.
    pub weak: Vec<DVector<f64>>,
    /// Steps taken.
    pub iterations: usize,
    /// Whether the end was reached by the tolerance.
    pub converged: bool,
}

/// The minimum near `start`. `retract` moves a state by a step; `model` gives residuals and their Jacobian (a row a
/// residual, a column a parameter of the step).
///
/// # Errors
/// [`Error::NotFinite`] when the model is not finite at the start, [`Error::Size`] when residuals and Jacobian differ in
/// rows.
pub fn minimize<S: Clone>(
    start: S,
    retract: impl Fn(&S, &DVector<f64>) -> S,
    model: impl Fn(&S) -> (DVector<f64>, DMatrix<f64>),
    options: &Options,
) -> Result<Fit<S>, Error> {
    let (mut x, (mut r, mut jacobian)) = (start.clone(), model(&start));
    check(&r, &jacobian)?;
    let (mut damping, mut iterations, mut converged) = (FIRST_DAMPING, 0, jacobian.ncols() == 0);
    while !converged && iterations < options.max_iterations && damping < LAST_DAMPING {
        let Some((step, promise)) = damped_step(&jacobian, &r, damping) else {
            damping *= 10.0;
            continue;
        };
        converged = damping <= FIRST_DAMPING && promise <= options.tolerance * (1.0 + r.norm_squared());
        let moved = retract(&x, &step);
        let (r_moved, jacobian_moved) = model(&moved);
        if check(&r_moved, &jacobian_moved).is_ok() && r_moved.norm_squared() <= r.norm_squared() {
            (x, r, jacobian) = (moved, r_moved, jacobian_moved);
            (damping, iterations) = (damping / 10.0, iterations + 1);
        } else {
            damping *= 10.0;
        }
    }
    converged |= steepest_cosine(&jacobian, &r) <= FLAT_COSINE;
    let spread = spread(&jacobian);
    let dof = r.len().saturating_sub(spread.rank);
    let (chi_square, covariance, weak) = (r.norm_squared(), spread.covariance, spread.weak);
    Ok(Fit { estimate: x, chi_square, dof, covariance, weak, iterations, converged, residuals: r })
}

fn check(r: &DVector<f64>, jacobian: &DMatrix<f64>) -> Result<(), Error> {
    if r.len() != jacobian.nrows() {
        return Err(Error::Size { what: "Jacobian (rows)", expected: r.len(), got: jacobian.nrows() });
    }
    let finite = r.iter().chain(jacobian.iter()).all(|v| v.is_finite());
    if finite { Ok(()) } else { Err(Error::NotFinite { what: "the model at the start" }) }
}

/// The damped step and by how much it lowers the linear model; nothing when it cannot be computed.
fn damped_step(jacobian: &DMatrix<f64>, r: &DVector<f64>, damping: f64) -> Option<(DVector<f64>, f64)> {
    let mut normal = jacobian.tr_mul(jacobian);
    for (k, length) in lengths(jacobian).iter().enumerate() {
        normal[(k, k)] += damping * length * length;
    }
    let step = -Cholesky::new(normal)?.solve(&jacobian.tr_mul(r));
    let promise = r.norm_squared() - (r + jacobian * &step).norm_squared();
    step.iter().all(|v| v.is_finite()).then_some((step, promise))
}

/// The largest cosine between the residuals and a column of the Jacobian: zero at a minimum.
fn steepest_cosine(jacobian: &DMatrix<f64>, r: &DVector<f64>) -> f64 {
    let length = r.norm().max(f64::MIN_POSITIVE);
    jacobian.tr_mul(r).component_div(&lengths(jacobian)).iter().fold(0.0, |most, c| c.abs().max(most)) / length
}

/// Column lengths of the Jacobian; 1 for a column of zeros.
fn lengths(jacobian: &DMatrix<f64>) -> DVector<f64> {
    let length = |c: nalgebra::DVectorView<'_, f64>| if c.norm() > 0.0 { c.norm() } else { 1.0 };
    DVector::from_iterator(jacobian.ncols(), jacobian.column_iter().map(length))
}

struct Spread {
    covariance: DMatrix<f64>,
    weak: Vec<DVector<f64>>,
    rank: usize,
}

/// Covariance and weak directions of a Jacobian, by the singular values of its scaled columns.
fn spread(jacobian: &DMatrix<f64>) -> Spread {
    let (n, scale) = (jacobian.ncols(), lengths(jacobian));
    // As many rows as columns at least, so that directions without any residual get a singular value too.
    let mut scaled = jacobian.clone().resize_vertically(jacobian.nrows().max(n), 0.0);
    for (mut column, length) in scaled.column_iter_mut().zip(scale.iter()) {
        column /= *length;
    }
    let mut spread = Spread { covariance: DMatrix::zeros(n, n), weak: Vec::new(), rank: 0 };
    let svd = scaled.svd(false, true);
    let Some(axes) = svd.v_t else { return spread };
    let limit = WEAK_SHARE * svd.singular_values.amax();
    for (value, axis) in svd.singular_values.iter().zip(axes.row_iter()) {
        let direction = axis.transpose().component_div(&scale);
        if *value > limit {
            spread.covariance += &direction * direction.transpose() / (value * value);
            spread.rank += 1;
        } else {
            spread.weak.push(direction.normalize());
        }
    }
    spread
}

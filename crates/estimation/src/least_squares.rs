//! Dense nonlinear least squares: `minimise |r(x)|^2` by Levenberg-Marquardt (`levenberg_marquardt.rs`), with what the data
//! leave open.
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
pub use crate::levenberg_marquardt::Options;
use crate::levenberg_marquardt::{self, Problem};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Share of the largest scaled singular value at which a direction counts as weak.
const WEAK_SHARE: f64 = 1e-8;
/// Residuals this close to a right angle with every column of the Jacobian are at a minimum, up to rounding.
const FLAT_COSINE: f64 = 1e-8;

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
    let nothing = || (DVector::zeros(0), DMatrix::zeros(0, 0));
    let mut problem = Dense { retract: &retract, model: &model, trial: nothing(), kept: nothing() };
    let end = levenberg_marquardt::minimize(&mut problem, start, options)?;
    let end = end.ok_or(Error::NotFinite { what: "the model at the start" })?;
    let (r, jacobian) = problem.kept;
    let converged = end.converged || jacobian.ncols() == 0 || steepest_cosine(&jacobian, &r) <= FLAT_COSINE;
    let spread = spread(&jacobian);
    let dof = r.len().saturating_sub(spread.rank);
    let (chi_square, covariance, weak) = (r.norm_squared(), spread.covariance, spread.weak);
    let (estimate, iterations) = (end.state, end.iterations);
    Ok(Fit { estimate, chi_square, dof, covariance, weak, iterations, converged, residuals: r })
}

/// Residuals and their Jacobian.
type Linear = (DVector<f64>, DMatrix<f64>);

/// A model with its residuals and Jacobian at the state of the last cost, and at the last state that was kept.
struct Dense<'a, S> {
    retract: &'a dyn Fn(&S, &DVector<f64>) -> S,
    model: &'a dyn Fn(&S) -> Linear,
    trial: Linear,
    kept: Linear,
}

impl<S> Problem for Dense<'_, S> {
    type State = S;
    type Step = DVector<f64>;
    type Error = Error;

    fn cost(&mut self, at: &S) -> Result<Option<f64>, Error> {
        self.trial = (self.model)(at);
        let (r, jacobian) = &self.trial;
        if r.len() != jacobian.nrows() {
            return Err(Error::Size { what: "Jacobian (rows)", expected: r.len(), got: jacobian.nrows() });
        }
        let finite = r.iter().chain(jacobian.iter()).all(|v| v.is_finite());
        Ok(finite.then(|| r.norm_squared()))
    }

    fn linearize(&mut self, _: &S) -> Result<(), Error> {
        std::mem::swap(&mut self.kept, &mut self.trial);
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(DVector<f64>, f64)>, Error> {
        Ok(damped_step(&self.kept.1, &self.kept.0, damping))
    }

    fn moved(&self, at: &S, step: &DVector<f64>) -> Option<S> {
        Some((self.retract)(at, step))
    }
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

//! Levenberg-Marquardt: a damped step of the normal equations, kept when it lowers the cost.
//!
//! ```text
//! (A + lambda diag A) d = -g,   x <- x (+) d       A = J^T W J,  g = J^T W r,  cost = sum rho(|r|^2)
//! promise = -(2 g^T d + d^T A d) = lambda d^T diag(A) d - g^T d       by how much the linear model lowers the cost
//! lambda / 10 after a step that lowers the cost, 10 lambda after one that does not
//! ```
//!
//! Its end: a step whose promise is at most `tolerance (1 + cost)`, taken or refused by rounding, at a damping no larger than
//! the first. The problem says how its normal equations are kept and solved (dense, by blocks, sparse) and how a step moves a
//! state, which may live on a manifold.
//!
//! Assumes residuals near unit variance, or another cost whose unit is of no interest. A local method: it needs a start in the
//! valley of the minimum. It does not rescale, and it does not look for weak directions: see `spread`.
//! Source: More, LNM 630 (1978) 105; Nocedal, Wright, "Numerical Optimization", section 10.3.

use nalgebra::{SMatrix, SVector};

/// Damping of the first step.
const FIRST_DAMPING: f64 = 1e-4;
const LEAST_DAMPING: f64 = 1e-12;
const LAST_DAMPING: f64 = 1e16;
/// Share by which rounding may raise the cost.
const ROUNDING: f64 = 1e-12;

/// What is minimised.
pub trait Problem {
    /// What is estimated.
    type State;
    /// A step in the tangent space of a state.
    type Step;
    /// Why the work ends early.
    type Error;

    /// The cost at a state; none where the model is not defined.
    ///
    /// # Errors
    /// As the problem says.
    fn cost(&mut self, at: &Self::State) -> Result<Option<f64>, Self::Error>;

    /// Sets up the normal equations at the state of the last cost.
    ///
    /// # Errors
    /// As the problem says.
    fn linearize(&mut self, at: &Self::State) -> Result<(), Self::Error>;

    /// The damped step and its promise; none where the equations cannot be solved.
    ///
    /// # Errors
    /// As the problem says.
    fn step(&mut self, damping: f64) -> Result<Option<(Self::Step, f64)>, Self::Error>;

    /// A state moved by a step; none where that is no state.
    fn moved(&self, at: &Self::State, step: &Self::Step) -> Option<Self::State>;
}

/// When to stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Most steps kept.
    pub max_iterations: usize,
    /// The end is reached when a step promises to lower the cost by less than this share of `1 + cost`.
    pub tolerance: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { max_iterations: 100, tolerance: 1e-12 }
    }
}

/// Where the work ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Minimum<S> {
    /// The state of least cost.
    pub state: S,
    /// The cost there.
    pub cost: f64,
    /// Steps kept.
    pub iterations: usize,
    /// Whether the end was reached by the tolerance.
    pub converged: bool,
}

/// The minimum near `start`; none where the cost is not defined there. The normal equations of the problem are those of the
/// minimum then.
///
/// # Errors
/// Those of the problem.
pub fn minimize<P: Problem>(
    problem: &mut P,
    start: P::State,
    options: &Options,
) -> Result<Option<Minimum<P::State>>, P::Error> {
    let Some(cost) = problem.cost(&start)? else { return Ok(None) };
    let mut at = Minimum { state: start, cost, iterations: 0, converged: false };
    problem.linearize(&at.state)?;
    let mut damping = FIRST_DAMPING;
    while !at.converged && at.iterations < options.max_iterations && damping < LAST_DAMPING {
        let Some((step, promise)) = problem.step(damping)? else {
            damping *= 10.0;
            continue;
        };
        at.converged = damping <= FIRST_DAMPING && promise <= options.tolerance * (1.0 + at.cost);
        match lower(problem, &at, &step)? {
            Some((state, cost)) => {
                problem.linearize(&state)?;
                (at.state, at.cost, at.iterations) = (state, cost, at.iterations + 1);
                damping = (damping / 10.0).max(LEAST_DAMPING);
            }
            None => damping *= 10.0,
        }
    }
    Ok(Some(at))
}

/// The state after a step and its cost, if that is not more.
fn lower<P: Problem>(
    problem: &mut P,
    at: &Minimum<P::State>,
    step: &P::Step,
) -> Result<Option<(P::State, f64)>, P::Error> {
    let Some(state) = problem.moved(&at.state, step) else { return Ok(None) };
    let cost = problem.cost(&state)?;
    Ok(cost.filter(|cost| *cost <= at.cost * (1.0 + ROUNDING)).map(|cost| (state, cost)))
}

/// Normal equations of a few unknowns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal<const N: usize> {
    /// A.
    pub information: SMatrix<f64, N, N>,
    /// g.
    pub gradient: SVector<f64, N>,
}

impl<const N: usize> Normal<N> {
    /// Nothing is known.
    #[must_use]
    pub fn zeros() -> Self {
        Self { information: SMatrix::zeros(), gradient: SVector::zeros() }
    }

    /// The damped step and its promise; none where the equations cannot be solved.
    #[must_use]
    pub fn step(&self, damping: f64) -> Option<(SVector<f64, N>, f64)> {
        let added = self.information.diagonal() * damping;
        let step = -(self.information + SMatrix::from_diagonal(&added)).cholesky()?.solve(&self.gradient);
        let promise = (added.component_mul(&step) - self.gradient).dot(&step);
        step.iter().all(|v| v.is_finite()).then_some((step, promise))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// Rosenbrock's valley: `(1 - x)^2 + 100 (y - x^2)^2`, defined left of a wall only.
    struct Valley {
        wall: f64,
        at: Normal<2>,
    }

    impl Problem for Valley {
        type State = [f64; 2];
        type Step = SVector<f64, 2>;
        type Error = Infallible;

        fn cost(&mut self, [x, y]: &[f64; 2]) -> Result<Option<f64>, Infallible> {
            let cost = (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
            Ok((*x < self.wall).then_some(cost))
        }

        fn linearize(&mut self, [x, y]: &[f64; 2]) -> Result<(), Infallible> {
            let jacobian = SMatrix::<f64, 2, 2>::new(-1.0, 0.0, -20.0 * x, 10.0);
            let residuals = SVector::from([1.0 - x, 10.0 * (y - x * x)]);
            self.at =
                Normal { information: jacobian.transpose() * jacobian, gradient: jacobian.transpose() * residuals };
            Ok(())
        }

        fn step(&mut self, damping: f64) -> Result<Option<(SVector<f64, 2>, f64)>, Infallible> {
            Ok(self.at.step(damping))
        }

        fn moved(&self, at: &[f64; 2], step: &SVector<f64, 2>) -> Option<[f64; 2]> {
            Some([at[0] + step[0], at[1] + step[1]])
        }
    }

    fn descend(wall: f64, options: &Options) -> Minimum<[f64; 2]> {
        let mut valley = Valley { wall, at: Normal::zeros() };
        let Ok(end) = minimize(&mut valley, [-1.2, 1.0], options);
        end.unwrap()
    }

    #[test]
    fn a_curved_valley_is_followed_to_its_end() {
        let end = descend(f64::INFINITY, &Options::default());
        assert!(end.converged, "{end:?}");
        assert!((end.state[0] - 1.0).abs() < 1e-9 && (end.state[1] - 1.0).abs() < 1e-9, "{end:?}");
    }

    #[test]
    fn steps_beyond_what_is_defined_are_not_kept_and_no_end_is_claimed_at_the_wall() {
        let end = descend(0.5, &Options::default());
        assert!(end.state[0] < 0.5 && end.state[0] > 0.4 && !end.converged, "{end:?}");
        let mut nowhere = Valley { wall: -2.0, at: Normal::zeros() };
        assert_eq!(minimize(&mut nowhere, [-1.2, 1.0], &Options::default()), Ok(None));
    }

    #[test]
    fn an_end_by_the_number_of_steps_is_told_and_more_steps_never_cost_more() {
        let costs: Vec<f64> = (0..12)
            .map(|max_iterations| {
                let end = descend(f64::INFINITY, &Options { max_iterations, ..Options::default() });
                assert!(!end.converged && end.iterations == max_iterations, "{end:?}");
                end.cost
            })
            .collect();
        assert!(costs.windows(2).all(|pair| pair[1] <= pair[0]), "{costs:?}");
    }

    #[test]
    fn the_promise_is_what_the_linear_model_loses() {
        let normal =
            Normal { information: SMatrix::from([[4.0, 1.0], [1.0, 3.0]]), gradient: SVector::from([1.0, -2.0]) };
        for damping in [0.0, 1e-3, 10.0] {
            let (d, promise) = normal.step(damping).unwrap();
            let lost = -(2.0 * normal.gradient.dot(&d) + d.dot(&(normal.information * d)));
            assert!((promise - lost).abs() < 1e-12 && promise > 0.0);
        }
        assert_eq!(Normal::<2>::zeros().step(1.0), None);
    }
}

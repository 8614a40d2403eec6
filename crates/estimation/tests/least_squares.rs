//! Dense least squares on problems whose answers are known.

#![allow(clippy::unwrap_used, reason = "tests may fail loudly")]

use groma_estimation::Error;
use groma_estimation::least_squares::{Fit, Options, minimize};
use groma_geometry::{LieGroup, So3};
use nalgebra::{DMatrix, DVector, Vector3};

fn on_numbers(start: &[f64], model: impl Fn(&DVector<f64>) -> (DVector<f64>, DMatrix<f64>)) -> Fit<DVector<f64>> {
    minimize(DVector::from_column_slice(start), |x, d| x + d, model, &Options::default()).unwrap()
}

/// `y = exp(-a t)` sampled without noise, then the valley of Rosenbrock.
#[test]
fn finds_known_minima() {
    let times: Vec<f64> = (0..20).map(|k| f64::from(k) * 0.1).collect();
    let decay = on_numbers(&[5.0], |x| {
        let r = times.iter().map(|t| ((-x[0] * t).exp() - (-1.3 * t).exp()) / 0.01);
        let j = times.iter().map(|t| -t * (-x[0] * t).exp() / 0.01);
        (DVector::from_iterator(20, r), DMatrix::from_iterator(20, 1, j))
    });
    assert!(decay.converged && (decay.estimate[0] - 1.3).abs() < 1e-9 && decay.dof == 19);

    let valley = on_numbers(&[-1.2, 1.0], |x| {
        let r = DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
        (r, DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]))
    });
    assert!(valley.converged && (valley.estimate - DVector::from_element(2, 1.0)).amax() < 1e-9);
}

#[test]
fn a_line_has_the_covariance_of_the_textbook() {
    let (times, sigma) = ([0.0, 1.0, 2.0, 5.0], 0.2);
    let design = DMatrix::from_fn(4, 2, |r, c| if c == 0 { 1.0 / sigma } else { times[r] / sigma });
    let data = DVector::from_vec(vec![1.0, 2.2, 2.9, 6.1]) / sigma;
    let fit = on_numbers(&[0.0, 0.0], |x| (&design * x - &data, design.clone()));
    let expected = (design.transpose() * &design).try_inverse().unwrap();
    assert!((&fit.covariance - &expected).amax() < 1e-12);
    assert!((fit.estimate - expected * design.transpose() * data).amax() < 1e-10);
    assert!(fit.converged && fit.dof == 2 && fit.weak.is_empty());
}

/// Rotations from two directions seen in both frames.
#[test]
fn states_may_live_on_a_group() {
    let truth = So3::exp(&Vector3::new(2.0, -1.0, 1.5));
    let seen = [Vector3::x(), Vector3::new(0.0, 1.0, 0.5)];
    let model = |r: &So3| {
        let mut residuals = DVector::zeros(6);
        let mut jacobian = DMatrix::zeros(6, 3);
        for (k, p) in seen.iter().enumerate() {
            residuals.fixed_rows_mut::<3>(3 * k).copy_from(&(r.act(p) - truth.act(p)));
            jacobian.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&(-r.matrix() * p.cross_matrix()));
        }
        (residuals, jacobian)
    };
    let retract = |r: &So3, d: &DVector<f64>| r.plus(&Vector3::new(d[0], d[1], d[2]));
    let fit = minimize(So3::identity(), retract, model, &Options::default()).unwrap();
    assert!(fit.converged && fit.estimate.minus(&truth).norm() < 1e-9 && fit.weak.is_empty());
}

/// Only `x + 1000 y` is measured, and z not at all: two weak directions, named in the units of the parameters.
#[test]
fn weak_directions_are_values() {
    let fit = on_numbers(&[0.0; 3], |v| {
        let r = DVector::from_element(2, v[0] + 1000.0 * v[1] - 5.0);
        (r, DMatrix::from_row_slice(2, 3, &[1.0, 1000.0, 0.0, 1.0, 1000.0, 0.0]))
    });
    assert!(fit.converged && fit.chi_square < 1e-12 && fit.dof == 1 && fit.weak.len() == 2);
    for weak in &fit.weak {
        assert!((weak[0] + 1000.0 * weak[1]).abs() < 1e-9 && (weak.norm() - 1.0).abs() < 1e-12);
    }
    let held = DVector::from_vec(vec![1.0, 1000.0, 0.0]);
    assert!(((held.transpose() * &fit.covariance * &held)[0] - 0.5).abs() < 1e-9);
    let alone =
        on_numbers(&[0.0, 0.0], |v| (DVector::from_element(1, v[0] - 1.0), DMatrix::from_row_slice(1, 2, &[1.0, 0.0])));
    assert!(alone.weak.len() == 1 && alone.weak[0][1].abs() == 1.0 && alone.dof == 0);
}

#[test]
fn a_model_that_breaks_is_told_or_avoided() {
    let options = Options::default();
    let nan = |_: &f64| (DVector::from_element(1, f64::NAN), DMatrix::zeros(1, 1));
    assert!(matches!(minimize(0.0, |x, d| x + d[0], nan, &options), Err(Error::NotFinite { .. })));
    let short = |_: &f64| (DVector::zeros(2), DMatrix::zeros(1, 1));
    assert!(matches!(minimize(0.0, |x, d| x + d[0], short, &options), Err(Error::Size { expected: 2, got: 1, .. })));
    // The logarithm is not defined where the first whole step leads: a shorter one is taken.
    let log = |x: &f64| (DVector::from_element(1, x.ln() + 3.0), DMatrix::from_element(1, 1, 1.0 / x));
    let fit = minimize(20.0, |x, d| x + d[0], log, &options).unwrap();
    assert!(fit.converged && (fit.estimate - (-3.0f64).exp()).abs() < 1e-9);
}

//! Wheels from headings alone, in closed form: they turn as the laser does, wherever it sits.
//!
//! With `phi = scale exp(i offset)` and `C_k = sum n exp(i gain a)` over the steps of motion k, headings are linear:
//!
//! ```text
//! turn_k = Im(p C_k) = [Im C_k, Re C_k] (Re p, Im p),        p = phi/wheelbase
//! turn_k = [l_k, r_k] (-left/axle, right/axle)               differential drive
//! ```
//!
//! Two offsets: `turn_k = Im(p_F C_F + p_B C_B)` with `|p_F| = |p_B|`. The multiplier solves
//!
//! ```text
//! (N + lambda K) p = b,   K = diag(1, 1, -1, -1),   g(lambda) = p^T K p = 0
//! ```
//!
//! On the interval where `N + lambda K` is positive definite g falls strictly, from infinity to minus infinity: the one
//! root is the global minimum (a quadratic with one quadratic equality). In the basis where N is 1 and K is diagonal,
//! with entries mu and the right-hand side c, `g = sum c^2 mu/(1 + lambda mu)^2`.
//! Source: Kallasi et al. 2017 for the two models (STC, ATC), Censi et al. 2013, equation (17), for the differential
//! drive; the complex form and the proof: `docs/theory/vehicle_calibration.md`.

use groma_estimation::root;
use groma_models::wheel_log::Step;
use nalgebra::{Complex, Matrix2, Matrix4, SymmetricEigen, Vector2, Vector4};
use std::convert::Infallible;

/// Rows whose directions differ less than this share hold one number only.
const SINGULAR: f64 = 1e-12;
/// Halvings of the interval of the multiplier: to the last bit.
const HALVINGS: usize = 200;

/// Rotated counts of a motion, forward and backward, with its turn and the weight of that.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// `C` of steps with counts at or above zero.
    pub forward: Complex<f64>,
    /// `C` of the others.
    pub backward: Complex<f64>,
    /// Turn [rad].
    pub turn: f64,
    /// Weight: inverse of the variance of the turn.
    pub weight: f64,
}

impl Row {
    /// From the steps of a motion.
    #[must_use]
    pub fn new(steps: &[Step], gain: f64, turn: f64, weight: f64) -> Self {
        let (mut forward, mut backward) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
        for step in steps {
            let (sin, cos) = (gain * step.input.y).sin_cos();
            let rotated = Complex::new(cos, sin) * step.input.x;
            if step.input.x < 0.0 { backward += rotated } else { forward += rotated }
        }
        Self { forward, backward, turn, weight }
    }
}

/// Weighted least squares of two unknowns; nothing when the rows hold one only.
#[must_use]
pub fn two_unknowns(rows: impl Iterator<Item = (Vector2<f64>, f64, f64)>) -> Option<Vector2<f64>> {
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for (row, value, weight) in rows {
        normal += row * row.transpose() * weight;
        right += row * (value * weight);
    }
    let det = normal.determinant();
    if det.is_nan() || det <= SINGULAR * normal.m11 * normal.m22 {
        return None;
    }
    Some(Matrix2::new(normal.m22, -normal.m12, -normal.m21, normal.m11) * right / det)
}

/// `p` of a symmetric tricycle.
#[must_use]
pub fn symmetric(rows: &[Row]) -> Option<Complex<f64>> {
    let to_row = |r: &Row| {
        let c = r.forward + r.backward;
        (Vector2::new(c.im, c.re), r.turn, r.weight)
    };
    two_unknowns(rows.iter().map(to_row)).map(|p| Complex::new(p.x, p.y))
}

/// `p` forward and backward of an asymmetric tricycle, of equal length; nothing when one of them is not determined.
#[must_use]
pub fn asymmetric(rows: &[Row]) -> Option<[Complex<f64>; 2]> {
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for r in rows {
        let row = Vector4::new(r.forward.im, r.forward.re, r.backward.im, r.backward.re);
        normal += row * row.transpose() * r.weight;
        right += row * (r.turn * r.weight);
    }
    let scale = normal.diagonal().map(f64::sqrt);
    let relative = Matrix4::from_fn(|r, c| normal[(r, c)] / (scale[r] * scale[c]));
    let held = relative.iter().all(|v| v.is_finite());
    if !held || SymmetricEigen::new(relative).eigenvalues.min() < SINGULAR {
        return None;
    }
    let p = equal_lengths(&normal, &right)?;
    Some([Complex::new(p.x, p.y), Complex::new(p.z, p.w)])
}

/// Minimum of `p^T N p - 2 b^T p` where the first two and the last two numbers of p have equal length.
fn equal_lengths(normal: &Matrix4<f64>, right: &Vector4<f64>) -> Option<Vector4<f64>> {
    let inverse = normal.cholesky()?.l().try_inverse()?;
    let signs = Matrix4::from_diagonal(&Vector4::new(1.0, 1.0, -1.0, -1.0));
    let eigen = SymmetricEigen::new(inverse * signs * inverse.transpose());
    let (mu, basis) = (eigen.eigenvalues, inverse.transpose() * eigen.eigenvectors);
    let c = basis.transpose() * right;
    let lambda = multiplier(&mu, &c);
    Some(basis * c.zip_map(&mu, |c, mu| c / (1.0 + lambda * mu)))
}

/// The root of the falling function g.
fn multiplier(mu: &Vector4<f64>, c: &Vector4<f64>) -> f64 {
    let g = |lambda: f64| c.zip_map(mu, |c, mu| mu * (c / (1.0 + lambda * mu)).powi(2)).sum();
    let ends = (-1.0 / mu.max(), -1.0 / mu.min());
    let Ok((low, high)) = root::bisect(ends, HALVINGS, |lambda| Ok::<_, Infallible>(g(lambda) > 0.0));
    f64::midpoint(low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random_rows(seed: u64, count: usize, mixed: bool) -> Vec<Row> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut number = || rng.random_range(-1.0..1.0);
        let mut rows = Vec::new();
        for k in 0..count {
            let (a, b) = (Complex::new(number(), number()), Complex::new(number(), number()));
            let [forward, backward] = match (mixed, k % 2) {
                (true, _) => [a, b],
                (false, 0) => [a, Complex::new(0.0, 0.0)],
                _ => [Complex::new(0.0, 0.0), b],
            };
            rows.push(Row { forward, backward, turn: number(), weight: 1.5 + number() });
        }
        rows
    }

    fn cost(rows: &[Row], p: &[Complex<f64>; 2]) -> f64 {
        let miss = |r: &Row| (p[0] * r.forward + p[1] * r.backward).im - r.turn;
        rows.iter().map(|r| r.weight * miss(r).powi(2)).sum()
    }

    /// The constraint holds and no pair of equal length on a fine grid about it, nor far from it, costs less.
    #[test]
    fn the_root_is_the_global_minimum_for_any_data() {
        for seed in 0..40 {
            let rows = random_rows(seed, 9, seed % 2 == 0);
            let p = asymmetric(&rows).unwrap();
            assert!((p[0].norm() - p[1].norm()).abs() < 1e-10 * p[0].norm(), "{p:?}");
            let best = cost(&rows, &p);
            let mut rng = ChaCha8Rng::seed_from_u64(seed + 1000);
            for k in 0..4000 {
                let spread = 10_f64.powf(-4.0 + 4.0 * f64::from(k) / 4000.0);
                let mut turn = || spread * rng.random_range(-3.2..3.2);
                let (a, b) = (turn(), turn());
                let size = 1.0 + rng.random_range(-0.9..0.9) * spread;
                let other = [p[0] * Complex::from_polar(size, a), p[1] * Complex::from_polar(size, b)];
                assert!(cost(&rows, &other) >= best * (1.0 - 1e-12));
            }
        }
    }

    #[test]
    fn the_function_of_the_multiplier_falls() {
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut number = |low: f64| rng.random_range(low..1.0);
            let mu = Vector4::new(number(0.1), number(0.1), -number(0.1), -number(0.1));
            let c = Vector4::from_fn(|_, _| number(-1.0));
            let g = |lambda: f64| c.zip_map(&mu, |c, mu| mu * (c / (1.0 + lambda * mu)).powi(2)).sum();
            let (low, high) = (-1.0 / mu.max(), -1.0 / mu.min());
            let values: Vec<f64> = (1..100).map(|k| g(low + (high - low) * f64::from(k) / 100.0)).collect();
            assert!(values.windows(2).all(|w| w[1] < w[0]));
            assert!(g(multiplier(&mu, &c)).abs() < 1e-9 * (g(low * 0.99) - g(high * 0.99)).abs().max(1.0));
        }
    }

    #[test]
    fn one_steering_angle_holds_no_offset() {
        let step = |n: f64| Step { input: Vector2::new(n, 0.3), rate: Vector2::zeros(), duration: 1.0 };
        let rows: Vec<Row> = [100.0, 250.0, -80.0].iter().map(|&n| Row::new(&[step(n)], 1.0, n * 1e-3, 1.0)).collect();
        assert!(symmetric(&rows).is_none() && asymmetric(&rows).is_none());
    }
}

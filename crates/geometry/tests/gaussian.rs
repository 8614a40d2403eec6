//! Propagation of Gaussians against samples.

#![allow(clippy::unwrap_used, reason = "tests may fail loudly")]

use groma_geometry::{Gaussian, LieGroup, Se2, Se3};
use nalgebra::{Cholesky, Const, SMatrix, SVector, Vector3, Vector6};

const SAMPLES: usize = 100_000;

/// Standard normal numbers (Box-Muller on a linear congruence).
struct Normals(u64);

impl Normals {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn vector<const D: usize>(&mut self) -> SVector<f64, D> {
        SVector::from_fn(|_, _| (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos())
    }
}

/// A covariance with correlations, of standard deviations around `sigma`.
fn spread<const D: usize>(normals: &mut Normals, sigma: f64) -> SMatrix<f64, D, D> {
    let mix = SMatrix::<f64, D, D>::from_fn(|r, c| if r == c { 1.0 } else { 0.3 * normals.vector::<1>().x });
    mix * mix.transpose() * (sigma * sigma)
}

/// Whether samples of `f(a, b)` spread as `expected` says, to 3 % of the standard deviations.
fn agrees<G: LieGroup<D>, const D: usize>(
    a: &Gaussian<G, D>,
    b: &Gaussian<G, D>,
    f: impl Fn(&G, &G) -> G,
    expected: &Gaussian<G, D>,
) {
    let mut normals = Normals(7);
    let root = |g: &Gaussian<G, D>| Cholesky::<f64, Const<D>>::new(g.covariance).unwrap().unpack();
    let (root_a, root_b) = (root(a), root(b));
    let (mut sum, mut distance) = (SMatrix::<f64, D, D>::zeros(), 0.0);
    for _ in 0..SAMPLES {
        let x = a.mean.plus(&(root_a * normals.vector::<D>()));
        let y = b.mean.plus(&(root_b * normals.vector::<D>()));
        let z = f(&x, &y);
        let xi = z.minus(&expected.mean);
        sum += xi * xi.transpose();
        distance += expected.mahalanobis_sq(&z).unwrap();
    }
    let sampled = sum / SAMPLES as f64;
    let sigmas = expected.covariance.diagonal().map(f64::sqrt);
    let error = (sampled - expected.covariance).component_div(&(sigmas * sigmas.transpose()));
    assert!(error.amax() < 0.03, "{error}");
    assert!((distance / SAMPLES as f64 / D as f64 - 1.0).abs() < 0.02);
}

fn propagates<G: LieGroup<D>, const D: usize>(a: G, b: G) {
    let mut normals = Normals(3);
    let a = Gaussian { mean: a, covariance: spread(&mut normals, 0.02) };
    let b = Gaussian { mean: b, covariance: spread(&mut normals, 0.03) };
    agrees(&a, &b, |x, y| *x * *y, &a.compose(&b));
    agrees(&a, &b, |x, y| x.between(y), &a.between(&b));
    agrees(&a, &b, |x, _| x.inverse(), &a.inverse());
}

#[test]
fn in_the_plane() {
    propagates(Se2::exp(Vector3::new(1.0, -2.0, 2.0)), Se2::exp(Vector3::new(0.5, 1.0, -0.7)));
}

#[test]
fn in_space() {
    let exp = |v: [f64; 6]| <Se3 as LieGroup<6>>::exp(&Vector6::from(v));
    propagates(exp([1.0, -2.0, 0.5, 0.3, 1.2, -0.5]), exp([0.2, 0.4, -1.0, -1.0, 0.1, 0.6]));
}

#[test]
fn a_direction_without_spread_has_no_distance() {
    let flat = Gaussian { mean: Se2::IDENTITY, covariance: nalgebra::Matrix3::zeros() };
    assert!(flat.mahalanobis_sq(&Se2::new(1.0, 0.0, 0.0)).is_none());
}

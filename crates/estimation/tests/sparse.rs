//! The sparse Cholesky against dense linear algebra.

#![allow(clippy::unwrap_used, reason = "tests may fail loudly")]

use groma_estimation::{BlockMatrix, Cholesky, Error};
use nalgebra::{DVector, SMatrix, SVector};

/// A small generator of numbers in (-1, 1), so that the tests need no crate for it.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn below(&mut self, n: usize) -> usize {
        (((self.next() + 1.0) / 2.0) * n as f64) as usize % n
    }
}

/// A chain with random chords, positive definite as a sum of `J^T J` and a little on the diagonal.
fn chain<const B: usize>(blocks: usize, chords: usize, seed: u64) -> BlockMatrix<B> {
    let mut numbers = Numbers(seed);
    let mut edges: Vec<_> = (1..blocks).map(|k| (k - 1, k)).collect();
    edges.extend((0..chords).map(|_| (numbers.below(blocks), numbers.below(blocks))));
    edges.retain(|(i, j)| i != j);
    let mut matrix = BlockMatrix::zeros(blocks, edges.iter().copied());
    for (i, j) in edges.iter().map(|&(i, j)| (i.min(j), i.max(j))) {
        let (a, b) = (random::<B>(&mut numbers), random::<B>(&mut numbers));
        matrix.diagonal[i] += a.transpose() * a;
        matrix.diagonal[j] += b.transpose() * b;
        let slot = matrix.slot(i, j).unwrap();
        matrix.upper[slot] += a.transpose() * b;
    }
    matrix.diagonal.iter_mut().for_each(|d| *d += SMatrix::identity() * 0.1);
    matrix
}

fn random<const B: usize>(numbers: &mut Numbers) -> SMatrix<f64, B, B> {
    SMatrix::from_fn(|_, _| numbers.next())
}

fn agrees_with_dense<const B: usize>(blocks: usize, chords: usize, seed: u64) {
    let matrix = chain::<B>(blocks, chords, seed);
    let inverse = matrix.to_dense().try_inverse().unwrap();
    let mut numbers = Numbers(seed + 1);
    let b: Vec<SVector<f64, B>> = (0..blocks).map(|_| SVector::from_fn(|_, _| numbers.next())).collect();
    let mut solver = Cholesky::analyze(&matrix).unwrap();
    solver.factorize(&matrix).unwrap();

    let expected = &inverse * DVector::from_iterator(blocks * B, b.iter().flat_map(|v| v.iter().copied()));
    let x = solver.solve(&b).unwrap();
    let scale = expected.amax();
    for (k, value) in x.iter().flat_map(|v| v.iter()).enumerate() {
        assert!((value - expected[k]).abs() < 1e-9 * scale, "B {B}, seed {seed}: x[{k}]");
    }
    let selected = solver.selected_inverse();
    let diagonal = selected.diagonal.iter().enumerate().map(|(k, block)| ((k, k), block));
    let upper = selected.pairs().iter().copied().zip(&selected.upper);
    for ((i, j), block) in diagonal.chain(upper) {
        let error = (block - inverse.fixed_view::<B, B>(i * B, j * B)).amax();
        assert!(error < 1e-9 * inverse.amax(), "B {B}, seed {seed}: block {i}, {j} of the inverse is off by {error}");
    }
    assert_eq!(selected.pairs(), matrix.pairs());
    for (k, value) in matrix.multiply(&x).iter().flat_map(|v| v.iter()).enumerate() {
        assert!((value - b[k / B][k % B]).abs() < 1e-9 * matrix.to_dense().amax() * scale);
    }
}

#[test]
fn solves_and_inverts_like_dense_algebra() {
    for seed in 0..20 {
        agrees_with_dense::<1>(60, 40, seed);
        agrees_with_dense::<2>(1, 0, seed);
        agrees_with_dense::<3>(80, 60, seed);
        agrees_with_dense::<3>(30, 400, seed);
        agrees_with_dense::<6>(25, 10, seed);
    }
}

#[test]
fn new_numbers_on_an_old_pattern_need_no_new_analysis() {
    let first = chain::<3>(50, 30, 1);
    let mut second = first.clone();
    second.diagonal.iter_mut().for_each(|d| *d *= 2.0);
    let b = vec![SVector::<f64, 3>::repeat(1.0); 50];
    let mut reused = Cholesky::analyze(&first).unwrap();
    reused.factorize(&first).unwrap();
    reused.factorize(&second).unwrap();
    let mut fresh = Cholesky::analyze(&second).unwrap();
    fresh.factorize(&second).unwrap();
    assert_eq!(reused.solve(&b).unwrap(), fresh.solve(&b).unwrap());
}

#[test]
fn what_is_unconstrained_is_named() {
    let mut matrix = chain::<3>(40, 0, 5);
    matrix.diagonal[17] = SMatrix::zeros();
    matrix.upper.iter_mut().for_each(|u| *u = SMatrix::zeros());
    let mut solver = Cholesky::analyze(&matrix).unwrap();
    assert_eq!(solver.factorize(&matrix), Err(Error::NotPositiveDefinite { block: 17 }));
    matrix.diagonal[17] = SMatrix::from_element(f64::NAN);
    assert!(solver.factorize(&matrix).is_err());
}

#[test]
fn another_size_is_refused() {
    let mut solver = Cholesky::analyze(&chain::<3>(10, 0, 5)).unwrap();
    assert!(matches!(solver.factorize(&chain::<3>(11, 0, 5)), Err(Error::Size { expected: 10, got: 11, .. })));
    assert_eq!(solver.factorize(&chain::<3>(10, 9, 5)), Err(Error::OtherPattern));
    solver.factorize(&chain::<3>(10, 0, 5)).unwrap();
    assert!(matches!(solver.solve(&[]), Err(Error::Size { .. })));
}

#[test]
fn a_system_without_unknowns_is_solved() {
    let matrix = BlockMatrix::<3>::zeros(0, []);
    let mut solver = Cholesky::analyze(&matrix).unwrap();
    solver.factorize(&matrix).unwrap();
    assert!(solver.solve(&[]).unwrap().is_empty() && solver.selected_inverse().diagonal.is_empty());
}

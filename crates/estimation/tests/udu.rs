//! UDU against a dense filter, and the plain and Joseph forms where they fail.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use groma_estimation::random::SplitMix64;
use groma_estimation::udu::{Real, Rows, Udu};
use nalgebra::{DMatrix, DVector, convert};
use proptest::prelude::*;

/// Repeatable numbers in (-1, 1).
struct Draw(SplitMix64);

impl Draw {
    fn next(&mut self) -> f64 {
        2.0 * self.0.uniform() - 1.0
    }

    fn matrix<T: Real>(&mut self, rows: usize, columns: usize) -> DMatrix<T> {
        DMatrix::from_fn(rows, columns, |_, _| convert(self.next()))
    }
}

/// The dense filter that UDU represents; states in the order of memory.
struct Dense {
    p: DMatrix<f64>,
    head: usize,
}

impl Dense {
    fn transform(&mut self, a: &DMatrix<f64>, q: &DMatrix<f64>) {
        self.p = a * &self.p * a.transpose() + q;
    }

    fn birth(&mut self, gain: &DMatrix<f64>, root: &DMatrix<f64>) {
        let (n, m) = (self.p.nrows(), root.nrows());
        let first = n - self.head;
        let mut a = DMatrix::zeros(n + m, n);
        a.view_mut((0, 0), (first, first)).fill_with_identity();
        a.view_mut((first, first), (m, self.head)).copy_from(gain);
        a.view_mut((first + m, first), (self.head, self.head)).fill_with_identity();
        let mut q = DMatrix::zeros(n + m, n + m);
        q.view_mut((first, first), (m, m)).copy_from(&(root * root.transpose()));
        self.transform(&a, &q);
    }

    fn predict(&mut self, f: &DMatrix<f64>, root: &DMatrix<f64>) {
        let (n, m) = (self.p.nrows(), f.nrows());
        let mut a = DMatrix::identity(n, n);
        a.view_mut((n - m, n - m), (m, m)).copy_from(f);
        let mut q = DMatrix::zeros(n, n);
        q.view_mut((n - m, n - m), (m, m)).copy_from(&(root * root.transpose()));
        self.transform(&a, &q);
    }

    fn update(&mut self, h: &DMatrix<f64>, y: &DVector<f64>, r: &DMatrix<f64>) -> (DVector<f64>, f64) {
        let s = (h * &self.p * h.transpose() + r).try_inverse().unwrap();
        let k = &self.p * h.transpose() * &s;
        self.p -= &k * h * &self.p;
        (k * y, (y.transpose() * s * y)[0])
    }
}

fn spread(h: &Rows<f64>, rows: usize, n: usize) -> DMatrix<f64> {
    let mut dense = DMatrix::zeros(rows, n);
    for (at, block) in &h.blocks {
        let mut part = dense.columns_mut(*at, block.ncols());
        part += block;
    }
    dense
}

fn close(a: &DMatrix<f64>, b: &DMatrix<f64>, share: f64) {
    assert!((a - b).amax() <= share * b.amax(), "{:.3e} of {:.3e}", (a - b).amax(), b.amax());
}

#[test]
fn equals_the_dense_filter_through_moves_births_and_measurements() {
    let mut draw = Draw(SplitMix64::new(7));
    let roots = [draw.matrix(6, 6) * 0.1, draw.matrix(6, 2)];
    let mut udu = Udu::new(&roots);
    let mut p = DMatrix::zeros(12, 12);
    p.view_mut((0, 0), (6, 6)).copy_from(&(&roots[0] * roots[0].transpose()));
    p.view_mut((6, 6), (6, 6)).copy_from(&(&roots[1] * roots[1].transpose()));
    let mut dense = Dense { p, head: 12 };
    let mut born = vec![];
    for step in 0..12 {
        let (f, noise) = (DMatrix::identity(6, 6) + draw.matrix::<f64>(6, 6) * 0.1, draw.matrix(6, 3) * 0.2);
        udu.predict((step % 2 == 0).then_some(&f), &noise).unwrap();
        dense.predict(&if step % 2 == 0 { f } else { DMatrix::identity(6, 6) }, &noise);
        if step % 3 == 0 {
            let (size, on_robot) = (7 + step / 3, step % 2 == 0);
            let (g, root) = (draw.matrix::<f64>(size, 12), draw.matrix(size, size) * 0.3);
            let gains = [(!on_robot).then(|| g.columns(0, 6).into_owned()), Some(g.columns(6, 6).into_owned())];
            born.push((udu.birth(&gains, &root).unwrap(), size));
            let mut used = g;
            if on_robot {
                used.columns_mut(0, 6).fill(0.0);
            }
            dense.birth(&used, &root);
        }
        let rows = 1 + step % 8;
        let (at, size) = born[step % born.len()];
        let h = Rows {
            blocks: vec![
                (at, draw.matrix(rows, size)),
                (udu.head(0), draw.matrix(rows, 6)),
                (udu.head(1), draw.matrix(rows, 6)),
            ],
        };
        let root: DMatrix<f64> = draw.matrix(rows, rows);
        let r = &root * root.transpose() * 0.01 + DMatrix::identity(rows, rows) * 0.01;
        let y = draw.matrix(rows, 1).column(0).into_owned();
        let all = spread(&h, rows, udu.len());
        close(&udu.innovation_covariance(&h, &r).unwrap(), &(&all * &dense.p * all.transpose() + &r), 1e-11);
        let (correction, (step, nis)) = (udu.update(&h, &y, &r).unwrap(), dense.update(&all, &y, &r));
        assert!((correction.step - &step).amax() < 1e-9 * step.amax().max(1e-3));
        assert!((correction.nis - nis).abs() < 1e-9 * nis);
        close(&udu.covariance(), &dense.p, 1e-10);
    }
    let (at, size) = born[0];
    close(
        &udu.covariance_block(at, udu.head(1), size, 6),
        &dense.p.view((at, dense.p.nrows() - 6), (size, 6)).into_owned(),
        1e-9,
    );
    assert!(born.iter().zip(&born[1..]).all(|(a, b)| a.0 + a.1 == b.0), "states keep their index");
}

/// The first update at which a covariance form has a negative variance or a gain that is not finite: 12 states, 200
/// correlated scalar measurements.
fn first_failure<T: Real>(ratio: f64, mut step: impl FnMut(&DVector<T>, T) -> bool) -> Option<usize> {
    let mut draw = Draw(SplitMix64::new(3));
    let shared: Vec<f64> = (0..12).map(|_| draw.next()).collect();
    (0..200).find(|_| {
        let h = DVector::from_fn(12, |i, _| convert(shared[i] + 0.1 * draw.next()));
        step(&h, convert(ratio.powi(-2)))
    })
}

fn negative<T: Real>(p: &DMatrix<T>) -> bool {
    let wide: DMatrix<f64> = p.map(|v| nalgebra::try_convert(v).unwrap_or(f64::NAN));
    let symmetric = (&wide + wide.transpose()) / 2.0;
    !symmetric.iter().all(|v| v.is_finite()) || symmetric.symmetric_eigenvalues().min() < 0.0
}

fn plain<T: Real>(ratio: f64) -> Option<usize> {
    let mut p = DMatrix::<T>::identity(12, 12);
    first_failure(ratio, |h, r| {
        let ph = &p * h;
        let s = h.dot(&ph) + r;
        p -= &ph * ph.transpose() / s;
        negative(&p)
    })
}

fn joseph<T: Real>(ratio: f64) -> Option<usize> {
    let mut p = DMatrix::<T>::identity(12, 12);
    first_failure(ratio, |h, r| {
        let ph = &p * h;
        let k = &ph / (h.dot(&ph) + r);
        let a = DMatrix::identity(12, 12) - &k * h.transpose();
        p = &a * &p * a.transpose() + &k * k.transpose() * r;
        negative(&p)
    })
}

fn udu<T: Real>(ratio: f64) -> Option<usize> {
    let mut udu = Udu::<T>::new(&[DMatrix::identity(12, 12)]);
    first_failure(ratio, |h, r| {
        let rows = Rows { blocks: vec![(0, DMatrix::from_row_slice(1, 12, h.as_slice()))] };
        let noise = DMatrix::from_element(1, 1, r);
        let done = udu.update(&rows, &DVector::zeros(1), &noise);
        done.is_err() || udu.d().iter().any(|d| !d.is_finite() || *d < T::zero())
    })
}

#[test]
fn only_udu_survives_measurements_far_more_precise_than_the_prior() {
    assert!(plain::<f32>(1e4).is_some() && joseph::<f32>(1e4).is_some());
    assert!(plain::<f64>(1e9).is_some() && joseph::<f64>(1e9).is_some());
    for exponent in 0..=10 {
        let ratio = 10f64.powi(exponent);
        assert_eq!((udu::<f32>(ratio), udu::<f64>(ratio)), (None, None), "ratio 1e{exponent}");
    }
}

#[test]
fn exact_states_stay_exact() {
    let mut udu = Udu::<f64>::new(&[DMatrix::zeros(6, 0)]);
    let first = udu.birth(&[Some(DMatrix::identity(6, 6))], &DMatrix::identity(6, 6)).unwrap();
    let h = Rows { blocks: vec![(first, DMatrix::identity(6, 6)), (udu.head(0), -DMatrix::identity(6, 6))] };
    let done = udu.update(&h, &DVector::repeat(6, 1.0), &DMatrix::identity(6, 6)).unwrap();
    assert!(done.step.rows(udu.head(0), 6).amax() == 0.0 && (done.step[0] - 0.5).abs() < 1e-15);
    close(&udu.covariance_block(first, first, 6, 6), &(DMatrix::identity(6, 6) * 0.5), 1e-15);
}

#[test]
fn wrong_sizes_and_numbers_are_refused_and_change_nothing() {
    let mut udu = Udu::<f64>::new(&[DMatrix::identity(6, 6)]);
    let before = udu.covariance();
    let h = |rows, columns| Rows { blocks: vec![(0, DMatrix::from_element(rows, columns, 1.0))] };
    let one = DMatrix::identity(1, 1);
    assert!(udu.update(&h(1, 7), &DVector::zeros(1), &one).is_err());
    assert!(udu.update(&h(2, 6), &DVector::zeros(1), &one).is_err());
    assert!(udu.update(&h(1, 6), &DVector::repeat(1, f64::NAN), &one).is_err());
    assert!(udu.update(&h(1, 6), &DVector::zeros(1), &(-one)).is_err());
    assert!(udu.predict(None, &DMatrix::zeros(5, 1)).is_err());
    assert!(udu.birth(&[], &DMatrix::identity(6, 6)).is_err());
    assert_eq!(udu.covariance(), before);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// D never becomes negative, whatever comes, for ratios of sigmas up to 1e10, in f32 and f64.
    #[test]
    fn d_is_never_negative(seed: u64, exponents in prop::collection::vec(-10i32..=10, 30)) {
        prop_assert!(smallest_d::<f64>(seed, &exponents) >= 0.0);
        prop_assert!(smallest_d::<f32>(seed, &exponents) >= 0.0);
    }
}

fn smallest_d<T: Real>(seed: u64, exponents: &[i32]) -> f64 {
    let mut draw = Draw(SplitMix64::new(seed | 1));
    let mut udu = Udu::<T>::new(&[draw.matrix(6, 6)]);
    let mut smallest = f64::INFINITY;
    for (step, &exponent) in exponents.iter().enumerate() {
        if step % 10 == 0 {
            udu.birth(&[Some(draw.matrix(7, 6))], &draw.matrix(7, 7)).unwrap();
        }
        udu.predict(None, &draw.matrix(6, 2)).unwrap();
        let rows = 1 + step % 6;
        let h = Rows { blocks: vec![(0, draw.matrix(rows, 7)), (udu.head(0), draw.matrix(rows, 6))] };
        let noise = DMatrix::<T>::identity(rows, rows) * convert::<f64, T>(10f64.powi(exponent).powi(2));
        udu.update(&h, &draw.matrix(rows, 1).column(0).into_owned(), &noise).unwrap();
        let least = udu.d().iter().map(|d| nalgebra::try_convert(*d).unwrap_or(f64::NAN));
        smallest = least.fold(smallest, |a: f64, b: f64| if b.is_nan() { b } else { a.min(b) });
    }
    smallest
}

//! Prints how long a network of n cameras (7 states each) takes for a 6-DOF measurement, a birth and a move.
//!
//!     cargo bench -p groma-benches --bench udu
//!
//! Times are those of the processor where Linux tells them (a busy machine does not spoil them), else of the clock.

#![allow(clippy::disallowed_methods, clippy::print_stdout, clippy::unwrap_used)]

use groma_estimation::udu::{Real, Rows, Udu};
use nalgebra::{DMatrix, DVector, convert};
use std::time::Instant;

const STATES: usize = 7;
/// The processor's time has steps; below this the clock is better [ms].
const COARSE: f64 = 20.0;

fn main() {
    println!("cameras   precision   measurement, six rows   one row   birth   move   [ms]");
    for cameras in [125, 250, 500, 1000] {
        report::<f64>("f64", cameras);
        report::<f32>("f32", cameras);
    }
}

fn report<T: Real>(name: &str, cameras: usize) {
    let number = convert::<f64, T>;
    let mut udu = Udu::<T>::new(&[DMatrix::identity(6, 6) * number(0.01)]);
    let root = DMatrix::identity(STATES, STATES) * number(0.01);
    let gain = DMatrix::from_fn(STATES, 6, |i, j| if i == j { T::one() } else { T::zero() });
    for _ in 1..cameras {
        udu.predict(None, &(DMatrix::identity(6, 6) * number(0.01))).unwrap();
        udu.birth(&[Some(gain.clone())], &root).unwrap();
    }
    let birth = best(5, || {
        udu.birth(&[Some(gain.clone())], &root).unwrap();
    });
    let shift = best(20, || udu.predict(None, &(DMatrix::identity(6, 6) * number(0.01))).unwrap());
    let camera = STATES * (cameras / 2);
    let mut measure = |rows: usize| {
        let h = |columns: usize| {
            DMatrix::from_fn(rows, columns, |i, j| number(if i == j { 1.0 } else { 0.1 / (1 + i + j) as f64 }))
        };
        let h = Rows { blocks: vec![(camera, -h(STATES)), (udu.head(0), h(6))] };
        best(5, || {
            udu.update(&h, &DVector::zeros(rows), &(DMatrix::identity(rows, rows) * number(1e-4))).unwrap();
        })
    };
    let (six, one) = (measure(6), measure(1));
    println!("{cameras:7}   {name}   {six:.2}   {one:.2}   {birth:.3}   {shift:.4}");
}

/// Time that this thread has been running [ms].
fn on_processor() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e6)
}

/// The best time of several runs [ms].
fn best(runs: usize, mut run: impl FnMut()) -> f64 {
    let time = |run: &mut dyn FnMut()| {
        let (clock, start) = (Instant::now(), on_processor());
        run();
        let elapsed = clock.elapsed().as_secs_f64() * 1e3;
        let used = start.zip(on_processor()).map(|(a, b)| b - a).filter(|used| *used > COARSE);
        used.map_or(elapsed, |used| used.min(elapsed))
    };
    (0..runs).map(|_| time(&mut run)).fold(f64::INFINITY, f64::min)
}

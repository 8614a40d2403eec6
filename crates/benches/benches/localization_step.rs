//! One predict and update with 30 observations and 10 000 landmarks in the map.
//!
//! `cargo bench -p groma-benches --bench localization_step`

// criterion's macros have no documents; a bench measures, prints and may fail loudly
#![allow(missing_docs, clippy::disallowed_methods, clippy::print_stdout, clippy::unwrap_used)]

#[path = "../../localization/tests/drive/mod.rs"]
mod drive;

use criterion::{Criterion, criterion_group, criterion_main};
use drive::{Draw, Hall};
use groma_geometry::Se2;
use groma_localization::{Localizer, Mode, Motion, Observation, Options, Start};
use nalgebra::{Matrix3, SMatrix, Vector3};
use std::time::Instant;

const OBSERVATIONS: usize = 30;

/// A vehicle that goes to and fro between two places among 10 000 landmarks.
struct Shuttle {
    localizer: Localizer,
    /// The motion to each place, and what is seen there.
    legs: [(Motion, Vec<Observation>); 2],
    steps: usize,
}

impl Shuttle {
    fn new(mode: Mode) -> Self {
        let hall = Hall { detected: 1.0, clutter: 0, ..Hall::new(1, 10_000, 0, 300.0, 1.0) };
        let mut draw = Draw::new(2);
        let map = hall.survey(&mut draw, |_| true);
        let (path, turn) = (0.05, 0.01);
        let forth = Se2::exp(Vector3::new(path, 0.0, turn));
        let here = Se2::new(150.0, 140.0, 0.3);
        let mut leg = |motion: Se2, place: Se2| {
            let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 2.5e-5, 2.5e-5)) * path;
            let mut seen: Vec<_> = hall.look(&place, 0.0, &mut draw).into_iter().map(|s| s.1).collect();
            seen.truncate(OBSERVATIONS);
            assert_eq!(seen.len(), OBSERVATIONS);
            (Motion { motion, covariance, by_drive: SMatrix::zeros() }, seen)
        };
        let legs = [leg(forth, here * forth), leg(forth.inverse(), here)];
        let p0 = Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 1e-5));
        let start = Start { stamp: 0.0, pose: Some((here, p0)), mount: Se2::IDENTITY, calibration: None };
        Self { localizer: Localizer::new(map, &start, Options { mode, ..Options::default() }).unwrap(), legs, steps: 0 }
    }

    fn step(&mut self) {
        let stamp = (self.steps + 1) as f64 / 20.0;
        let (motion, seen) = &mut self.legs[self.steps % 2];
        seen.iter_mut().for_each(|o| o.stamp = stamp);
        self.localizer.predict(stamp, motion).unwrap();
        let quality = self.localizer.update(seen, None).quality;
        assert!(quality.matched > OBSERVATIONS - 5);
        self.steps += 1;
    }
}

fn steps(c: &mut Criterion) {
    for (name, mode) in [("static", Mode::Static), ("mixed", Mode::Mixed)] {
        let mut shuttle = Shuttle::new(mode);
        (0..100).for_each(|_| shuttle.step());
        let memory = shuttle.localizer.joint().points().len();
        let title = format!("predict and update, {name}, {memory} landmarks in memory");
        c.bench_function(&title, |b| b.iter(|| shuttle.step()));
        // Other work on the machine only ever adds: the best of many short batches is what the step costs.
        let batch = |shuttle: &mut Shuttle| {
            let begin = Instant::now();
            (0..20).for_each(|_| shuttle.step());
            begin.elapsed().as_secs_f64() / 20.0
        };
        let best = (0..2000).map(|_| batch(&mut shuttle)).fold(f64::INFINITY, f64::min);
        println!("best of 2000 batches of 20: {:.1} us\n", 1e6 * best);
    }
}

criterion_group! { name = benches; config = Criterion::default().sample_size(50); targets = steps }
criterion_main!(benches);

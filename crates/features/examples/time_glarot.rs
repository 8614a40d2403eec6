//! Time of the signatures, one thread: `cargo run --release -p groma-features --example time_glarot`.
//!
//! Local maps of 30 random landmarks over 20 m; every hundredth query is one of the maps, with 5 cm of noise.
#![allow(clippy::print_stdout)]

use groma_features::glarot::{Index, Options, Signature};
use nalgebra::Vector2;
use std::time::Instant;

const MAPS: usize = 10_000;

fn main() {
    for options in [Options::default(), Options { n_theta: 16, ..Options::default() }] {
        let signatures: Vec<_> = (0..MAPS).map(|k| Signature::from_points(&landmarks(k as u64), &options)).collect();
        let start = Instant::now();
        let distances = (1..MAPS).map(|k| signatures[k - 1].distance(&signatures[k]).0);
        let mean = distances.sum::<f64>() / MAPS as f64;
        let each = start.elapsed().as_secs_f64() / MAPS as f64;
        println!("{} x {} bins: distance {:.3} us (mean {mean:.3})", options.n_theta, options.n_rho, each * 1e6);
        let mut index = Index::new();
        signatures.iter().for_each(|s| {
            index.add(s.clone());
        });
        let queries: Vec<_> = (0..20).map(|k| Signature::from_points(&seen_again(k * 331), &options)).collect();
        let start = Instant::now();
        let found = queries.iter().map(|q| index.query(q, 10, |_| true)[0].index).zip(0..);
        let right = found.filter(|(found, k)| *found == k * 331).count();
        let each = start.elapsed().as_secs_f64() / queries.len() as f64;
        println!("    10 best of {MAPS}: {:.3} ms, {right} of {} right", each * 1e3, queries.len());
    }
}

/// Landmarks of a map.
fn landmarks(seed: u64) -> Vec<Vector2<f64>> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..8).for_each(|_| {
        uniform();
    });
    (0..30).map(|_| Vector2::new(20.0 * uniform(), 20.0 * uniform())).collect()
}

/// The same place, turned by 0.7 rad, less than all of it.
fn seen_again(place: usize) -> Vec<Vector2<f64>> {
    let jitter = |k: usize| 0.05 * ((k * 7919 % 100) as f64 / 50.0 - 1.0);
    let turned = nalgebra::Rotation2::new(0.7);
    let noisy = |(k, p): (usize, Vector2<f64>)| turned * (p + Vector2::new(jitter(k), jitter(k + 50)));
    landmarks(place as u64).into_iter().enumerate().map(noisy).take(26).collect()
}

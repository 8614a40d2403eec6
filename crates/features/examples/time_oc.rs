//! Time of OC a scan, one thread: `cargo run --release -p groma-features --example time_oc`.
//!
//! Scans of a room of 8 x 6 m seen from 200 places, 1 cm noise.
#![allow(clippy::print_stdout)]

use groma_features::oc::{Detector, Options};
use groma_models::BeamGeometry;
use std::time::Instant;

fn main() {
    for (beams, field) in [(181, 180.0_f64), (361, 180.0), (541, 270.0), (1081, 270.0)] {
        let (angle_min, angle_increment) = (-0.5 * field.to_radians(), field.to_radians() / (beams - 1) as f64);
        let geometry =
            BeamGeometry { angle_min, angle_increment, time_increment: 0.0, range_min: 0.05, range_max: 30.0 };
        let scans: Vec<Vec<f64>> = (0..200).map(|k| scan(&geometry, beams, k)).collect();
        let mut detector = Detector::new(geometry, beams, Options::default());
        let (mut keypoints, mut found, mut best) = (Vec::new(), 0, f64::INFINITY);
        for _ in 0..15 {
            let start = Instant::now();
            found = 0;
            for ranges in &scans {
                detector.detect(ranges, &mut keypoints);
                found += keypoints.len();
            }
            best = best.min(start.elapsed().as_secs_f64() / scans.len() as f64);
        }
        let each = found as f64 / scans.len() as f64;
        println!("{beams:5} beams: {:6.2} us a scan, {each:.1} keypoints", best * 1e6);
    }
}

/// Reading of every beam in a room that turns a little with every `seed`.
fn scan(geometry: &BeamGeometry, beams: usize, seed: usize) -> Vec<f64> {
    let shift = 0.01 * seed as f64;
    let reading = |i: usize| {
        let (sin, cos) = (geometry.bearing(i) + shift).sin_cos();
        let noise = ((i * 7919 + seed * 104_729) % 100) as f64 / 5000.0 - 0.01;
        ((5.0 - shift) / cos.abs()).min((2.0 + shift) / sin.abs()) + noise
    };
    (0..beams).map(reading).collect()
}

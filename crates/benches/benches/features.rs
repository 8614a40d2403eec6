//! Times of the feature chapter, one thread: `cargo bench -p groma-benches --bench features`.
//!
//! Scans of a zigzag hall with 1 cm noise from 200 places; local maps of 30 random landmarks over 20 m.
#![allow(missing_docs)]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use groma_estimation::random::SplitMix64;
use groma_features::bsc::Bsc;
use groma_features::cgh::Cgh;
use groma_features::glarot::{self, Index, Signature};
use groma_features::{Keypoint, Surroundings, falko, oc};
use groma_models::{BeamGeometry, LaserScan};
use nalgebra::{Rotation2, Vector2};
use std::hint::black_box;

const MAPS: usize = 10_000;

fn geometry(beams: usize, field_deg: f64) -> BeamGeometry {
    let field = field_deg.to_radians();
    let (angle_min, angle_increment) = (-0.5 * field, field / (beams - 1) as f64);
    BeamGeometry { angle_min, angle_increment, time_increment: 0.0, range_min: 0.05, range_max: 30.0 }
}

/// A hall of 10 x 4 m with pillars along its walls, from another place for every seed.
fn scan(geometry: &BeamGeometry, beams: usize, seed: u64) -> Vec<f64> {
    let (mut random, shift) = (SplitMix64::new(seed), 0.01 * seed as f64);
    let mut reading = |i: usize| {
        let (sin, cos) = geometry.bearing(i).sin_cos();
        let (wall, side) = ((5.0 - shift) / cos.abs(), (2.0 + shift) / sin.abs());
        let range = wall.min(side);
        let along = if wall < side { range * sin } else { range * cos } + shift;
        let pillar = if along.rem_euclid(1.0) < 0.3 { 0.3 } else { 0.0 };
        range - pillar + 0.02 * random.uniform() - 0.01
    };
    (0..beams).map(&mut reading).collect()
}

fn scans(geometry: &BeamGeometry, beams: usize) -> Vec<Vec<f64>> {
    (0..200).map(|seed| scan(geometry, beams, seed)).collect()
}

fn detectors(c: &mut Criterion) {
    let mut group = c.benchmark_group("200 scans");
    for (beams, field) in [(181, 180.0), (361, 180.0), (1081, 270.0)] {
        let geometry = geometry(beams, field);
        let (scans, mut keypoints) = (scans(&geometry, beams), Vec::new());
        let mut detector = falko::Detector::new(geometry, beams, falko::Options::default());
        group.bench_function(BenchmarkId::new("falko", beams), |b| {
            b.iter(|| scans.iter().for_each(|s| detector.detect(black_box(s), &mut keypoints)));
        });
        let mut detector = oc::Detector::new(geometry, beams, oc::Options::default());
        group.bench_function(BenchmarkId::new("oc", beams), |b| {
            b.iter(|| scans.iter().for_each(|s| detector.detect(black_box(s), &mut keypoints)));
        });
    }
    group.finish();
}

fn descriptors(c: &mut Criterion) {
    let geometry = geometry(361, 180.0);
    let ranges = scan(&geometry, 361, 1);
    let mut keypoints: Vec<Keypoint> = Vec::new();
    falko::Detector::new(geometry, 361, falko::Options::default()).detect(&ranges, &mut keypoints);
    let hits: Vec<_> = LaserScan { stamp: 0.0, geometry, ranges, intensities: Vec::new() }.hits().collect();
    let k = keypoints[0];
    let near = |(i, _): &&(usize, Vector2<f64>)| i.abs_diff(k.index) <= 15 && *i != k.index;
    let around: Vec<Vector2<f64>> = hits.iter().filter(near).map(|h| h.1).collect();
    c.bench_function("bsc and cgh of a keypoint, 30 points", |b| {
        b.iter(|| {
            let around = Surroundings::of(black_box(&around).iter().copied(), &k, k.radius);
            (Bsc::of(&around), Cgh::of(&around))
        });
    });
    let bsc = Bsc::of(&Surroundings::of(around.iter().copied(), &k, k.radius));
    c.bench_function("bsc distance", |b| b.iter(|| black_box(&bsc).distance(black_box(&bsc))));
}

fn landmarks(seed: u64) -> Vec<Vector2<f64>> {
    let mut random = SplitMix64::new(seed);
    (0..30).map(|_| Vector2::new(20.0 * random.uniform(), 20.0 * random.uniform())).collect()
}

/// The same place, turned by 0.7 rad, less than all of it.
fn seen_again(place: u64) -> Vec<Vector2<f64>> {
    let mut random = SplitMix64::new(place + 77);
    let mut noisy =
        |p: Vector2<f64>| Rotation2::new(0.7) * (p + Vector2::new(random.uniform(), random.uniform()) * 0.1);
    landmarks(place).into_iter().take(26).map(&mut noisy).collect()
}

fn signatures(c: &mut Criterion) {
    let options = glarot::Options::default();
    let of = |points: &[Vector2<f64>]| Signature::from_points(points, &options);
    let all: Vec<Signature> = (0..MAPS as u64).map(|k| of(&landmarks(k))).collect();
    c.bench_function("glarot distance", |b| b.iter(|| black_box(&all[0]).difference(black_box(&all[1]))));
    let mut index = Index::new();
    for signature in &all {
        index.add(signature);
    }
    let query = of(&seen_again(331));
    assert_eq!(index.query(&query, 10, |_| true)[0].index, 331);
    c.bench_function("10 best of 10 000 local maps", |b| b.iter(|| index.query(black_box(&query), 10, |_| true)));
}

criterion_group!(benches, detectors, descriptors, signatures);
criterion_main!(benches);

//! Several poses for one scan: where to start registrations from, and which result to believe.
//!
//! ```text
//! starts    correlative search around each of some centers, as wide as the prior
//! cost      negative log posterior of a registration  +  CONTRADICTION (points seen through)
//! choice    the least cost; its covariance widened by the others, each with weight exp(best - other)
//! ```
//!
//! A point is seen through where another view of the place, of the last keyframes, had a beam pass.

use crate::keyframe::Keyframe;
use groma_geometry::Se2;
use groma_registration::{Alignment, CorrelativeField, PolarView, Prior, SurfaceMap, SurfaceScan, Visibility, Window};
use nalgebra::{Matrix3, Vector2};

/// What a point that was seen through adds to the negative log posterior of a pose, and how many keyframes are asked.
const CONTRADICTION: f64 = 0.3;
const WITNESSES: usize = 3;
/// A pose with a negative log posterior this much above the best is no rival.
const NO_RIVAL: f64 = 8.0;
/// Cell [m] and levels of the search field; range of the points that enter it [m].
const FIELD: (f64, usize, f64) = (0.1, 3, 30.0);

/// Starts found by correlative search around each of `centers`.
pub(crate) fn starts(scan: &SurfaceScan, surfaces: &SurfaceMap, centers: &[Se2], prior: &Prior) -> Vec<Se2> {
    let sigma = |k: usize| prior.information[(k, k)].powf(-0.5);
    let window = |center: &Se2| Window {
        center: *center,
        reach: (2.5 * sigma(0)).clamp(0.4, 1.5),
        turn: (2.5 * sigma(2)).clamp(0.35, 1.0),
    };
    let near = |p: &&Vector2<f64>| (*p - centers[0].translation).norm() < FIELD.2;
    let points: Vec<Vector2<f64>> = surfaces.points().iter().filter(near).copied().collect();
    let field = CorrelativeField::new(&points, FIELD.0, FIELD.1);
    let step = scan.points.len().div_ceil(120).max(1);
    let seen: Vec<Vector2<f64>> = scan.points.iter().step_by(step).filter(|p| p.norm() < FIELD.2).copied().collect();
    let mut starts: Vec<Se2> = Vec::new();
    let mut done: Vec<Se2> = Vec::new();
    for center in centers {
        let covered = done.iter().any(|d| {
            let e = d.between(center);
            e.translation.norm() < 0.2 && e.theta().abs() < 0.15
        });
        if !covered {
            done.push(*center);
            starts.extend(field.search(&seen, &window(center), 0.15, 0.7).iter().take(8).map(|p| p.pose));
        }
    }
    starts
}

/// Adds to the cost of alignments to a local map at `anchor` what the views contradict; of those that could still win.
pub(crate) fn weigh_contradictions(found: &mut Vec<Alignment>, view: &PolarView, anchor: &Se2, keyframes: &[Keyframe]) {
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut lowest = f64::INFINITY;
    let mut weighed = 0;
    for a in found.iter_mut() {
        if a.cost > lowest + NO_RIVAL {
            break;
        }
        let pose = *anchor * a.pose;
        a.cost += CONTRADICTION * contradictions(view, &pose, keyframes) as f64;
        lowest = lowest.min(a.cost);
        weighed += 1;
    }
    found.truncate(weighed);
}

/// How many points of a scan at `pose` recent keyframes saw through, and how many of theirs it sees through.
fn contradictions(view: &PolarView, pose: &Se2, keyframes: &[Keyframe]) -> usize {
    let through = |by: &PolarView, points: &SurfaceScan, t: Se2| {
        points.points.iter().filter(|p| by.visibility(t.act(**p)) == Visibility::SeenThrough).count()
    };
    let recent = keyframes.iter().rev().step_by(2).take(WITNESSES);
    recent
        .map(|k| {
            let t = k.tracked.between(pose);
            through(&k.view, &view.scan, t) + through(view, &k.view.scan, t.inverse())
        })
        .sum()
}

/// The alignment of highest posterior, its covariance widened by the others as far as they compete with it.
pub(crate) fn choose(mut found: Vec<Alignment>) -> Alignment {
    found.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut best = found[0].clone();
    let mut scatter = Matrix3::zeros();
    let mut weight = 1.0;
    for other in &found[1..] {
        let e = other.pose.minus(&best.pose);
        let w = (best.cost - other.cost).exp();
        scatter += e * e.transpose() * w;
        weight += w;
    }
    scatter /= weight;
    if scatter.trace() > 1e-6 {
        let covariance = (best.information + Matrix3::identity() * 1e-2).try_inverse().unwrap_or_else(Matrix3::zeros);
        best.information = (covariance + scatter).try_inverse().unwrap_or(best.information);
    }
    best
}

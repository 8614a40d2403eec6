//! Several poses for one scan: where to start registrations from, and which result to believe.
//!
//! ```text
//! starts    correlative search around each of some centers, as wide as the prior
//! cost      negative log posterior of a registration  +  CONTRADICTION (points seen through)
//! choice    the least cost; its covariance widened by the others, each with weight exp(best - other)
//! ```
//!
//! A point is seen through where another view of the place, of the last keyframes, had a beam pass.

use crate::tracked::Tracked;
use groma_geometry::Se2;
use groma_registration::{Alignment, CorrelativeField, PolarView, Prior, SurfaceMap, SurfaceScan, Visibility, Window};
use nalgebra::{Matrix3, Vector2};
use std::collections::VecDeque;

/// What a point that was seen through adds to the negative log posterior of a pose, and how many keyframes are asked.
const CONTRADICTION: f64 = 0.3;
const WITNESSES: usize = 3;
/// Keyframes that must be at hand: every other one is queried, from the last backwards.
pub(crate) const RECENT: usize = 2 * WITNESSES - 1;
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
pub(crate) fn weigh_contradictions(
    found: &mut Vec<Alignment>,
    view: &PolarView,
    anchor: &Se2,
    keyframes: &VecDeque<Tracked>,
) {
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
fn contradictions(view: &PolarView, pose: &Se2, keyframes: &VecDeque<Tracked>) -> usize {
    let through = |by: &PolarView, points: &SurfaceScan, t: Se2| {
        points.points.iter().filter(|p| by.visibility(t.act(**p)) == Visibility::SeenThrough).count()
    };
    let recent = keyframes.iter().rev().step_by(2).take(WITNESSES);
    recent
        .map(|k| {
            let t = k.pose.between(pose);
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

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::{BeamGeometry, LaserScan};
    use nalgebra::Vector3;

    fn found(pose: Se2, cost: f64) -> Alignment {
        let information = Matrix3::identity() * 1e4;
        Alignment { pose, information, share: 1.0, matched: 100, scale: 0.01, cost, converged: true }
    }

    /// A keyframe in a room of 8 by 5 m that looks to the front, or all around.
    fn looking(all_around: bool) -> Tracked {
        let (angle_min, angle_increment, time_increment) = (-3.1, 0.02, 0.0);
        let geometry = BeamGeometry { angle_min, angle_increment, time_increment, range_min: 0.1, range_max: 30.0 };
        let range = |i: usize| {
            let (sin, cos) = geometry.bearing(i).sin_cos();
            let ahead = if cos > 0.0 { 5.0 / cos } else { -3.0 / cos };
            let aside = if sin > 0.0 { 3.0 / sin } else { -2.0 / sin };
            if cos > 0.0 || all_around { ahead.min(aside) } else { f64::INFINITY }
        };
        let scan = LaserScan { stamp: 0.0, geometry, ranges: (0..310).map(range).collect(), intensities: vec![] };
        Tracked::at(0.0, Se2::IDENTITY, PolarView::new(&scan, &Se2::IDENTITY, Vector3::zeros()))
    }

    /// Poses and costs after weighing against one keyframe.
    fn weighed(view: &Tracked, keyframe: Tracked, found: &[Alignment]) -> Vec<(f64, f64)> {
        let mut found = found.to_vec();
        weigh_contradictions(&mut found, &view.view, &Se2::IDENTITY, &[keyframe].into());
        found.iter().map(|a| (a.pose.x(), a.cost)).collect()
    }

    #[test]
    fn the_likeliest_is_chosen_and_is_as_uncertain_as_its_rivals_are_far_and_likely() {
        let at = |x: f64, cost: f64| found(Se2::new(x, 0.0, 0.0), cost);
        let sigma_sq = |a: &Alignment| a.information.try_inverse().unwrap().m11;
        let alone = choose(vec![at(1.0, 5.0)]);
        assert!((sigma_sq(&alone) - 1e-4).abs() < 1e-9);
        for rivals in [vec![at(1.0, 5.0), at(1.4, 5.0)], vec![at(1.4, 5.0 + 1e-9), at(1.0, 5.0)]] {
            let torn = choose(rivals);
            assert!(torn.pose.x() == 1.0 && (sigma_sq(&torn) - 0.08 - 1e-4).abs() < 1e-4, "{}", sigma_sq(&torn));
            assert!(torn.information.m22 > 9e3, "across it is as well known as before");
        }
        let sure = choose(vec![at(1.4, 25.0), at(1.0, 5.0)]);
        assert!(sure.pose.x() == 1.0 && (sigma_sq(&sure) - 1e-4).abs() < 1e-6);
    }

    #[test]
    fn who_stands_where_walls_were_seen_through_pays_and_who_cannot_win_is_dropped() {
        let at = |x: f64, cost: f64| found(Se2::new(x, 0.0, 0.0), cost);
        let room = looking(true);
        let [first, second] = &weighed(&room, room.clone(), &[at(1.0, 2.9), at(0.0, 3.0), at(0.1, 50.0)])[..] else {
            panic!("two that may win")
        };
        assert!(first.0 == 1.0 && first.1 > 8.0 && *second == (0.0, 3.0), "{first:?} {second:?}");
    }

    #[test]
    fn two_views_contradict_each_other_whichever_is_asked() {
        let (front, room) = (looking(false), looking(true));
        let pose = Se2::new(0.7, -0.3, 0.2);
        let forth = weighed(&front, room.clone(), &[found(pose, 0.0)])[0].1;
        let back = weighed(&room, front, &[found(pose.inverse(), 0.0)])[0].1;
        assert!(forth > 1.0 && (forth - back).abs() < 1e-9, "{forth} {back}");
    }

    #[test]
    fn a_start_is_looked_for_as_far_as_the_prior_is_unsure_around_every_center() {
        let view = looking(true).view;
        let mut surfaces = SurfaceMap::default();
        surfaces.insert(&view.scan, &Se2::IDENTITY);
        let is_found = |centers: &[Se2], sigma: f64| {
            let information = Matrix3::from_diagonal(&Vector3::new(sigma, sigma, 0.2).map(|s| s.powi(-2)));
            let prior = Prior { pose: centers[0], information, dof: 4.0 };
            let near = |start: &Se2| start.translation.norm() < 0.15 && start.theta().abs() < 0.1;
            starts(&view.scan, &surfaces, centers, &prior).iter().any(near)
        };
        let off = [Se2::new(0.5, -0.5, 0.0), Se2::new(0.0, 0.0, 0.35), Se2::new(0.0, 0.0, -0.35)];
        assert!(off.iter().all(|center| is_found(&[*center], 0.3)));
        assert!(!is_found(&[Se2::new(1.0, 0.0, 0.0)], 0.1), "who is sure does not look far");
        let turned = Se2::new(0.0, 0.0, 1.2);
        assert!(!is_found(&[turned], 0.3) && is_found(&[turned, Se2::IDENTITY], 0.3));
    }
}

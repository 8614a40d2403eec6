//! From rough poses to few good ones: count, refine, distinguish.
//!
//! A pose is refined by pairing each seen landmark with the nearest landmark of the map of its kind, one to one, and by
//! weighted least squares, in turns, each turn with the pairs and the weights W of its beginning:
//!
//! ```text
//! minimise sum r^T W r,   r = m - T q,   W = (R C R^T + Sigma_m + s^2 I)^-1,   covariance = (sum J^T W J)^-1,   J = R [ I | q^perp ]
//! ```
//!
//! where s is what the odometry of the view adds.

use super::{Located, RelocalizeOptions, Seen};
use crate::map::StaticMap;
use groma_estimation::levenberg_marquardt::{self, Normal, Problem, minimize};
use groma_geometry::{Se2, wrap};
use groma_models::Landmark;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};
use std::collections::HashMap;
use std::convert::Infallible;

/// Poses within a cell of this size are one guess [m], [rad].
const CELL: (f64, f64) = (0.5, 0.17);
/// Two answers closer than this are the same [m], [rad].
const SAME: (f64, f64) = (0.5, 0.17);
/// Rounds of pairing and fitting.
const ROUNDS: usize = 4;
/// A fit ends at a step that promises less than a millionth of a chi-square of one.
const FIT: levenberg_marquardt::Options = levenberg_marquardt::Options { max_iterations: 10, tolerance: 1e-6 };
/// Standard deviation that the odometry of the view adds to a landmark [m].
const VIEW_SIGMA: f64 = 0.03;
/// Pairs that a pose needs.
const LEAST_PAIRS: usize = 3;

/// A refined pose with its covariance and the pairs that hold it.
pub(super) type Refined = (Se2, Matrix3<f64>, Vec<(usize, usize)>);

/// Distinct guesses, those first that put most seen landmarks on the map.
pub(super) fn rank(guesses: &[Se2], seen: &[Seen], map: &StaticMap, options: &RelocalizeOptions) -> Vec<Se2> {
    let mut best: HashMap<(i64, i64, i64), (usize, usize)> = HashMap::new();
    for (k, pose) in guesses.iter().enumerate() {
        let count = seen.iter().filter(|s| nearest(pose, s, map, options.tolerance, options).is_some()).count();
        let cell = best.entry(cell(pose)).or_insert((0, k));
        if count > cell.0 {
            *cell = (count, k);
        }
    }
    let mut ranked: Vec<(usize, usize)> = best.into_values().filter(|(count, _)| *count >= LEAST_PAIRS).collect();
    ranked.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().map(|(_, k)| guesses[k]).collect()
}

fn cell(pose: &Se2) -> (i64, i64, i64) {
    let at = |v: f64, size: f64| (v / size).floor() as i64;
    (at(pose.x(), CELL.0), at(pose.y(), CELL.0), at(pose.theta(), CELL.1))
}

/// The nearest landmark of the map that a seen one may be, with its squared distance.
fn nearest(pose: &Se2, seen: &Seen, map: &StaticMap, radius: f64, options: &RelocalizeOptions) -> Option<(f64, usize)> {
    let place = pose.act(seen.point);
    let mut best: Option<(f64, usize)> = None;
    map.near(place, radius, |k, landmark| {
        let sq = (landmark.position - place).norm_squared();
        if best.is_none_or(|b| (sq, k) < b) && is_like(pose, seen, landmark, options) {
            best = Some((sq, k));
        }
    });
    best
}

fn is_like(pose: &Se2, seen: &Seen, landmark: &Landmark, options: &RelocalizeOptions) -> bool {
    let turned = match (seen.orientation, landmark.orientation) {
        (Some(a), Some(b)) => wrap(a + pose.theta() - b).abs() <= options.orientation_max,
        _ => true,
    };
    seen.kind == landmark.kind && turned
}

/// The pose refined; none where fewer than three pairs hold it.
pub(super) fn refine(guess: &Se2, seen: &[Seen], map: &StaticMap, options: &RelocalizeOptions) -> Option<Refined> {
    let (mut pose, mut information) = (*guess, Matrix3::zeros());
    let mut pairs = Vec::new();
    for round in 0..ROUNDS {
        let radius = if round == 0 { 1.5 * options.tolerance } else { options.tolerance };
        pairs = pair(&pose, seen, map, radius, options);
        if pairs.len() < LEAST_PAIRS {
            return None;
        }
        let mut fit = Fit::new(&pose, &pairs, seen, map)?;
        let Ok(end) = minimize(&mut fit, pose, &FIT);
        (pose, information) = (end?.state, fit.normal.information);
    }
    Some((pose, information.try_inverse()?, pairs))
}

/// One-to-one pairs, nearest first.
pub(super) fn pair(
    pose: &Se2,
    seen: &[Seen],
    map: &StaticMap,
    radius: f64,
    options: &RelocalizeOptions,
) -> Vec<(usize, usize)> {
    let near = seen
        .iter()
        .enumerate()
        .filter_map(|(s, one)| nearest(pose, one, map, radius, options).map(|(sq, k)| (sq, s, k)));
    let mut near: Vec<(f64, usize, usize)> = near.collect();
    near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut pairs: Vec<(usize, usize)> = Vec::new();
    for (_, s, k) in near {
        if pairs.iter().all(|(_, taken)| *taken != k) {
            pairs.push((s, k));
        }
    }
    pairs
}

/// Paired landmarks: seen, mapped, and the weight of their distance.
struct Fit {
    pairs: Vec<(Vector2<f64>, Vector2<f64>, Matrix2<f64>)>,
    normal: Normal<3>,
}

impl Fit {
    fn new(pose: &Se2, pairs: &[(usize, usize)], seen: &[Seen], map: &StaticMap) -> Option<Self> {
        let pair = |&(s, k): &(usize, usize)| {
            let (one, landmark) = (&seen[s], &map.landmarks()[k]);
            Some((one.point, landmark.position, spread(pose, one, landmark).try_inverse()?))
        };
        Some(Self { pairs: pairs.iter().map(pair).collect::<Option<_>>()?, normal: Normal::zeros() })
    }
}

impl Problem for Fit {
    type State = Se2;
    type Step = Vector3<f64>;
    type Error = Infallible;

    fn cost(&mut self, pose: &Se2) -> Result<Option<f64>, Infallible> {
        let square = |(q, m, weight): &(Vector2<f64>, Vector2<f64>, Matrix2<f64>)| {
            let r = m - pose.act(*q);
            r.dot(&(weight * r))
        };
        Ok(Some(self.pairs.iter().map(square).sum()))
    }

    fn linearize(&mut self, pose: &Se2) -> Result<(), Infallible> {
        let r = pose.rotation.matrix();
        self.normal = Normal::zeros();
        for (q, m, weight) in &self.pairs {
            let j = r * Matrix2x3::new(1.0, 0.0, -q.y, 0.0, 1.0, q.x);
            self.normal.information += j.transpose() * weight * j;
            self.normal.gradient -= j.transpose() * weight * (m - pose.act(*q));
        }
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Vector3<f64>, f64)>, Infallible> {
        Ok(self.normal.step(damping))
    }

    fn moved(&self, pose: &Se2, step: &Vector3<f64>) -> Option<Se2> {
        Some(pose.plus(*step))
    }
}

/// Covariance of the distance of a pair.
pub(super) fn spread(pose: &Se2, seen: &Seen, landmark: &Landmark) -> Matrix2<f64> {
    let r = pose.rotation.matrix();
    r * seen.covariance * r.transpose() + landmark.covariance + Matrix2::identity() * VIEW_SIGMA.powi(2)
}

/// The best of every group of like answers, best first.
pub(super) fn distinct(mut all: Vec<Located>) -> Vec<Located> {
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut kept: Vec<Located> = Vec::new();
    for one in all {
        let known = kept.iter().any(|k| {
            let d = k.pose.between(&one.pose);
            Vector2::norm(&d.translation) < SAME.0 && d.theta().abs() < SAME.1
        });
        if !known {
            kept.push(one);
        }
    }
    kept
}

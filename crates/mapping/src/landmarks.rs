//! The landmark map: corners and reflectors that keyframes saw again and again, each with a consistent covariance.
//!
//! Both are treated alike, each for itself; a reflector has no orientation to tell it from its neighbour. Every corner of
//! every keyframe is brought into the map, in order of time, and joins the nearest cluster within
//! `GATE` that opens into the same direction (`TURN`), one corner a keyframe and cluster; else it begins a new one. A
//! scan that shows one corner twice thereby begins a twin. So in the end clusters within the same gate are joined,
//! the one of fewer sights to the other, if they are closer than a scan can distinguish (`ONE`), or if few keyframes
//! (`SHARED`) saw both. Of two sights by one keyframe the nearer counts.
//!
//! ```text
//! x_i = T_i c_i,   V_i = R_i C_i R_i^T,   W_i = (V_i + tau^2 I)^-1,   S = sum W_i
//! x   = S^-1 sum W_i x_i
//! P   = S^-1 + J_k Sigma_k J_k^T + FLOOR^2 I
//! ```
//!
//! - **Scatter.** The `x_i` differ by more than `C_i` says: each pose has an error of its own, and a corner looks
//!   different from elsewhere. `tau^2`, what that adds to each, comes from the sum of squared innovations under `V_i` alone,
//!   whose expectation is `2 n - 2 + tau^2 (tr S - tr S^-1 sum W_i^2)` (the moment estimate of DerSimonian and Laird,
//!   "Meta-analysis in clinical trials", 1986, in the plane). It is isotropic: for three sights more is not estimable.
//! - **Pose.** What the poses have in common does not average out. `Sigma_k` is the covariance of the best-known pose
//!   that saw the corner (the smallest trace of `J_k Sigma_k J_k^T`), relative to the first pose, perturbed on the right:
//!   `J_k = R_k [I | e_z x c_k]`.
//! - **Floor.** What all sights share for other reasons, the scanner's bias above all, is `FLOOR` at least.
//!
//! A landmark is kept when `LEAST_SEEN` keyframes detected it, and these are no less than a share `LEAST_SHARE` of those
//! that had it in view. In view: detected; or within `REACH`, no farther than the farthest that detected it (a thin post
//! is a corner from nearby only), and the scan shows a surface there or beyond. The corner of a parked pallet is thus
//! forgotten when later drives look through it.
//!
//! Assumes that errors of different keyframes are independent except for the common part. Errors that a slow drift of
//! the poses makes common to the sights of one pass only are averaged as if independent. It does not join what the
//! map holds doubled because a loop was not closed.

use crate::keyframe::Keyframe;
use groma_features::Keypoint;
use groma_features::reflector::Reflector;
use groma_geometry::{Se2, wrap};
use groma_models::{Cancelled, Landmark, LandmarkKind, LandmarkMap, Token};
use groma_registration::Visibility;
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_3;

/// A corner this close to a landmark may be it [m].
pub(crate) const GATE: f64 = 0.2;
/// Its orientation differs by less than this [rad].
const TURN: f64 = FRAC_PI_3;
/// Corners closer than this are one, even if a scan has both [m].
const ONE: f64 = 0.1;
/// Share of the observations of the rarer one up to which two corners in one scan are taken for a double detection.
const SHARED: f64 = 0.25;
/// A landmark was detected this often at least,
const LEAST_SEEN: usize = 3;
/// and in this share of the scans that had it in view.
const LEAST_SHARE: f64 = 0.2;
/// Corners are in view up to this range [m].
const REACH: f64 = 15.0;
/// Standard deviation that no number of sights averages out [m].
const FLOOR: f64 = 0.005;
/// Least standard deviation of a single sight: below it, its weight would be an illusion [m].
const LEAST_SIGMA: f64 = 0.001;

/// The landmarks of `keyframes` at `poses` (map from vehicle), whose `covariances` are relative to the first pose, perturbed
/// on the right; one of each a keyframe. First the corners, then the reflectors, each in order of first sight.
///
/// # Errors
/// When `token` is cancelled.
pub fn landmarks(
    keyframes: &[Keyframe],
    poses: &[Se2],
    covariances: &[Matrix3<f64>],
    token: &Token,
) -> Result<LandmarkMap, Cancelled> {
    let of = |kind| of_kind(kind, keyframes, poses, covariances, token);
    Ok(LandmarkMap { landmarks: [of(LandmarkKind::Corner)?, of(LandmarkKind::Reflector)?].concat() })
}

fn of_kind(
    kind: LandmarkKind,
    keyframes: &[Keyframe],
    poses: &[Se2],
    covariances: &[Matrix3<f64>],
    token: &Token,
) -> Result<Vec<Landmark>, Cancelled> {
    let mut clusters = Clusters::default();
    for (k, ((keyframe, pose), covariance)) in keyframes.iter().zip(poses).zip(covariances).enumerate() {
        token.check()?;
        let sights = marks(kind, keyframe).filter_map(|mark| Sight::new(k, &mark, pose, covariance)).collect();
        clusters.add(sights);
    }
    let merged = clusters.merge();
    token.check()?;
    let enough = merged.par_iter().filter(|c| c.sights.len() >= LEAST_SEEN);
    let found = enough.map(|c| token.check().map(|()| c.landmark(kind, keyframes, poses)));
    Ok(found.collect::<Result<Vec<_>, Cancelled>>()?.into_iter().flatten().collect())
}

/// A corner or reflector of one keyframe, in the vehicle frame.
struct Mark {
    point: Vector2<f64>,
    covariance: Matrix2<f64>,
    orientation: Option<f64>,
}

/// What a keyframe saw of a kind.
fn marks(kind: LandmarkKind, keyframe: &Keyframe) -> impl Iterator<Item = Mark> {
    let (corners, reflectors): (&[Keypoint], &[Reflector]) = match kind {
        LandmarkKind::Corner => (&keyframe.corners, &[]),
        LandmarkKind::Reflector => (&[], &keyframe.reflectors),
    };
    let corner = |c: &Keypoint| Mark { point: c.point, covariance: c.covariance, orientation: Some(c.orientation) };
    let reflector = |r: &Reflector| Mark { point: r.point, covariance: r.covariance, orientation: None };
    corners.iter().map(corner).chain(reflectors.iter().map(reflector))
}

/// A mark as one keyframe saw it, in the map frame.
struct Sight {
    keyframe: usize,
    point: Vector2<f64>,
    orientation: Option<f64>,
    /// Of the mark alone.
    covariance: Matrix2<f64>,
    /// What the pose adds.
    from_pose: Matrix2<f64>,
}

impl Sight {
    /// None if a number is not finite.
    fn new(keyframe: usize, mark: &Mark, pose: &Se2, pose_covariance: &Matrix3<f64>) -> Option<Self> {
        let r = pose.rotation.matrix();
        let c = mark.point;
        let jacobian = r * Matrix2x3::new(1.0, 0.0, -c.y, 0.0, 1.0, c.x);
        let sight = Self {
            keyframe,
            point: pose.act(c),
            orientation: mark.orientation.map(|angle| wrap(angle + pose.theta())),
            covariance: r * mark.covariance * r.transpose() + Matrix2::identity() * LEAST_SIGMA.powi(2),
            from_pose: jacobian * pose_covariance * jacobian.transpose(),
        };
        let sum = sight.point.sum() + sight.orientation.unwrap_or(0.0) + sight.covariance.sum() + sight.from_pose.sum();
        sum.is_finite().then_some(sight)
    }
}

/// Sights of one landmark.
#[derive(Default)]
struct Cluster {
    /// In order of time, one a keyframe.
    sights: Vec<Sight>,
    /// Mean of the points.
    center: Vector2<f64>,
    /// Sum of the unit vectors of the orientations.
    facing: Vector2<f64>,
}

impl Cluster {
    fn orientation(&self) -> Option<f64> {
        (self.facing != Vector2::zeros()).then(|| self.facing.y.atan2(self.facing.x))
    }

    fn push(&mut self, sight: Sight) {
        self.facing += sight.orientation.map_or_else(Vector2::zeros, |angle| Vector2::new(angle.cos(), angle.sin()));
        self.center += (sight.point - self.center) / (self.sights.len() + 1) as f64;
        self.sights.push(sight);
    }

    /// How many keyframes saw both.
    fn shared(&self, other: &Self) -> usize {
        let seen_by = |k: usize| self.sights.binary_search_by_key(&k, |s| s.keyframe).is_ok();
        other.sights.iter().filter(|s| seen_by(s.keyframe)).count()
    }

    /// The sights of both, of each keyframe the one nearer to the centre of `self`.
    fn joined(self, other: Self) -> Self {
        let mut sights: Vec<Sight> = self.sights.into_iter().chain(other.sights).collect();
        let distance = |s: &Sight| (s.point - self.center).norm_squared();
        sights.sort_by(|a, b| a.keyframe.cmp(&b.keyframe).then(distance(a).total_cmp(&distance(b))));
        sights.dedup_by_key(|s| s.keyframe);
        let mut joined = Self::default();
        sights.into_iter().for_each(|s| joined.push(s));
        joined
    }

    /// The landmark, if it was found often enough where it was in view.
    fn landmark(&self, kind: LandmarkKind, keyframes: &[Keyframe], poses: &[Se2]) -> Option<Landmark> {
        let (position, scatter) = self.fuse()?;
        let (seen, visible) = (self.sights.len(), self.visible(position, keyframes, poses));
        let from_pose = self.sights.iter().map(|s| s.from_pose).min_by(|a, b| a.trace().total_cmp(&b.trace()))?;
        (seen as f64 >= LEAST_SHARE * visible as f64).then(|| Landmark {
            kind,
            position,
            covariance: scatter + from_pose + Matrix2::identity() * FLOOR.powi(2),
            orientation: self.orientation(),
            descriptor: None,
            seen: seen as u32,
            visible: visible as u32,
        })
    }

    /// The weighted mean and its covariance, with the scatter that the sights show.
    fn fuse(&self) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let (mean, _) = self.mean(0.0)?;
        let (mut innovation_sq, mut trace, mut squares) = (0.0, 0.0, Matrix2::zeros());
        let mut total = Matrix2::zeros();
        for s in &self.sights {
            let w = s.covariance.try_inverse()?;
            let e = s.point - mean;
            innovation_sq += e.dot(&(w * e));
            trace += w.trace();
            squares += w * w;
            total += w;
        }
        let freedom = 2.0 * self.sights.len() as f64 - 2.0;
        let sensitivity = trace - (total.try_inverse()? * squares).trace();
        let excess = innovation_sq - freedom;
        self.mean(if excess > 0.0 && sensitivity > 0.0 { excess / sensitivity } else { 0.0 })
    }

    /// The weighted mean and its covariance when each sight has the variance `tau_sq` besides its own covariance.
    fn mean(&self, tau_sq: f64) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let (mut information, mut weighted) = (Matrix2::zeros(), Vector2::zeros());
        for s in &self.sights {
            let w = (s.covariance + Matrix2::identity() * tau_sq).try_inverse()?;
            information += w;
            // From the centre: coordinates far from the origin would cost digits.
            weighted += w * (s.point - self.center);
        }
        let covariance = information.try_inverse()?;
        Some((self.center + covariance * weighted, covariance))
    }

    /// Number of keyframes that had the landmark in view.
    fn visible(&self, position: Vector2<f64>, keyframes: &[Keyframe], poses: &[Se2]) -> usize {
        let mut detected = self.sights.iter().map(|s| s.keyframe).peekable();
        let distance_sq = |k: usize| (poses[k].translation - position).norm_squared();
        let reach_sq = self.sights.iter().map(|s| distance_sq(s.keyframe)).fold(0.0, f64::max).min(REACH * REACH);
        let in_view = |(k, (keyframe, pose)): (usize, (&Keyframe, &Se2))| {
            if detected.next_if_eq(&k).is_some() {
                return true;
            }
            (pose.translation - position).norm_squared() < reach_sq
                && matches!(
                    keyframe.tracked.view.visibility(pose.inverse().act(position)),
                    Visibility::Agrees | Visibility::SeenThrough
                )
        };
        keyframes.iter().zip(poses).enumerate().map(in_view).filter(|in_view| *in_view).count()
    }
}

/// Clusters, found by place.
#[derive(Default)]
struct Clusters {
    clusters: Vec<Cluster>,
    /// Clusters by the cell that holds their centre.
    cells: HashMap<(i64, i64), Vec<usize>>,
}

impl Clusters {
    /// Adds what one keyframe saw: the closest pair of sight and cluster first.
    fn add(&mut self, sights: Vec<Sight>) {
        let near = |(i, s): (usize, &Sight)| {
            self.near(s.point, s.orientation).into_iter().map(|(sq, c)| (sq, i, c)).collect::<Vec<_>>()
        };
        let mut pairs: Vec<(f64, usize, usize)> = sights.iter().enumerate().flat_map(near).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut cluster_of: Vec<Option<usize>> = vec![None; sights.len()];
        for (_, sight, cluster) in pairs {
            if cluster_of[sight].is_none() && !cluster_of.contains(&Some(cluster)) {
                cluster_of[sight] = Some(cluster);
            }
        }
        for (sight, cluster) in sights.into_iter().zip(cluster_of) {
            match cluster {
                Some(c) => self.change(c, |mut cluster| {
                    cluster.push(sight);
                    cluster
                }),
                None => {
                    let mut cluster = Cluster::default();
                    cluster.push(sight);
                    self.insert(cluster);
                }
            }
        }
    }

    /// Clusters that may be a mark at `point`, with their squared distances.
    fn near(&self, point: Vector2<f64>, orientation: Option<f64>) -> Vec<(f64, usize)> {
        let (column, row) = cell(point);
        let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (column.saturating_add(i), row.saturating_add(j))));
        let candidates = around.filter_map(|c| self.cells.get(&c)).flatten();
        candidates
            .filter(|&&c| face_alike(self.clusters[c].orientation(), orientation))
            .map(|&c| ((self.clusters[c].center - point).norm_squared(), c))
            .filter(|(sq, _)| *sq < GATE * GATE)
            .collect()
    }

    fn insert(&mut self, cluster: Cluster) {
        self.cells.entry(cell(cluster.center)).or_default().push(self.clusters.len());
        self.clusters.push(cluster);
    }

    /// Replaces cluster `c` by what `by` makes of it.
    fn change(&mut self, c: usize, by: impl FnOnce(Cluster) -> Cluster) {
        let before = cell(self.clusters[c].center);
        self.clusters[c] = by(std::mem::take(&mut self.clusters[c]));
        let after = cell(self.clusters[c].center);
        if before != after {
            self.cells.entry(before).or_default().retain(|other| *other != c);
            self.cells.entry(after).or_default().push(c);
        }
    }

    /// The clusters, twins joined, in order of first sight.
    fn merge(mut self) -> Vec<Cluster> {
        self.clusters.sort_by_key(|c| Reverse(c.sights.len()));
        let mut merged = Self::default();
        for cluster in self.clusters {
            match merged.twin(&cluster) {
                Some(twin) => merged.change(twin, |larger| larger.joined(cluster)),
                None => merged.insert(cluster),
            }
        }
        merged.clusters.sort_by_key(|c| c.sights.first().map(|s| s.keyframe));
        merged.clusters
    }

    /// The nearest cluster that is the same landmark as `cluster`.
    fn twin(&self, cluster: &Cluster) -> Option<usize> {
        let near = self.near(cluster.center, cluster.orientation()).into_iter();
        let rarer = |c: &Cluster| c.sights.len().min(cluster.sights.len()) as f64;
        let same = |sq: f64, c: &Cluster| sq < ONE * ONE || c.shared(cluster) as f64 <= SHARED * rarer(c);
        let twins = near.filter(|(sq, c)| same(*sq, &self.clusters[*c]));
        twins.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, c)| c)
    }
}

/// Whether two marks may be one by where they face.
pub(crate) fn face_alike(a: Option<f64>, b: Option<f64>) -> bool {
    a.zip(b).is_none_or(|(a, b)| wrap(a - b).abs() < TURN)
}

/// The cell of the hash that holds a point.
pub(crate) fn cell(p: Vector2<f64>) -> (i64, i64) {
    ((p.x / GATE).floor() as i64, (p.y / GATE).floor() as i64)
}

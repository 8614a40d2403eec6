//! A finished local map: the surfaces and corners of some metres of drive in the frame of its first keyframe.

use crate::keyframe::Keyframe;
use groma_features::glarot::{self, Signature};
use groma_geometry::Se2;
use groma_registration::{CorrelativeField, SurfaceMap, SurfaceScan};
use groma_tracking::Finished;
use nalgebra::{Matrix3, Vector2};
use std::ops::Range;
use std::sync::OnceLock;

/// Cell [m] and levels of the search field; the field covers surfaces up to this far from the path [m].
const FIELD: (f64, usize, f64) = (0.1, 5, 25.0);
/// Points that represent a map when it is matched to another.
const SAMPLE: usize = 500;
/// Views that are asked what they see of another map.
const VIEWS: usize = 12;
/// Corners of two scans within this distance are one [m].
const SAME_CORNER: f64 = 0.2;
/// A corner counts when this many scans saw it.
const LEAST_SEEN: f64 = 2.0;

/// Surfaces and corners of a stretch of drive.
pub struct LocalMap {
    /// Its keyframes; the first is the anchor.
    pub keyframes: Range<usize>,
    /// Pose of the anchor in the tracked frame.
    pub anchor: Se2,
    /// Surfaces in the anchor frame.
    pub surfaces: SurfaceMap,
    /// Some of the surface points: what is matched to other maps.
    pub sample: SurfaceScan,
    /// Positions of the vehicle in the anchor frame.
    pub path: Vec<Vector2<f64>>,
    /// Keyframes that represent what was seen, with their poses in the anchor frame.
    pub views: Vec<(usize, Se2)>,
    /// Corners in the anchor frame.
    pub corners: Vec<Vector2<f64>>,
    /// The unit vectors along which they open.
    pub facing: Vec<Vector2<f64>>,
    /// GLAROT signature of the corners.
    pub signature: Signature,
    field: OnceLock<CorrelativeField>,
}

impl LocalMap {
    /// From what the tracker finished.
    #[must_use]
    pub fn new(finished: Finished, keyframes: &[Keyframe]) -> Self {
        Self::assemble(finished.map.surfaces, finished.map.anchor, finished.keyframes, keyframes)
    }

    /// From a stretch of keyframes as the tracker placed them, in the frame of `anchor` (tracked frame).
    #[must_use]
    pub fn of_stretch(stretch: Range<usize>, anchor: Se2, keyframes: &[Keyframe]) -> Self {
        let mut surfaces = SurfaceMap::default();
        for keyframe in &keyframes[stretch.clone()] {
            surfaces.insert(&keyframe.tracked.view.scan, &anchor.between(&keyframe.tracked.pose));
        }
        Self::assemble(surfaces, anchor, stretch, keyframes)
    }

    fn assemble(surfaces: SurfaceMap, anchor: Se2, range: Range<usize>, keyframes: &[Keyframe]) -> Self {
        let pose = |k: usize| anchor.between(&keyframes[k].tracked.pose);
        let (corners, facing) = corners(range.clone(), keyframes, &pose);
        let step = range.len().div_ceil(VIEWS).max(1);
        Self {
            anchor,
            sample: surfaces.sample(SAMPLE),
            surfaces,
            path: range.clone().map(|k| pose(k).translation).collect(),
            views: range.clone().step_by(step).map(|k| (k, pose(k))).collect(),
            signature: Signature::from_points(&corners, &glarot::Options::default()),
            corners,
            facing,
            keyframes: range,
            field: OnceLock::new(),
        }
    }

    /// The search field, made when first requested.
    pub fn field(&self) -> &CorrelativeField {
        self.field.get_or_init(|| {
            let reach_sq = FIELD.2 * FIELD.2;
            let near = |p: &&Vector2<f64>| self.path.iter().step_by(4).any(|q| (*p - q).norm_squared() < reach_sq);
            let points: Vec<_> = self.surfaces.points().iter().filter(near).copied().collect();
            CorrelativeField::new(&points, FIELD.0, FIELD.1)
        })
    }

    /// Smallest distance between the paths of two maps, `other` placed at `t_self_other` [m].
    #[must_use]
    pub fn path_distance(&self, other: &Self, t_self_other: &Se2) -> f64 {
        let mut best = f64::INFINITY;
        for p in other.path.iter().step_by(2) {
            let p = t_self_other.act(*p);
            for q in self.path.iter().step_by(2) {
                best = best.min((p - q).norm_squared());
            }
        }
        best.sqrt()
    }
}

/// The measured step from the anchor of `a` to that of `b` and its covariance: the tracked poses, their step covariances
/// composed.
#[must_use]
pub fn step(a: &LocalMap, b: &LocalMap, keyframes: &[Keyframe]) -> (Se2, Matrix3<f64>) {
    let mut covariance = Matrix3::zeros();
    for k in a.keyframes.start + 1..=b.keyframes.start {
        let (before, here) = (&keyframes[k - 1].tracked, &keyframes[k].tracked);
        let ad = here.pose.between(&before.pose).adjoint();
        covariance = ad * covariance * ad.transpose() + here.step;
    }
    (a.anchor.between(&b.anchor), covariance)
}

/// Corners that at least `LEAST_SEEN` scans saw, averaged, and the directions into which they open.
fn corners(
    range: Range<usize>,
    keyframes: &[Keyframe],
    pose: &impl Fn(usize) -> Se2,
) -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>) {
    let mut found: Vec<Sum> = Vec::new();
    for k in range {
        let at = pose(k);
        for corner in &keyframes[k].corners {
            let point = at.act(corner.point);
            let (sin, cos) = corner.orientation.sin_cos();
            let facing = at.rotation.act(Vector2::new(cos, sin));
            match found.iter_mut().find(|s| (s.mean() - point).norm_squared() < SAME_CORNER * SAME_CORNER) {
                Some(sum) => sum.add(point, facing),
                None => found.push(Sum { points: point, facing, scans: 1.0 }),
            }
        }
    }
    let seen = found.iter().filter(|s| s.scans >= LEAST_SEEN);
    seen.map(|s| (s.mean(), s.facing.try_normalize(0.0).unwrap_or_else(Vector2::x))).unzip()
}

/// Sums over the sights of one corner.
struct Sum {
    points: Vector2<f64>,
    facing: Vector2<f64>,
    scans: f64,
}

impl Sum {
    fn mean(&self) -> Vector2<f64> {
        self.points / self.scans
    }

    fn add(&mut self, point: Vector2<f64>, facing: Vector2<f64>) {
        self.points += point;
        self.facing += facing;
        self.scans += 1.0;
    }
}

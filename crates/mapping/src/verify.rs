//! Do two local maps show the same place? Registration, and the surfaces of each in the views of the other.
//!
//! A candidate pose is refined by point-to-line registration of one map's surfaces to the other's. Then every surface
//! point of each is shown to the views of the other: it *agrees* when it lies on a surface they saw, it is *seen
//! through* when a beam went past it. Points that are hidden or out of view say nothing. At the right pose nearly all points in
//! common view agree, whatever moved people and doors did in between; at a wrong one walls stand in each other's rooms.
//!
//! ```text
//! overlap = agreeing / (agreeing + seen through),   the smaller of both directions
//! ```

use crate::keyframe::Keyframe;
use crate::local_map::LocalMap;
use groma_geometry::Se2;
use groma_registration::{SurfaceScan, Visibility, align};
use nalgebra::Matrix3;

/// Every so many-th point of a sample is shown to the views.
const ASKED: usize = 2;

/// What was found at one candidate pose.
#[derive(Clone, Debug)]
pub struct Check {
    /// Pose of the second map in the first.
    pub pose: Se2,
    /// Information of the registration, body frame.
    pub information: Matrix3<f64>,
    /// Share of the points in common view that agree, 0..1, the smaller of both directions.
    pub overlap: f64,
    /// Share of the second map's sample that lies on the first's surfaces.
    pub share: f64,
    /// Points in common view, the smaller of both directions, as a share of the sample.
    pub common: f64,
    /// Residual scale [m].
    pub scale: f64,
}

/// Refines a candidate pose of `b` in `a` and judges it.
#[must_use]
pub fn check(a: &LocalMap, b: &LocalMap, start: Se2, keyframes: &[Keyframe]) -> Check {
    let found = align(&b.sample, &a.surfaces, start, None);
    let (agree_b, through_b) = ask(a, keyframes, &b.sample, &found.pose);
    let (agree_a, through_a) = ask(b, keyframes, &a.sample, &found.pose.inverse());
    let ratio = |agree: usize, through: usize| agree as f64 / (agree + through).max(1) as f64;
    let asked = |of: &SurfaceScan| of.points.len().div_ceil(ASKED).max(1) as f64;
    let seen = |agree: usize, through: usize, of: &SurfaceScan| (agree + through) as f64 / asked(of);
    Check {
        overlap: ratio(agree_b, through_b).min(ratio(agree_a, through_a)),
        common: seen(agree_b, through_b, &b.sample).min(seen(agree_a, through_a, &a.sample)),
        share: found.share,
        scale: found.scale,
        pose: found.pose,
        information: found.information,
    }
}

/// How many points agree with, and how many are seen through by, the views of `map`.
fn ask(map: &LocalMap, keyframes: &[Keyframe], points: &SurfaceScan, t_map_points: &Se2) -> (usize, usize) {
    let to_views: Vec<(usize, Se2)> = map.views.iter().map(|(k, at)| (*k, at.between(t_map_points))).collect();
    let (mut agree, mut through) = (0, 0);
    for (p, n) in points.points.iter().zip(&points.normals).step_by(ASKED) {
        let mut seen_through = false;
        let mut agrees = false;
        for (k, t) in &to_views {
            let (at, normal) = (t.act(*p), t.rotation.act(*n));
            let view = &keyframes[*k].tracked.view;
            // A surface seen from behind is another side of the wall.
            if normal.dot(&(view.laser().translation - at)) <= 0.0 {
                continue;
            }
            match view.visibility(at) {
                Visibility::Agrees => {
                    agrees = true;
                    break;
                }
                Visibility::SeenThrough => seen_through = true,
                Visibility::Hidden | Visibility::NotInView => {}
            }
        }
        agree += usize::from(agrees);
        through += usize::from(seen_through && !agrees);
    }
    (agree, through)
}

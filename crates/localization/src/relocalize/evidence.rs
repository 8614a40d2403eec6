//! Evidence of the landmarks for a pose: a log-likelihood ratio against chance.
//!
//! A seen landmark comes from the map with probability e, else from anywhere, with the density c of seen landmarks:
//!
//! ```text
//! l = sum over seen of ln( (1 - e) + e N(r; 0, S) o / c ),   o = pi / orientation_max for a corner that opens alike
//! ```
//!
//! Landmarks of one wall, rack or pallet are right or wrong together, so that only a share of the sum counts as independent
//! (`INDEPENDENCE`). A map may know few of them: landmarks that are not on it say nothing at worst. The density is that of the view, but never below `LEAST_DENSITY`.

use super::refine::spread;
use super::{RelocalizeOptions, Seen};
use crate::map::StaticMap;
use groma_geometry::Se2;
use std::f64::consts::{PI, TAU};

/// Share of the log-likelihood ratio that counts.
const INDEPENDENCE: f64 = 0.5;
/// Least density of seen landmarks [1/m^2].
const LEAST_DENSITY: f64 = 0.03;

/// The evidence of landmarks for a pose and its pairs.
pub(super) fn landmarks(
    pose: &Se2,
    seen: &[Seen],
    pairs: &[(usize, usize)],
    map: &StaticMap,
    options: &RelocalizeOptions,
) -> f64 {
    let e = options.known_share;
    let unpaired = (seen.len() - pairs.len()) as f64 * (1.0 - e).ln();
    let c = density(seen);
    let paired = pairs.iter().map(|(s, k)| {
        let (one, landmark) = (&seen[*s], &map.landmarks()[*k]);
        let spread = spread(pose, one, landmark);
        let r = landmark.position - pose.act(one.point);
        let d_sq = spread.try_inverse().map_or(f64::INFINITY, |w| r.dot(&(w * r)));
        let peak = 1.0 / (TAU * spread.determinant().sqrt());
        let turned = one.orientation.is_some() && landmark.orientation.is_some();
        let o = if turned { PI / options.orientation_max } else { 1.0 };
        ((1.0 - e) + e * peak * (-0.5 * d_sq).exp() * o / c).ln()
    });
    INDEPENDENCE * (paired.sum::<f64>() + unpaired).max(0.0)
}

/// Density of seen landmarks over the box around them [1/m^2].
fn density(seen: &[Seen]) -> f64 {
    let Some(first) = seen.first() else { return LEAST_DENSITY };
    let (low, high) = seen.iter().fold((first.point, first.point), |(l, h), s| (l.inf(&s.point), h.sup(&s.point)));
    let size = (high - low).add_scalar(2.0);
    (seen.len() as f64 / (size.x * size.y)).max(LEAST_DENSITY)
}

//! The points around a keypoint as the keypoint sees them: polar, turned by its orientation.

use crate::Keypoint;
use groma_geometry::So2;
use nalgebra::Vector2;
use std::f64::consts::TAU;

/// A point around a keypoint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// Distance from the keypoint over the radius, in (0, 1].
    pub share: f64,
    /// Direction from the keypoint relative to its orientation, as a share of the full turn, in [0, 1).
    pub turn: f64,
}

/// The points within `radius` of a keypoint; points at the keypoint itself have no direction and are left out.
pub(crate) fn around<I>(points: I, keypoint: &Keypoint, radius: f64) -> impl Iterator<Item = Around>
where
    I: IntoIterator<Item = Vector2<f64>>,
{
    let (to_local, centre) = (So2::exp(keypoint.orientation).inverse(), keypoint.point);
    let near = points.into_iter().map(move |p| p - centre).filter(move |d| {
        let distance_sq = d.norm_squared();
        distance_sq > 0.0 && distance_sq <= radius * radius
    });
    near.map(move |d| {
        let local = to_local.act(d);
        Around { share: d.norm() / radius, turn: (local.y.atan2(local.x) / TAU).rem_euclid(1.0) }
    })
}

#[cfg(test)]
pub(crate) mod test_scene {
    use super::*;
    use groma_geometry::{Se2, wrap};
    use nalgebra::Matrix2;

    /// A keypoint where two walls meet, and the points on the walls.
    pub fn corner() -> (Keypoint, Vec<Vector2<f64>>) {
        let (point, orientation) = (Vector2::new(2.0, 1.0), 0.9);
        let keypoint = Keypoint { index: 0, point, orientation, radius: 0.4, covariance: Matrix2::identity() };
        let along = |angle: f64| (1..12).map(move |k| Vector2::new(angle.cos(), angle.sin()) * 0.037 * f64::from(k));
        (keypoint, along(0.11).chain(along(1.75)).map(|d| point + d).collect())
    }

    /// The same scene seen from elsewhere.
    pub fn moved(keypoint: &Keypoint, points: &[Vector2<f64>], motion: &Se2) -> (Keypoint, Vec<Vector2<f64>>) {
        let orientation = wrap(keypoint.orientation + motion.theta());
        let keypoint = Keypoint { point: motion.act(keypoint.point), orientation, ..*keypoint };
        (keypoint, points.iter().map(|&p| motion.act(p)).collect())
    }
}

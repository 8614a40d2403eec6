//! The points around a keypoint on a polar grid that turns with it: what [`crate::bsc`] and [`crate::cgh`] describe.
//!
//! ```text
//! v      = R(-theta) (p - k),   0 < |v| <= r
//! ring   = floor(8 |v| / r),  8 at |v| = r counts as 7      sector = floor(16 arg(v) / 2 pi)
//! ```
//!
//! for keypoint k with orientation theta. The points are turned before they are binned, so the cells turn with the scan
//! exactly, not by whole sectors. No angle is computed: quarter turns take v to u with u_x > 0, u_y >= 0, and the sector within
//! the quarter is the number of the slopes tan(pi/8), 1, tan(3 pi/8) that u_y / u_x reaches.

use crate::Keypoint;
use nalgebra::Vector2;
use std::f64::consts::SQRT_2;

pub(crate) const RINGS: usize = 8;
pub(crate) const SECTORS: usize = 16;

/// The 8 x 16 cells around a keypoint.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Surroundings {
    /// Which cells hold points, ring by ring from the least bit on.
    pub(crate) cells: u128,
    /// Points of every sector.
    pub(crate) sectors: [u16; SECTORS],
}

impl Surroundings {
    /// The points of a scan (without the keypoint's own) within `radius` [m] of the keypoint; a point at the keypoint itself
    /// has no direction and is left out.
    #[must_use]
    pub fn of(points: impl IntoIterator<Item = Vector2<f64>>, keypoint: &Keypoint, radius: f64) -> Self {
        let (sin, cos) = keypoint.orientation.sin_cos();
        let (radius_sq, per_metre) = (radius * radius, (RINGS as f64 / radius) as f32);
        let (mut rings, mut sectors) = ([0_u16; RINGS], [0_u16; SECTORS]);
        for point in points {
            let d = point - keypoint.point;
            let distance_sq = d.norm_squared();
            if distance_sq > 0.0 && distance_sq <= radius_sq {
                let ring = (((distance_sq as f32).sqrt() * per_metre) as i32 as usize).min(RINGS - 1);
                let sector = sector(cos * d.x + sin * d.y, cos * d.y - sin * d.x);
                rings[ring] |= 1 << sector;
                sectors[sector] = sectors[sector].saturating_add(1);
            }
        }
        let cells = rings.iter().rev().fold(0, |cells, &ring| cells << SECTORS | u128::from(ring));
        Self { cells, sectors }
    }
}

/// The sixteenth of the turn in which (x, y) lies, counted from the x axis.
#[inline]
fn sector(x: f64, y: f64) -> usize {
    let below = y < 0.0 || (y == 0.0 && x < 0.0);
    let (x, y) = if below { (-x, -y) } else { (x, y) };
    let behind = x <= 0.0;
    let (x, y) = if behind { (y, -x) } else { (x, y) };
    let within = usize::from(y >= (SQRT_2 - 1.0) * x) + usize::from(y >= x) + usize::from(y >= (SQRT_2 + 1.0) * x);
    8 * usize::from(below) + 4 * usize::from(behind) + within
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sectors_are_those_of_the_angle() {
        for k in 0..7200 {
            let angle = (f64::from(k) + 0.5) * TAU / 7200.0;
            let v = Vector2::new(angle.cos(), angle.sin()) * (0.01 + 1e-3 * f64::from(k));
            assert_eq!(sector(v.x, v.y), (angle / TAU * 16.0) as usize, "{angle}");
        }
        let axes =
            [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0), (0.0, -1.0), (1.0, -1.0)];
        assert_eq!(axes.map(|(x, y)| sector(x, y)), [0, 2, 4, 6, 8, 10, 12, 14]);
        assert_eq!([sector(1.0, -0.0), sector(-1.0, -0.0)], [0, 8]);
    }

    #[test]
    fn what_is_no_point_around_is_left_out() {
        let (keypoint, points) = test_scene::corner();
        let odd = [f64::NAN, f64::INFINITY].map(|x| Vector2::new(x, 0.0)).into_iter().chain([keypoint.point]);
        assert_eq!(Surroundings::of(odd, &keypoint, 0.4), Surroundings::default());
        assert_eq!(Surroundings::of(points, &keypoint, 0.4).sectors.iter().sum::<u16>(), 20);
    }
}

//! CGH, cumulative Gaussian histogram: in which directions the points around a keypoint lie.
//!
//! Each point adds 5 to its sector and 1 to either neighbour, around the circle; the histogram is scaled to a sum of one.
//!
//! ```text
//! h(s) = (n(s-1) + 5 n(s) + n(s+1)) / 7 N,   n(s) of the N points in sector s
//! distance = 1/2 sum (h - g)^2 / (h + g)   in [0, 1]
//! ```
//!
//! over the 16 sectors of [`Surroundings`], which turn with the keypoint. Source: Kallasi, Rizzini, Caselli, RA-L 2016; the
//! 1-5-1 kernel is that of the authors' library. An empty neighbourhood is at distance 1 from every other.

use crate::Surroundings;
use crate::surroundings::SECTORS;

/// Shares of the directions around a keypoint; all zero where there are no points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cgh {
    shares: [f32; SECTORS],
}

impl Cgh {
    /// The descriptor of a keypoint with these surroundings.
    #[must_use]
    pub fn of(around: &Surroundings) -> Self {
        let n = around.sectors.map(f32::from);
        let scale = (7.0 * n.iter().sum::<f32>()).max(1.0).recip();
        let share = |s: usize| scale * (n[(s + SECTORS - 1) % SECTORS] + 5.0 * n[s] + n[(s + 1) % SECTORS]);
        Self { shares: std::array::from_fn(share) }
    }

    /// Symmetric chi-square distance, 0 to 1.
    #[must_use]
    pub fn distance(&self, other: &Self) -> f32 {
        if self.is_empty() || other.is_empty() {
            return 1.0;
        }
        // An empty sector of both adds 0 / tiny.
        let term = |(h, g): (&f32, &f32)| (h - g) * (h - g) / (h + g).max(f32::MIN_POSITIVE);
        0.5 * self.shares.iter().zip(&other.shares).map(term).sum::<f32>()
    }

    /// The shares, sector by sector.
    #[must_use]
    pub fn shares(&self) -> &[f32; 16] {
        &self.shares
    }

    fn is_empty(&self) -> bool {
        self.shares.iter().all(|&s| s == 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surroundings::test_scene::{corner, moved};
    use groma_geometry::Se2;
    use nalgebra::Vector2;

    #[test]
    fn spreads_a_point_over_three_sectors() {
        let (keypoint, _) = corner();
        let angle = keypoint.orientation + 0.1;
        let point = keypoint.point + Vector2::new(angle.cos(), angle.sin()) * 0.1;
        let shares = Cgh::of(&Surroundings::of([point], &keypoint, 0.2)).shares;
        assert_eq!((shares[0], shares[1], shares[15]), (5.0 * 7_f32.recip(), 7_f32.recip(), 7_f32.recip()));
        assert_eq!(shares[2..15], [0.0; 13]);
    }

    #[test]
    fn turns_with_the_scan() {
        let (keypoint, points) = corner();
        let before = Cgh::of(&Surroundings::of(points.clone(), &keypoint, 0.4));
        for k in 0..50 {
            let motion = Se2::new(1.0, 0.1 * f64::from(k), 0.37 * f64::from(k));
            let (keypoint, points) = moved(&keypoint, &points, &motion);
            assert_eq!(Cgh::of(&Surroundings::of(points, &keypoint, 0.4)), before);
        }
    }

    #[test]
    fn distance_is_zero_to_one() {
        let (keypoint, points) = corner();
        let towards = |angle: f64| {
            let point = keypoint.point + Vector2::new(angle.cos(), angle.sin()) * 0.1;
            Cgh::of(&Surroundings::of([point], &keypoint, 0.2))
        };
        let all = Cgh::of(&Surroundings::of(points, &keypoint, 0.4));
        let empty = Cgh::of(&Surroundings::of([], &keypoint, 0.4));
        assert_eq!(all.distance(&all), 0.0);
        assert!((towards(0.0).distance(&towards(3.0)) - 1.0).abs() < 1e-6);
        assert_eq!((empty.distance(&all), empty.distance(&empty)), (1.0, 1.0));
    }
}

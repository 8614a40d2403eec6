//! GLARE: the signature of GLAROT, compared without a turn.
//!
//! ```text
//! d(G, F) = 1/2 sum over b, r of | G(b, r) - F(b, r) |,   0 to 1
//! ```
//!
//! For maps whose headings are known, from a compass or a good odometry say: it distinguishes places that are equal but for
//! a turn, and costs one shift instead of `n_theta`. Histogram and kernel are those of [`Signature`].
//!
//! Source: M. Himstedt et al., "Large scale place recognition in 2D LIDAR scans using geometrical landmark relations",
//! IROS 2014; here with a kernel that is circular in the direction.

use super::Signature;
use super::signature::share;

impl Signature {
    /// Distance to another signature without turning either, 0 to 1; at least [`Signature::distance`].
    ///
    /// Signatures made with other bins, or empty ones, are at distance 1.
    #[must_use]
    pub fn distance_unturned(&self, other: &Self) -> f64 {
        if self.is_comparable(other) { share(self.at_shift(other, 0)) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::glarot::Options;
    use nalgebra::{Rotation2, Vector2};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn does_not_turn(set in prop::collection::vec((-9.0..9.0_f64, -9.0..9.0_f64), 3..20), x in -50.0..50.0_f64) {
            let points: Vec<_> = set.iter().map(|&(x, y)| Vector2::new(x, y)).collect();
            let of = |turn: f64, x: f64| {
                let moved: Vec<_> = points.iter().map(|p| Rotation2::new(turn) * p + Vector2::new(x, -x)).collect();
                Signature::from_points(&moved, &Options::default())
            };
            let (here, turned) = (of(0.0, 0.0), of(0.8, 0.0));
            prop_assert_eq!(here.distance_unturned(&here), 0.0);
            prop_assert!(here.distance_unturned(&of(0.0, x)) < 0.02); // pairs on the border of two kernel steps may change
            prop_assert_eq!(here.distance_unturned(&turned), turned.distance_unturned(&here));
            prop_assert!(here.distance_unturned(&turned) >= here.difference(&turned).distance);
        }
    }

    #[test]
    fn tells_a_turn_that_glarot_does_not() {
        let corridor: Vec<_> = (0..8).map(|k| Vector2::new(f64::from(k), 0.0)).collect();
        let across: Vec<_> = corridor.iter().map(|p| Vector2::new(p.y, p.x)).collect();
        let of = |points: &[Vector2<f64>]| Signature::from_points(points, &Options::default());
        let (along, across, nothing) = (of(&corridor), of(&across), of(&[]));
        assert!(along.difference(&across).distance < 0.02 && along.distance_unturned(&across) > 0.95);
        assert_eq!((along.distance_unturned(&nothing), nothing.distance_unturned(&nothing)), (1.0, 1.0));
    }
}

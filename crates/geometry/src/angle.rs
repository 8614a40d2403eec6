//! Angles on the circle.

use std::f64::consts::{PI, TAU};

/// The angle in `(-pi, pi]` that equals `a` up to whole turns.
///
/// ```
/// use groma_geometry::wrap;
/// assert!((wrap(7.0) - (7.0 - std::f64::consts::TAU)).abs() < 1e-15);
/// assert_eq!(wrap(0.5), 0.5);
/// ```
#[must_use]
pub fn wrap(a: f64) -> f64 {
    if a > -PI && a <= PI {
        return a;
    }
    let r = (a + PI).rem_euclid(TAU) - PI;
    if r <= -PI { PI } else { r }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_in_the_half_open_turn() {
        for k in -1000..1000 {
            let a = f64::from(k) * 0.1;
            let w = wrap(a);
            assert!(w > -PI && w <= PI);
            assert!(((a - w) / TAU - ((a - w) / TAU).round()).abs() < 1e-12);
        }
        assert_eq!(wrap(-PI), PI);
    }
}

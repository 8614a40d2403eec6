//! Roots of functions of one variable, always inside a bracket.
//!
//! ```text
//! bisect   halves the bracket; needs only whether the root is beyond a place
//! newton   x <- x - f/f', and the middle of the bracket where that leaves it; every value shrinks the bracket
//! ```
//!
//! Assume one change of sign in the bracket. Source: Press et al., "Numerical Recipes", sections 9.1 and 9.4.

/// Newton's steps, at most: far more than halvings alone would need.
const MOST_STEPS: usize = 200;

/// The bracket after so many halvings, or when no number is left between its ends; `is_before` says whether the root is beyond
/// a place.
///
/// # Errors
/// Those of `is_before`.
pub fn bisect<E>(
    (mut low, mut high): (f64, f64),
    halvings: usize,
    mut is_before: impl FnMut(f64) -> Result<bool, E>,
) -> Result<(f64, f64), E> {
    for _ in 0..halvings {
        let middle = f64::midpoint(low, high);
        if middle <= low || middle >= high {
            break;
        }
        if is_before(middle)? { low = middle } else { high = middle }
    }
    Ok((low, high))
}

/// The root of a rising function, given with its slope, from `start`; the upper end of the bracket may be infinite. It ends at a
/// step no longer than `tolerance` of the place.
pub fn newton(
    (mut low, mut high): (f64, f64),
    start: f64,
    value_and_slope: impl Fn(f64) -> (f64, f64),
    tolerance: impl Fn(f64) -> f64,
) -> f64 {
    let mut x = start;
    for _ in 0..MOST_STEPS {
        let (value, slope) = value_and_slope(x);
        match value {
            0.0 => return x,
            v if v > 0.0 => high = x,
            _ => low = x,
        }
        let (newton, middle) = (x - value / slope, if high.is_finite() { f64::midpoint(low, high) } else { 2.0 * x });
        let next = if newton > low && newton < high { newton } else { middle };
        if (next - x).abs() <= tolerance(x) {
            return next;
        }
        x = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    #[test]
    fn halvings_end_at_neighbouring_numbers_around_the_root() {
        let mut places = 0;
        let Ok((low, high)) = bisect((0.0, 4.0), 1000, |x| {
            places += 1;
            Ok::<_, Infallible>(x * x < 2.0)
        });
        assert!(low * low < 2.0 && high * high >= 2.0 && high == low.next_up() && places < 60);
        assert_eq!(bisect((0.0, 1.0), 9, |_| Err("stop")), Err("stop"));
    }

    #[test]
    fn newton_finds_roots_where_its_own_steps_would_leave() {
        let relative = |x: f64| 1e-15 * x.abs();
        let cube = |x: f64| (x * x * x - 27.0, 3.0 * x * x);
        assert!((newton((0.0, f64::INFINITY), 1e-3, cube, relative) - 3.0).abs() < 1e-14);
        // The slope of the arc tangent falls so fast that plain steps from 3 diverge.
        let bent = |x: f64| (x.atan() - 0.1, 1.0 / (1.0 + x * x));
        assert!((newton((-4.0, 4.0), 3.0, bent, relative) - 0.1_f64.tan()).abs() < 1e-15);
        assert_eq!(newton((0.0, 9.0), 2.0, |x| (x - 2.0, 1.0), relative), 2.0);
    }
}

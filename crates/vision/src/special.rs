//! The error function, to 1.5e-7: an edge blurred by a Gaussian.
//!
//! Source: Abramowitz, Stegun, "Handbook of Mathematical Functions", 7.1.26.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

const A: [f64; 5] = [0.254_829_592, -0.284_496_736, 1.421_413_741, -1.453_152_027, 1.061_405_429];
const P: f64 = 0.327_591_1;

/// An edge from -1 to 1 of unit spread, `erf(t / sqrt 2)`, and its slope.
pub(crate) fn edge(t: f64) -> (f64, f64) {
    let bell = (-0.5 * t * t).exp();
    let u = 1.0 / (1.0 + P * t.abs() * FRAC_1_SQRT_2);
    let tail = u * (A[0] + u * (A[1] + u * (A[2] + u * (A[3] + u * A[4])))) * bell;
    ((1.0 - tail).copysign(t), bell * (2.0 / PI).sqrt())
}

#[cfg(test)]
mod tests {
    use super::edge;

    #[test]
    fn is_the_integral_of_its_slope() {
        let (mut area, h) = (0.0, 1e-3);
        for k in 0..5000 {
            let t = f64::from(k) * h;
            area += h * edge(t + 0.5 * h).1;
            assert!((edge(t + h).0 - area).abs() < 4e-7);
        }
        assert_eq!(edge(-1.3).0, -edge(1.3).0);
    }
}

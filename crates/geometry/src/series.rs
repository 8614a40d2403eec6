//! Tails of the series of sine and cosine, which the Jacobians of the groups are made of.
//!
//! ```text
//! c_n(t) = sum_k (-1)^k t^(2k) / (2k + n)!
//! c_0 = cos t,  c_1 = sin t / t,  c_2 = (1 - cos t)/t^2,  c_3 = (t - sin t)/t^3,  ...
//! c_(n+2) = (1/n! - c_n)/t^2
//! ```
//!
//! By the sum up to t = 1, where the recursion would cancel; by the recursion beyond.

/// Terms until `1/(2k)!` is below the rounding of 1.
const TERMS: u32 = 10;

/// `c_n(t)` for n up to 5.
pub(crate) fn tail(n: u32, t: f64) -> f64 {
    if t.abs() > 1.0 {
        return match n {
            0 => t.cos(),
            1 => t.sin() / t,
            _ => (reciprocal_factorial(n - 2) - tail(n - 2, t)) / (t * t),
        };
    }
    // Horner: c_n = 1/n! (1 - t^2/((n+1)(n+2)) (1 - ...)).
    let nested = (0..TERMS).rev().fold(1.0, |sum, k| {
        let m = f64::from(2 * k + n);
        1.0 - t * t / ((m + 1.0) * (m + 2.0)) * sum
    });
    nested * reciprocal_factorial(n)
}

fn reciprocal_factorial(n: u32) -> f64 {
    1.0 / (1..=n).map(f64::from).product::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sum_and_recursion_meet() {
        for n in 0..=5 {
            let (below, above) = (tail(n, 1.0), tail(n, 1.0 + 1e-15));
            assert!((below - above).abs() < 1e-14, "c_{n}: {below} {above}");
            assert!((tail(n, 0.0) - reciprocal_factorial(n)).abs() < 1e-16);
        }
        assert!((tail(2, 0.5) - (1.0 - 0.5f64.cos()) / 0.25).abs() < 1e-15);
        assert!((tail(3, 0.5) - (0.5 - 0.5f64.sin()) / 0.125).abs() < 1e-15);
    }
}

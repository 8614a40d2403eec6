//! The chi-square distribution: for gates and for tests of consistency.
//!
//! ```text
//! P(x; k) = gamma(k/2, x/2) / Gamma(k/2)        k degrees of freedom
//! ```
//!
//! The distribution is that of statrs. Its quantile fails in the lower tail (statrs 0.19 gives 9e-10 for p = 1e-9 and one
//! degree of freedom, where 1.6e-18 is right), so it is found here: [`root::newton`] from the approximation of Wilson and Hilferty.
//! Source: Abramowitz, Stegun 26.4.17.

use crate::root;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF};
use statrs::function::gamma::ln_gamma;

/// Probability that a chi-square variable with `dof` degrees of freedom is at most `x`.
#[must_use]
pub fn probability(x: f64, dof: usize) -> f64 {
    let of_none = if x >= 0.0 { 1.0 } else { 0.0 };
    ChiSquared::new(dof as f64).map_or(of_none, |d| d.cdf(x.max(0.0)))
}

/// Probability that a chi-square variable with `dof` degrees of freedom exceeds `x`; small ones keep their digits.
#[must_use]
pub fn beyond(x: f64, dof: usize) -> f64 {
    let of_none = if x >= 0.0 { 0.0 } else { 1.0 };
    ChiSquared::new(dof as f64).map_or(of_none, |d| d.sf(x.max(0.0)))
}

/// The x that a chi-square variable with `dof` degrees of freedom exceeds with probability `1 - p`; 0 for `p <= 0` or no
/// degree of freedom, infinite for `p >= 1`.
#[must_use]
pub fn quantile(p: f64, dof: usize) -> f64 {
    if p >= 1.0 {
        return f64::INFINITY;
    }
    let known = ChiSquared::new(dof as f64).ok().filter(|_| p > 0.0);
    let Some(distribution) = known else { return if p.is_nan() { p } else { 0.0 } };
    let excess = |x: f64| (distribution.cdf(x) - p, distribution.pdf(x));
    root::newton((0.0, f64::INFINITY), wilson_hilferty(p, dof as f64), excess, |x| 1e-14 * x)
}

/// Whether a squared Mahalanobis distance is as small as that of a share `p` of all true ones.
#[must_use]
pub fn passes_gate(distance_sq: f64, dof: usize, p: f64) -> bool {
    distance_sq <= quantile(p, dof)
}

/// A start that is right to a few percent, above zero.
fn wilson_hilferty(p: f64, dof: f64) -> f64 {
    let t = (-2.0 * p.min(1.0 - p).ln()).sqrt();
    let tail = t - (2.30753 + 0.27061 * t) / (1.0 + 0.99229 * t + 0.04481 * t * t);
    let normal = if p < 0.5 { -tail } else { tail };
    let spread = 2.0 / (9.0 * dof);
    let x = dof * (1.0 - spread + normal * spread.sqrt()).powi(3);
    if x > 1e-3 * dof { x } else { 2.0 * ((p * dof / 2.0).ln() * 2.0 / dof + ln_gamma(dof / 2.0) * 2.0 / dof).exp() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the NIST/SEMATECH e-Handbook, 1.3.6.7.4, with more digits than it prints.
    #[test]
    fn quantiles_equal_the_tables() {
        for (p, dof, x) in [
            (0.95, 1, 3.841_458_820_694_124),
            (0.95, 2, 5.991_464_547_107_979),
            (0.95, 3, 7.814_727_903_251_178),
            (0.99, 2, 9.210_340_371_976_18),
            (0.99, 3, 11.344_866_730_144_37),
            (0.999, 3, 16.266_236_196_238_13),
            (0.05, 10, 3.940_299_136_076_393),
            (0.95, 10, 18.307_038_053_275_14),
            (0.95, 100, 124.342_113_404_004),
            (0.05, 100, 77.929_465_165_017_8),
        ] {
            assert!((quantile(p, dof) - x).abs() < 1e-9 * x, "p {p}, dof {dof}: {}", quantile(p, dof));
        }
    }

    /// Near zero the distribution of one degree of freedom is sqrt(2 x / pi). Once this fails, `quantile` can go.
    #[test]
    fn the_quantile_of_statrs_is_wrong_in_the_lower_tail_and_ours_is_right() {
        let x = std::f64::consts::PI / 2.0 * 1e-18;
        assert!((quantile(1e-9, 1) - x).abs() < 1e-6 * x);
        assert!(ChiSquared::new(1.0).unwrap().inverse_cdf(1e-9) > 1e6 * x);
    }

    #[test]
    fn two_degrees_of_freedom_are_exponential() {
        for k in 1..200 {
            let x = f64::from(k) * 0.2;
            assert!((probability(x, 2) - (1.0 - (-x / 2.0).exp())).abs() < 1e-14);
        }
    }

    #[test]
    fn quantile_and_probability_undo_each_other() {
        for dof in [1, 2, 3, 5, 30, 1000, 100_000] {
            for p in [1e-9, 1e-3, 0.3, 0.5, 0.9, 0.9999, 1.0 - 1e-12] {
                let x = quantile(p, dof);
                assert!((probability(x, dof) - p).abs() < 1e-11, "p {p}, dof {dof}, x {x}");
            }
        }
    }

    #[test]
    fn ends_of_the_range() {
        assert!(quantile(0.0, 3) == 0.0 && quantile(0.5, 0) == 0.0);
        assert!(quantile(1.0, 3) == f64::INFINITY && quantile(f64::NAN, 3).is_nan());
        assert!(probability(-1.0, 3) == 0.0 && probability(0.0, 0) == 1.0);
        assert!(passes_gate(7.8, 3, 0.95) && !passes_gate(7.9, 3, 0.95) && !passes_gate(f64::NAN, 3, 0.95));
    }
}

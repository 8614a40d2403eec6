//! When to stop driving: half-widths of intervals against tolerances.
//!
//! ```text
//! half-width = t_(1 - alpha/2, dof) sqrt(C_ii)
//! ```
//!
//! with Student's quantile where the scale of the noise is estimated, the normal one where it is known. A claim about
//! all p parameters at once takes `alpha/p` (Bonferroni).

use super::calibrate::Calibration;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// A parameter with a smaller share than this of the largest part of a weak direction has no part in it.
const PART: f64 = 0.05;

impl Calibration {
    /// Whether each free parameter is held: has no part in a weak direction.
    #[must_use]
    pub fn observed(&self) -> Vec<bool> {
        let part = |k: usize| self.weak.iter().all(|w| w.direction[k].abs() <= PART * w.direction.amax());
        (0..self.layout.len()).map(part).collect()
    }

    /// Half-widths of intervals of the free parameters, each by itself; infinite for what is not determined.
    #[must_use]
    pub fn half_widths(&self, confidence: f64) -> Vec<f64> {
        let factor = factor(confidence, self.interval_dof, 1);
        let width =
            |(k, held): (usize, bool)| if held { factor * self.covariance[(k, k)].sqrt() } else { f64::INFINITY };
        self.observed().into_iter().enumerate().map(width).collect()
    }
}

/// The factor on a standard deviation: a quantile of Student's distribution, of the normal one without `dof`.
#[must_use]
pub fn factor(confidence: f64, dof: Option<usize>, claims: usize) -> f64 {
    let p = 1.0 - (1.0 - confidence) / (2.0 * claims.max(1) as f64);
    match dof {
        Some(0) => f64::INFINITY,
        Some(dof) => StudentsT::new(0.0, 1.0, dof as f64).map_or(f64::NAN, |d| d.inverse_cdf(p)),
        None => Normal::standard().inverse_cdf(p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_equal_the_tables() {
        for (confidence, dof, claims, expected) in [
            (0.95, Some(10), 1, 2.228_138_851_964_938),
            (0.95, Some(43), 1, 2.016_692_199_227_82),
            (0.95, None, 1, 1.959_963_984_540_054),
            (0.95, Some(10), 5, 3.169_272_672_616_87),
            (0.99, Some(1), 1, 63.656_741_162_871_6),
        ] {
            let got = factor(confidence, dof, claims);
            assert!((got - expected).abs() < 1e-6 * expected, "{confidence} {dof:?} {claims}: {got}");
        }
        assert!(factor(0.95, Some(0), 1).is_infinite());
    }
}

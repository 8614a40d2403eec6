//! Robust losses: how much a squared, whitened residual `s = r^T Omega r` counts.
//!
//! The cost is `sum rho(s)` and the weight of a residual in a reweighted step is `rho'(s)`; all have `rho(s) ~ s` and
//! weight 1 at zero. With `k` the scale in standard deviations:
//!
//! ```text
//! Huber           s (s <= k^2),  2 k sqrt(s) - k^2                 weight  1, k/sqrt(s)
//! Cauchy          k^2 ln(1 + s/k^2)                                weight  1/(1 + s/k^2)
//! Tukey           k^2/3 (1 - (1 - s/k^2)^3) (s <= k^2), k^2/3      weight  (1 - s/k^2)^2, 0
//! Geman-McClure   s/(1 + s/k^2)                                    weight  1/(1 + s/k^2)^2
//! ```
//!
//! Only Huber's is convex; the others need a start near the solution. Source: Zhang, "Parameter estimation techniques",
//! INRIA RR-2676 (1995), table 1.

/// A loss with its scale k, above 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Least squares.
    Squared,
    /// Linear beyond k.
    Huber(f64),
    /// Logarithmic.
    Cauchy(f64),
    /// Constant beyond k.
    Tukey(f64),
    /// Saturates at k^2.
    GemanMcClure(f64),
}

impl Loss {
    /// `rho(s)` of a squared residual.
    #[must_use]
    pub fn rho(self, s: f64) -> f64 {
        match self {
            Self::Squared => s,
            Self::Huber(k) if s <= k * k => s,
            Self::Huber(k) => 2.0 * k * s.sqrt() - k * k,
            Self::Cauchy(k) => k * k * (s / (k * k)).ln_1p(),
            Self::Tukey(k) => k * k / 3.0 * (1.0 - inside(s, k).powi(3)),
            Self::GemanMcClure(k) => s / (1.0 + s / (k * k)),
        }
    }

    /// `rho'(s)`, in `[0, 1]`.
    #[must_use]
    pub fn weight(self, s: f64) -> f64 {
        match self {
            Self::Squared => 1.0,
            Self::Huber(k) if s <= k * k => 1.0,
            Self::Huber(k) => k / s.sqrt(),
            Self::Cauchy(k) => 1.0 / (1.0 + s / (k * k)),
            Self::Tukey(k) => inside(s, k).powi(2),
            Self::GemanMcClure(k) => (1.0 + s / (k * k)).powi(-2),
        }
    }
}

/// `1 - s/k^2`, zero beyond k.
fn inside(s: f64, k: f64) -> f64 {
    (1.0 - s / (k * k)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Loss; 5] =
        [Loss::Squared, Loss::Huber(1.345), Loss::Cauchy(2.385), Loss::Tukey(4.685), Loss::GemanMcClure(1.5)];

    #[test]
    fn weight_is_the_derivative() {
        let h = 1e-6;
        for loss in ALL {
            for s in (1..400).map(|k| f64::from(k) * 0.1 + 0.0123) {
                let slope = (loss.rho(s + h) - loss.rho(s - h)) / (2.0 * h);
                assert!((slope - loss.weight(s)).abs() < 1e-7, "{loss:?} at {s}");
            }
        }
    }

    #[test]
    fn starts_as_least_squares_and_never_gains_weight() {
        for loss in ALL {
            assert!(loss.rho(0.0) == 0.0 && loss.weight(0.0) == 1.0);
            let weights: Vec<_> = (0..1000).map(|k| loss.weight(f64::from(k) * 0.1)).collect();
            assert!(weights.windows(2).all(|w| w[1] <= w[0] && w[1] >= 0.0));
        }
        assert_eq!(Loss::Tukey(2.0).weight(4.1), 0.0);
    }
}

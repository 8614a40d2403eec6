//! The gates of the joint test: chi2(2 k, p) for k pairings, computed once.

use groma_estimation::chi_square;

/// Pairings up to which a gate is kept.
const KEPT: usize = 64;

/// Gates of one probability.
#[derive(Clone, Debug)]
pub(crate) struct Gates {
    p: f64,
    kept: Vec<f64>,
}

impl Gates {
    /// Gates that a share `p` of true hypotheses passes.
    pub fn new(p: f64) -> Self {
        Self { p, kept: (0..=KEPT).map(|pairs| chi_square::quantile(p, 2 * pairs)).collect() }
    }

    /// The largest squared distance of so many pairings together.
    pub fn of(&self, pairs: usize) -> f64 {
        self.kept.get(pairs).copied().unwrap_or_else(|| chi_square::quantile(self.p, 2 * pairs))
    }
}

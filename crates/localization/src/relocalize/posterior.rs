//! The probability of each place, given that there are others.
//!
//! Beforehand the vehicle may be anywhere on the area A and turned anyhow, or, with probability `ELSEWHERE`, at a place that
//! the map does not show. A peak of the likelihood with covariance C, in the frame of the vehicle, takes the share
//!
//! ```text
//! w_k = (1 - ELSEWHERE) exp(l_k) (2 pi)^(3/2) |C_k|^(1/2) / (2 pi A),     w_0 = ELSEWHERE
//! p_k = w_k / (w_0 + sum w)
//! ```
//!
//! of the whole: the more precisely a pose must be met, the less likely it is met by chance.

use super::Located;
use std::f64::consts::TAU;

/// Probability that the place is not on the map.
const ELSEWHERE: f64 = 0.01;

/// Sets the probabilities; most probable first.
pub(super) fn normalize(mut all: Vec<Located>, area: f64) -> Vec<Located> {
    let weights: Vec<f64> = all.iter().map(|l| log_weight(l, area)).collect();
    let most = weights.iter().copied().fold(ELSEWHERE.ln(), f64::max);
    let total: f64 = weights.iter().map(|w| (w - most).exp()).sum::<f64>() + (ELSEWHERE.ln() - most).exp();
    for (one, weight) in all.iter_mut().zip(weights) {
        one.probability = (weight - most).exp() / total;
    }
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

fn log_weight(one: &Located, area: f64) -> f64 {
    let volume = TAU.powf(1.5) * one.covariance.determinant().max(0.0).sqrt();
    (1.0 - ELSEWHERE).ln() + one.evidence + (volume / (TAU * area)).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;
    use nalgebra::Matrix3;

    fn at(evidence: f64) -> Located {
        let covariance = Matrix3::from_diagonal(&nalgebra::Vector3::new(4e-4, 4e-4, 1e-5));
        Located { pose: Se2::IDENTITY, covariance, pairs: Vec::new(), evidence, probability: 0.0 }
    }

    #[test]
    fn two_places_alike_share_the_probability() {
        let found = normalize(vec![at(40.0), at(40.0), at(10.0)], 1000.0);
        assert!((found[0].probability - 0.5).abs() < 1e-6 && found[2].probability < 1e-9);
    }

    #[test]
    fn little_evidence_is_no_certainty() {
        assert!(normalize(vec![at(8.0)], 1000.0)[0].probability < 0.5);
        assert!(normalize(vec![at(40.0)], 1000.0)[0].probability > 0.999);
        assert!(normalize(Vec::new(), 1000.0).is_empty());
    }
}

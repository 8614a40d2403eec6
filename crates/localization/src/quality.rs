//! Quality of a pose: a number to stop the vehicle by.
//!
//! **Lost or not** is a sequential test of likelihood ratios (Wald 1945; restarted at zero, so that it is Page's test).
//! Every observation that could be a landmark is matched or not. On the right track a share p of them is matched, which
//! is learned while all is well; lost, a share c, by chance, in the gates that happen to hold a landmark:
//!
//! ```text
//! e <- max(0, e + ln(c / p))                    matched
//! e <- max(0, e + ln((1 - c) / (1 - p)))        not matched
//! lost when e > ln(evidence)
//! ```
//!
//! **Geometry**: the standard deviation along the weakest direction from this scan alone,
//! `1 / sqrt(least eigenvalue of D^-1 (sum H^T R^-1 H) D^-1)`, where `D = diag(1, 1, d)` measures the heading at the mean
//! distance d of the landmarks seen. Infinite where fewer than two landmarks constrain the pose.

use crate::options::LostOptions;
use nalgebra::Matrix3;

/// Share of observations that are matched on the right track: what is assumed at first, and its bounds.
const RIGHT: (f64, f64, f64) = (0.6, 0.25, 0.98);
/// Share that is matched by chance when lost.
const CHANCE: f64 = 0.08;
/// Weight of one observation in the learned share.
const LEARNING: f64 = 0.002;
/// A scan adds no more evidence than this many observations: those of one scan share their reasons.
const PER_SCAN: f64 = 6.0;

/// What to make of the pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Status {
    /// It was never known, or evidence says that it is wrong.
    #[default]
    Lost,
    /// Nothing contradicts it, but neither landmarks nor walls constrain it at present.
    Coasting,
    /// Landmarks or walls constrain it.
    Tracking,
}

/// Quality of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// What to make of it.
    pub status: Status,
    /// Observations of the last scan that could be used.
    pub observed: usize,
    /// Those that were paired with a landmark that updates the pose.
    pub matched: usize,
    /// Share of observations matched in the last some hundred.
    pub matched_share: f64,
    /// Sum of squared innovations of the last scan, each measured by its covariance given those before.
    pub nis: f64,
    /// Its degrees of freedom.
    pub dof: usize,
    /// Standard deviation of the position along its weakest direction [m].
    pub sigma_position: f64,
    /// Standard deviation of the heading [rad].
    pub sigma_heading: f64,
    /// Standard deviation along the weakest direction from the last scan alone [m].
    pub geometry: f64,
    /// Logarithm of the likelihood ratio of being lost against being right.
    pub lost_evidence: f64,
}

/// Watches matches go by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Monitor {
    right: f64,
    evidence: f64,
    limit: f64,
    /// Since the evidence reached the limit, until nothing of it is left: what hovers about the limit is not known now and then.
    lost: bool,
}

impl Monitor {
    pub fn new(options: &LostOptions) -> Self {
        Self { right: RIGHT.0, evidence: 0.0, limit: options.evidence.ln(), lost: false }
    }

    /// Takes in a scan of which `matched` of `observed` were matched.
    pub fn see(&mut self, matched: usize, observed: usize) {
        let (m, n) = (matched as f64, observed as f64);
        let p = self.right.clamp(RIGHT.1, RIGHT.2);
        let step = m * (CHANCE / p).ln() + (n - m) * ((1.0 - CHANCE) / (1.0 - p)).ln();
        let weight = (PER_SCAN / n.max(1.0)).min(1.0);
        self.add(weight * step);
        if self.evidence < 0.5 * self.limit {
            let learned = 1.0 - (1.0 - LEARNING).powf(n);
            self.right += learned * (m / n.max(1.0) - self.right);
        }
    }

    /// Takes in the logarithm of a likelihood ratio of being right against being lost.
    pub fn hear(&mut self, log_ratio: f64) {
        self.add(-log_ratio);
    }

    fn add(&mut self, evidence: f64) {
        self.evidence = (self.evidence + evidence).clamp(0.0, 2.0 * self.limit);
        self.lost = self.evidence >= self.limit || (self.lost && self.evidence > 0.0);
    }

    /// Forgets the evidence: the pose was found anew.
    pub fn restart(&mut self) {
        (self.evidence, self.lost) = (0.0, false);
    }

    pub fn is_lost(&self) -> bool {
        self.lost
    }

    pub fn evidence(&self) -> f64 {
        self.evidence
    }

    pub fn share(&self) -> f64 {
        self.right
    }
}

/// Standard deviation along the weakest direction of an information matrix of position and heading, the latter at a
/// distance.
pub(crate) fn weakest(information: &Matrix3<f64>, distance: f64) -> f64 {
    if !(distance > 0.0 && distance.is_finite()) {
        return f64::INFINITY;
    }
    let d = nalgebra::Vector3::new(1.0, 1.0, 1.0 / distance);
    let scaled = Matrix3::from_fn(|i, j| d[i] * information[(i, j)] * d[j]);
    let least = scaled.symmetric_eigenvalues().min();
    if least > 1e-9 * scaled.trace() { 1.0 / least.sqrt() } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vehicle_that_matches_nothing_is_lost_soon_and_one_that_matches_half_never() {
        let mut monitor = Monitor::new(&LostOptions::default());
        for _ in 0..100_000 {
            monitor.see(4, 8);
            assert!(!monitor.is_lost());
        }
        let scans = (0..100).take_while(|_| {
            monitor.see(0, 8);
            !monitor.is_lost()
        });
        assert!((2..8).contains(&scans.count()));
        monitor.restart();
        assert!(!monitor.is_lost());
    }

    #[test]
    fn evidence_does_not_grow_for_ever() {
        let mut monitor = Monitor::new(&LostOptions::default());
        (0..1000).for_each(|_| monitor.see(0, 8));
        assert!(monitor.is_lost() && monitor.evidence() <= 2.0 * 1e6_f64.ln());
    }

    #[test]
    fn what_is_lost_stays_lost_until_no_evidence_is_left() {
        let mut monitor = Monitor::new(&LostOptions::default());
        let limit = LostOptions::default().evidence.ln();
        monitor.hear(-1.1 * limit);
        assert!(monitor.is_lost());
        monitor.hear(0.2 * limit);
        assert!(monitor.is_lost() && monitor.evidence() < limit, "below the limit, but not by as much as was heard");
        monitor.hear(limit);
        assert!(!monitor.is_lost());
    }

    #[test]
    fn geometry_tells_the_weakest_direction() {
        let information = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e4, 2500.0, 4e6));
        assert!((weakest(&information, 10.0) - 0.02).abs() < 1e-12);
        assert!((weakest(&information, 1000.0) - 0.5).abs() < 1e-9);
        let singular = Matrix3::from_diagonal(&nalgebra::Vector3::new(1e4, 0.0, 4e4));
        assert_eq!((weakest(&singular, 10.0), weakest(&information, 0.0)), (f64::INFINITY, f64::INFINITY));
    }
}

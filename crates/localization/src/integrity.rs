//! Whether the pose can be relied on: quality and status, from the evidence of the scans and from the covariance.
//!
//! ```text
//! lost       never known, evidence beyond its limit, or sigma of the position > sigma_max
//! coasting   neither landmarks nor walls constrained the pose at the last scan
//! tracking   otherwise
//! ```

use crate::joint::Joint;
use crate::options::LostOptions;
use crate::quality::{Monitor, Quality, Status, weakest};
use nalgebra::Matrix3;

/// How the landmarks of one scan constrain the pose.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    /// Information on the pose.
    pub information: Matrix3<f64>,
    /// Mean distance of the landmarks [m].
    pub distance: f64,
}

impl Support {
    /// No landmark at all.
    pub fn none() -> Self {
        Self { information: Matrix3::zeros(), distance: 0.0 }
    }
}

/// Watches over the pose.
#[derive(Clone, Debug)]
pub(crate) struct Integrity {
    monitor: Monitor,
    quality: Quality,
    /// Whether the pose was ever known.
    known: bool,
    sigma_max: f64,
}

impl Integrity {
    pub fn new(known: bool, options: &LostOptions) -> Self {
        Self { monitor: Monitor::new(options), quality: Quality::default(), known, sigma_max: options.sigma_max }
    }

    pub fn quality(&self) -> Quality {
        self.quality
    }

    pub fn is_known(&self) -> bool {
        self.known
    }

    pub fn is_lost(&self) -> bool {
        self.quality.status == Status::Lost
    }

    /// Takes in the logarithm of a likelihood ratio of being right against being lost.
    pub fn hear(&mut self, log_ratio: f64) {
        self.monitor.hear(log_ratio);
    }

    /// Takes in how many observations of a scan were matched, with the sum of their squared innovations; where nothing could
    /// be matched at all (`expected` is false), it is no evidence.
    pub fn see(&mut self, observed: usize, matched: usize, nis: f64, expected: bool) {
        (self.quality.observed, self.quality.matched) = (observed, matched);
        (self.quality.nis, self.quality.dof) = (nis, 2 * matched);
        if expected {
            self.monitor.see(matched, observed);
        }
    }

    /// The pose was found again: evidence against it no longer counts.
    pub fn restart(&mut self) {
        self.monitor.restart();
        self.known = true;
    }

    /// Takes over the standard deviations of the pose.
    pub fn measure(&mut self, joint: &Joint) {
        (self.quality.sigma_position, self.quality.sigma_heading) = (joint.sigma_position(), joint.sigma_heading());
    }

    /// Sets the figures that follow from pose, scan and evidence.
    pub fn judge(&mut self, joint: &Joint, support: &Support, walls_constrain: bool) {
        self.measure(joint);
        let q = &mut self.quality;
        q.geometry = weakest(&support.information, support.distance);
        q.matched_share = self.monitor.share();
        q.lost_evidence = self.monitor.evidence();
        let lost = !self.known || self.monitor.is_lost() || q.sigma_position > self.sigma_max;
        q.status = match lost {
            true => Status::Lost,
            false if q.matched == 0 && !walls_constrain => Status::Coasting,
            false => Status::Tracking,
        };
    }
}

//! Wheels made from odometry: what two wheels would have read whose vehicle drove so.
//!
//! ```text
//! step of the odometry   arc of length d that turns by w:   d = chord (w/2)/sin(w/2)
//! left  += d - w axle/2,   right += d + w axle/2            wheels of 1 m radius
//! ```
//!
//! A calibration with them finds radii that are factors on the wheels of the odometry, and an axle that is one on its
//! separation. Motion across (of a vehicle that has no such wheels) is lost.

use crate::message::WheelReading;
use groma_models::finding::Code;
use groma_models::{Finding, Odometry};

/// Wheels that would have made an odometry.
#[derive(Clone, Debug)]
pub struct VirtualWheels {
    axle: f64,
    last: Option<Odometry>,
    sums: [f64; 2],
    invalid: u32,
}

impl VirtualWheels {
    /// Wheels of 1 m radius, `axle` apart [m].
    #[must_use]
    pub fn new(axle: f64) -> Self {
        Self { axle, last: None, sums: [0.0; 2], invalid: 0 }
    }

    /// What they read when the odometry says this; nothing for odometry that is no number or not later than the one before.
    pub fn push(&mut self, odometry: &Odometry) -> Option<WheelReading> {
        if !odometry.pose.to_vector().iter().all(|v| v.is_finite()) {
            self.invalid += 1;
            return None;
        }
        if let Some(last) = self.last {
            if odometry.stamp <= last.stamp {
                return None;
            }
            let step = last.pose.between(&odometry.pose).log();
            let half = step.z * self.axle / 2.0;
            self.sums = [self.sums[0] + step.x - half, self.sums[1] + step.x + half];
        }
        self.last = Some(*odometry);
        WheelReading::new(odometry.stamp, vec![(0, self.sums[0]), (1, self.sums[1])]).ok()
    }

    /// What was left out.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let text = format!("{} poses of the odometry are no numbers", self.invalid);
        let finding = Finding::new(Code::ValuesInvalid, text).with("count", f64::from(self.invalid), "1");
        (self.invalid > 0).then_some(finding).into_iter().collect()
    }
}

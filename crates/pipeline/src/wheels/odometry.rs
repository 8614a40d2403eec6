//! Odometry of a calibrated vehicle from the readings of its wheels, as they come, by the clock of its scans.
//!
//! ```text
//! T_odom_base(t - delay) = T_odom_base(before) motion(input of the drive since the row before)      exact arcs
//! ```
//!
//! It begins at the origin. Where the readings do not hang together the vehicle stays where it was: to an estimator that
//! sees the scans too this is odometry that stalls. The noise of the wheels is not told.

use super::WheelReader;
use crate::message::WheelReading;
use groma_geometry::Se2;
use groma_models::{Drive, Finding, Odometry, Vehicle};

/// Sums what the wheels of a vehicle say.
#[derive(Clone, Debug)]
pub struct WheelOdometry {
    reader: WheelReader,
    drive: Drive,
    delay: f64,
    pose: Se2,
}

impl WheelOdometry {
    /// The odometry of a vehicle that has not moved yet.
    #[must_use]
    pub fn new(vehicle: &Vehicle) -> Self {
        let (drive, delay) = (*vehicle.drive(), vehicle.delay());
        Self { reader: WheelReader::new(vehicle.wheels()), drive, delay, pose: Se2::IDENTITY }
    }

    /// The reading by the clock of the scans, where it is put into order with them.
    #[must_use]
    pub fn on_scan_clock(&self, reading: WheelReading) -> WheelReading {
        WheelReading { stamp: reading.stamp - self.delay, ..reading }
    }

    /// Takes a reading by the clock of the scans, and hands on the poses that it completes, in order of time.
    pub fn push(&mut self, reading: &WheelReading) -> Vec<Odometry> {
        let rows = self.reader.push(reading);
        let moved = rows.into_iter().map(|row| {
            if let Some(step) = row.step {
                self.pose = self.pose * self.drive.motion(step.input);
            }
            Odometry { stamp: row.stamp, pose: self.pose }
        });
        moved.collect()
    }

    /// What was left out, and where the readings do not hang together.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        self.reader.findings()
    }
}

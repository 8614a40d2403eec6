//! The one reader of wheels: from readings of joints, in the order of their arrival, to rows of both joints and the steps
//! between them.
//!
//! ```text
//! reading -> each joint    a number, later than the one before; a counter that wraps is unrolled     (counter)
//!         -> both joints   a row at every stamp of the first joint, the second interpolated          (join)
//!         -> the log       does the row hang together with the one before, or is there a break?      (breaks)
//! row     =  stamp, both readings, input of the drive since the row before
//! ```
//!
//! The first joint is the driven or the left wheel, the second the steering or the right wheel. A steering angle is taken
//! within half a turn. What is left out (no number, late, repeated) is counted, and so are gaps, leaps and counters that
//! were unrolled: [`WheelReader::findings`]. Readings that come late but can be waited for are put into order before, by
//! [`crate::Order`].
//!
//! Nothing is looked up ahead of its arrival: rows of the same readings are the same live and from a file, and do not depend
//! on how joints are spread over messages.

mod account;
mod breaks;
mod counter;
mod join;
mod odometry;
mod record;
mod virtual_wheels;

use crate::message::WheelReading;
use account::Account;
use breaks::{Intervals, Rates};
use counter::Counter;
use groma_geometry::wrap;
use groma_models::{Finding, WheelKind};
use join::Join;
use nalgebra::Vector2;

pub use odometry::WheelOdometry;
pub use record::WheelRecord;
pub use virtual_wheels::VirtualWheels;

/// Readings beyond this are none: a counter this large no longer tells one count from the next.
const LARGEST: f64 = 1e15;

/// Both joints at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelRow {
    /// Time by the clock of the wheels [s].
    pub stamp: f64,
    /// Counters unrolled; a steering angle within half a turn [rad].
    pub reading: Vector2<f64>,
    /// What the wheels did since the row before; nothing for the first row and after a break.
    pub step: Option<WheelStep>,
}

/// What the wheels did between two rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WheelStep {
    /// When it began [s].
    pub start: f64,
    /// When it ended [s].
    pub end: f64,
    /// As [`groma_models::Drive`] takes it: counts of the driven wheel and mean steering angle, or counts of both wheels.
    pub input: Vector2<f64>,
}

/// Reads the wheels of a vehicle.
#[derive(Clone, Debug)]
pub struct WheelReader {
    kind: WheelKind,
    counters: [Counter; 2],
    last_stamps: [Option<f64>; 2],
    join: Join,
    intervals: Intervals,
    rates: Rates,
    last: Option<WheelRow>,
    account: Account,
}

impl WheelReader {
    /// A reader of a kind of wheels.
    #[must_use]
    pub fn new(kind: WheelKind) -> Self {
        Self {
            kind,
            counters: [Counter::new(), Counter::new()],
            last_stamps: [None; 2],
            join: Join::new(kind),
            intervals: Intervals::new(),
            rates: Rates::new(),
            last: None,
            account: Account::default(),
        }
    }

    /// Takes a message with one joint or both, and hands on the rows that it completes, in order of time.
    pub fn push(&mut self, message: &WheelReading) -> Vec<WheelRow> {
        let mut complete = Vec::new();
        for &(joint, position) in message.positions.iter().filter(|(joint, _)| *joint < 2) {
            if self.takes(joint, message.stamp, position) {
                let value = self.value(joint, message.stamp, position);
                self.join.push(joint, message.stamp, value, &mut complete);
            }
        }
        complete.into_iter().map(|(stamp, reading)| self.row(stamp, reading)).collect()
    }

    /// The last complete row.
    #[must_use]
    pub fn last(&self) -> Option<&WheelRow> {
        self.last.as_ref()
    }

    /// What was left out, and where the log does not hang together.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let wrapped = [0, 1].map(|k| self.counters[k].wrapped_at());
        self.account.findings(self.kind, wrapped, self.join.waiting())
    }

    fn takes(&mut self, joint: usize, stamp: f64, position: f64) -> bool {
        if !(stamp.is_finite() && position.abs() <= LARGEST) {
            self.account.invalid.add(stamp, stamp);
            return false;
        }
        match self.last_stamps[joint] {
            Some(last) if stamp < last => self.account.late.add(stamp, stamp),
            Some(last) if stamp == last => self.account.repeated.add(stamp, stamp),
            _ => {
                self.last_stamps[joint] = Some(stamp);
                return true;
            }
        }
        false
    }

    fn value(&mut self, joint: usize, stamp: f64, position: f64) -> f64 {
        if self.kind == WheelKind::Steered && joint == 1 {
            wrap(position)
        } else {
            self.counters[joint].read(stamp, position)
        }
    }

    fn row(&mut self, stamp: f64, reading: Vector2<f64>) -> WheelRow {
        let step = self.last.and_then(|before| self.step(&before, stamp, reading));
        let row = WheelRow { stamp, reading, step };
        self.last = Some(row);
        row
    }

    /// The step from the row before, or nothing and an entry in the account.
    fn step(&mut self, before: &WheelRow, stamp: f64, reading: Vector2<f64>) -> Option<WheelStep> {
        let dt = stamp - before.stamp;
        let is_gap = self.intervals.is_gap(dt);
        let pace = dt.max(self.intervals.usual());
        let counts = (reading - before.reading).abs() / pace;
        let is_leap = !is_gap && self.rates.is_leap(&counts.as_slice()[..self.kind.counters()]);
        if is_gap {
            self.account.gaps.add(before.stamp, stamp);
        } else if is_leap {
            self.account.leaps.add(before.stamp, stamp);
        }
        let input = self.kind.input(before.reading, reading);
        (!is_gap && !is_leap).then_some(WheelStep { start: before.stamp, end: stamp, input })
    }
}

#[cfg(test)]
mod tests;

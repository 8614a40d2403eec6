//! Statistics of the messages of a drive: how many came, which could not be used, where the odometry jumps.

use crate::message::Message;
use groma_features::InvalidOption;
use groma_mapping::mapper::Skipped;
use groma_models::finding::Code;
use groma_models::{Finding, ModelError, Odometry};

/// Why a machine cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Refused {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] InvalidOption),
    /// The mount is no pose.
    #[error(transparent)]
    Mount(#[from] ModelError),
}

/// How many, and the stamps of the first and the last [s].
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    count: usize,
    stamps: Option<(f64, f64)>,
}

impl Tally {
    fn add(&mut self, from: f64, to: f64) {
        self.count += 1;
        let (first, last) = self.stamps.unwrap_or((from, to));
        self.stamps = Some((first.min(from), last.max(to)));
    }

    fn finding(&self, code: Code, text: impl FnOnce(usize) -> String) -> Option<Finding> {
        let (from, to) = self.stamps?;
        Some(Finding::new(code, text(self.count)).with("count", self.count as f64, "1").during(from, to))
    }
}

/// Counts of the messages that came.
#[derive(Clone, Debug, Default)]
pub(super) struct Stream {
    scans_read: usize,
    odometry_read: usize,
    wheels_read: usize,
    scans_used: usize,
    empty: Tally,
    jumps: Tally,
    last: Option<Odometry>,
}

impl Stream {
    /// A message that came, before its turn.
    pub(super) fn read(&mut self, message: &Message) {
        match message {
            Message::Scan { scanner: 0, .. } => self.scans_read += 1,
            Message::Odometry(_) => self.odometry_read += 1,
            Message::Wheels(_) => self.wheels_read += 1,
            _ => {}
        }
    }

    /// What became of a scan.
    pub(super) fn scan(&mut self, stamp: f64, outcome: Result<(), Skipped>) {
        match outcome {
            Ok(()) => self.scans_used += 1,
            Err(Skipped::Empty) => self.empty.add(stamp, stamp),
            // The order left these out already, and counted them.
            Err(Skipped::Late | Skipped::Invalid(_)) => {}
        }
    }

    /// An odometry reading that was taken.
    pub(super) fn odometry(&mut self, reading: Odometry) {
        if let Some(last) = self.last.filter(|last| last.jumps_to(&reading)) {
            self.jumps.add(last.stamp, reading.stamp);
        }
        self.last = Some(reading);
    }

    pub(super) fn counts(&self) -> Vec<(&'static str, f64)> {
        vec![
            ("scans_read", self.scans_read as f64),
            ("scans_used", self.scans_used as f64),
            ("odometry_read", self.odometry_read as f64),
            ("wheels_read", self.wheels_read as f64),
        ]
    }

    pub(super) fn findings(&self) -> Vec<Finding> {
        let found = [
            self.empty.finding(Code::ScansUnusable, |n| format!("{n} scans with fewer than ten hits were left out")),
            self.jumps
                .finding(Code::OdometryJump, |n| format!("{n} steps of the odometry are longer than a robot drives")),
        ];
        found.into_iter().flatten().collect()
    }
}

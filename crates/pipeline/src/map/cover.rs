//! Scans wait in here until the odometry has reached their last beam: what was extrapolated is then set right.
//!
//! ```text
//! a scan is taken     when odometry has come that is not older than its last beam,
//!                     or when the odometry is silent: more than SILENCE older than the newest scan
//! ```
//!
//! Nobody who asks has to wait: until then the pose of the newest scan is the last one that was taken, moved on by the odometry
//! as far as it reaches and by its last twist beyond ([`groma_mapping::mapper::Mapper::predict`]). A map of odometry that is
//! late by less than `SILENCE` is therefore the map of timely odometry, to the last bit.
//!
//! Silence counts from the first scan on where there was no odometry yet. Where odometry is silent, scans are taken as they
//! come.

use groma_models::finding::Code;
use groma_models::{Finding, LaserScan};
use std::collections::VecDeque;

/// Odometry that is this much older than the newest scan is silent [s].
const SILENCE: f64 = 1.0;
/// Scans that wait, at most.
const MOST: usize = 256;
/// Odometry that comes so much later than the scans is worth a word [s].
const LATE: f64 = 0.1;

/// The scans that wait, and how late odometry was.
#[derive(Clone, Debug, Default)]
pub(super) struct Cover {
    /// Scans and the times of their last beams [s].
    waiting: VecDeque<(LaserScan, f64)>,
    /// Time of the last odometry, or of the first scan where there was none [s].
    reached: Option<f64>,
    /// Time of the last beam of all scans so far [s].
    newest: Option<f64>,
    late: Late,
}

/// Odometry that came late.
#[derive(Clone, Copy, Debug, Default)]
struct Late {
    count: usize,
    longest: f64,
    stamps: Option<(f64, f64)>,
}

impl Cover {
    /// Takes a scan that ends at `end`, and hands on those whose turn has come, in order of time.
    pub(super) fn scan(&mut self, scan: LaserScan, end: f64) -> Vec<LaserScan> {
        let reached = *self.reached.get_or_insert(scan.stamp);
        self.newest = Some(self.newest.map_or(end, |newest| newest.max(end)));
        self.waiting.push_back((scan, end));
        let count = if end - reached > SILENCE {
            self.waiting.len()
        } else {
            self.covered().max(self.waiting.len().saturating_sub(MOST))
        };
        self.hand_on(count)
    }

    /// Notes odometry, and hands on the scans that it covers.
    pub(super) fn odometry(&mut self, stamp: f64) -> Vec<LaserScan> {
        self.reached = Some(stamp);
        let lag = self.newest.map_or(0.0, |newest| newest - stamp);
        if lag > LATE {
            let from = self.late.stamps.map_or(stamp, |(from, _)| from);
            self.late =
                Late { count: self.late.count + 1, longest: self.late.longest.max(lag), stamps: Some((from, stamp)) };
        }
        self.hand_on(self.covered())
    }

    /// Hands on all.
    pub(super) fn drain(&mut self) -> Vec<LaserScan> {
        self.hand_on(self.waiting.len())
    }

    /// Stamps of the oldest and the newest scan that wait [s].
    pub(super) fn waiting(&self) -> Option<(f64, f64)> {
        Some((self.waiting.front()?.0.stamp, self.waiting.back()?.0.stamp))
    }

    /// That odometry came late.
    pub(super) fn finding(&self) -> Option<Finding> {
        let (Late { count, longest, .. }, (from, to)) = (self.late, self.late.stamps?);
        let text = format!(
            "{count} readings of the odometry came up to {longest:.2} s later than scans that they cover: the poses of these \
             were extrapolated, and set right when it came"
        );
        let found = Finding::new(Code::OdometryLate, text).during(from, to);
        Some(found.with("readings", count as f64, "1").with("longest", longest, "s"))
    }

    fn covered(&self) -> usize {
        self.waiting.iter().take_while(|(_, end)| self.reached.is_some_and(|reached| reached >= *end)).count()
    }

    fn hand_on(&mut self, count: usize) -> Vec<LaserScan> {
        self.waiting.drain(..count).map(|(scan, _)| scan).collect()
    }
}

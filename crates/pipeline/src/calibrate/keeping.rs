//! Which scans are kept: what stations are needs the whole drive, so a superset of what they may use.
//!
//! ```text
//! first scan of a window   [first reading + 0.15 s + k length, ... + (k + 1) length)
//! at a stop                while the wheels, as far as they are known, stand: 50 scans at most
//! ```
//!
//! Wheels stand here that turn slower than 1 % of their fastest so far: a wheel that stands by the usual rate of the whole drive
//! does so too, save before the vehicle has driven fast for the first time. The scans of a stop are averaged: beyond 50 of them
//! other errors are larger than their noise.
//!
//! Memory: two scans a second and 50 a stop. An hour of stop and go of 1081 beams at 40 Hz, a stop every ten seconds, is 25 000
//! scans, 220 MB; an hour without stops 62 MB.

use super::segments::WINDOW;
use super::standstill::{MARGIN, STILL};
use crate::wheels::WheelRow;
use groma_models::WheelKind;

/// Scans of a stop that are kept, at most.
const MOST_AT_A_STOP: usize = 50;
/// Readings that may answer whether the wheels stood at the time of a scan, at most.
const RECENT: usize = 256;

/// What the wheels did between two readings.
#[derive(Clone, Copy)]
struct Pace {
    end: f64,
    rate: f64,
}

/// Decides scan by scan.
pub(super) struct Keeping {
    kind: WheelKind,
    length: f64,
    origin: Option<f64>,
    last_window: Option<f64>,
    fastest: f64,
    recent: std::collections::VecDeque<Pace>,
    at_this_stop: usize,
}

/// What is to become of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Use {
    /// The wheels stand, as far as they are known.
    pub(super) stands: bool,
    /// Keep it.
    pub(super) keep: bool,
}

impl Keeping {
    /// For windows of a length [s].
    pub(super) fn new(kind: WheelKind, window: Option<f64>) -> Self {
        let recent = std::collections::VecDeque::new();
        let length = window.unwrap_or(WINDOW);
        Self { kind, length, origin: None, last_window: None, fastest: 0.0, recent, at_this_stop: 0 }
    }

    /// Learns what the wheels did.
    pub(super) fn read(&mut self, row: &WheelRow) {
        self.origin.get_or_insert(row.stamp + MARGIN);
        let Some(step) = row.step else { return };
        let gained = step.input.abs();
        let gained = if self.kind.counters() == 2 { gained.x.max(gained.y) } else { gained.x };
        let pace = Pace { end: step.end, rate: gained / (step.end - step.start) };
        self.fastest = self.fastest.max(pace.rate);
        if self.recent.len() >= RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back(pace);
    }

    /// What is to become of a scan of this stamp.
    pub(super) fn decide(&mut self, stamp: f64) -> Use {
        let stands = self.stands(stamp);
        self.at_this_stop = if stands { self.at_this_stop + 1 } else { 0 };
        let is_first = self.is_first_of_a_window(stamp);
        Use { stands, keep: is_first || (stands && self.at_this_stop <= MOST_AT_A_STOP) }
    }

    /// Whether the wheels stand at a time, by the step around it or the last one known; before any, they do.
    pub(super) fn stands(&self, stamp: f64) -> bool {
        let after = self.recent.partition_point(|p| p.end < stamp);
        let pace = self.recent.get(after).or(self.recent.back());
        pace.is_none_or(|p| p.rate < STILL * self.fastest || p.rate == 0.0)
    }

    /// Windows are those of the wheels: before their first reading there are none, and scans are kept as at a stop.
    fn is_first_of_a_window(&mut self, stamp: f64) -> bool {
        let Some(origin) = self.origin else { return false };
        let window = ((stamp - origin) / self.length).floor();
        let is_first = self.last_window.is_none_or(|last| window > last);
        if is_first {
            self.last_window = Some(window);
        }
        is_first
    }
}

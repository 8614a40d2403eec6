//! Where the wheels stand.
//!
//! ```text
//! rate    |counts gained|/time of a step between readings, the greater of two wheels
//! usual   the 90 % quantile of the rates that are not zero
//! stands  rate < 0.01 usual, for 0.8 s at least, readings unbroken
//! ```
//!
//! A margin at both ends of a standstill leaves room for a delay between the clocks of wheels and scans, and for the vehicle
//! to settle.

use groma_egomotion::Station;
use groma_estimation::robust::quantile;
use groma_models::WheelLog;

/// Share of the usual speed below which a wheel stands.
pub(super) const STILL: f64 = 0.01;
/// The rate that one in ten exceeds is the usual one.
const USUAL: f64 = 0.9;
/// Shortest standstill [s].
const LEAST_PAUSE: f64 = 0.8;
/// What is taken off a standstill at both ends [s].
pub(super) const MARGIN: f64 = 0.15;

/// Rates of the counters between readings [1/s]; none where the log is broken.
pub(super) struct Rates {
    rates: Vec<Option<f64>>,
    usual: f64,
}

impl Rates {
    /// Of a log and the intervals in which it does not hang together.
    pub(super) fn new(log: &WheelLog, breaks: &[(f64, f64)]) -> Self {
        let time = log.time();
        let is_broken = |k: usize| breaks.binary_search_by(|b| b.0.total_cmp(&time[k])).is_ok();
        let rate = |k: usize| (!is_broken(k)).then(|| gained(log, k) / (time[k + 1] - time[k]));
        let rates: Vec<Option<f64>> = (0..time.len() - 1).map(rate).collect();
        let mut moving: Vec<f64> = rates.iter().flatten().copied().filter(|r| *r > 0.0).collect();
        Self { usual: quantile(&mut moving, USUAL).unwrap_or(0.0), rates }
    }

    /// Whether the log is broken after reading k.
    pub(super) fn is_broken(&self, k: usize) -> bool {
        self.rates[k].is_none()
    }

    /// The standstills, margins taken off.
    pub(super) fn standstills(&self, log: &WheelLog) -> Vec<Station> {
        let time = log.time();
        let stands = |k: usize| self.rates[k].is_some_and(|r| r < STILL * self.usual);
        let (mut out, mut begin) = (Vec::new(), None);
        for k in 0..=self.rates.len() {
            let goes_on = k < self.rates.len() && stands(k);
            if goes_on {
                begin.get_or_insert(k);
            } else if let Some(from) = begin.take().map(|b: usize| time[b])
                && time[k] - from >= LEAST_PAUSE
            {
                out.push(Station { from: from + MARGIN, to: time[k] - MARGIN });
            }
        }
        out
    }

    /// Whether the wheels turned noticeably between two times within the log.
    pub(super) fn turned(&self, log: &WheelLog, start: f64, end: f64) -> bool {
        let steps = log.steps(start, end).unwrap_or_default();
        let total = steps.iter().fold([0.0, 0.0], |sum, s| [sum[0] + s.input.x, sum[1] + s.input.y]);
        let moved = total.iter().take(counters(log)).fold(0.0_f64, |most, v| most.max(v.abs()));
        moved > STILL * self.usual * (end - start)
    }
}

/// What the faster counter gains from reading k to the next.
pub(super) fn gained(log: &WheelLog, k: usize) -> f64 {
    let step = (log.reading(k + 1) - log.reading(k)).abs();
    if counters(log) == 2 { step.x.max(step.y) } else { step.x }
}

fn counters(log: &WheelLog) -> usize {
    log.kind().counters()
}

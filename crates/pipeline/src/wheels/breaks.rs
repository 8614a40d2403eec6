//! Where a log of wheels does not hang together: readings are missing, or a counter leaps.
//!
//! ```text
//! gap    dt > max(0.5 s, 5 x the usual dt)                   usual: the median of the last intervals
//! leap   rate > 20 x max(the usual rate, the rate before)    usual: the 95 % quantile of all rates that are not zero so far
//! rate   |step| / max(dt, usual dt)                          stamps that jitter make no rates
//! ```
//!
//! Both are told at the reading itself, from what came before it. The first interval is never a gap (a log may be slow), and
//! no leap is told before 20 rates are known. A wheel that starts fast after creeping is distinguished from a leap by the rate just
//! before: wheels gather speed over more than one reading.

use std::collections::VecDeque;

/// Readings farther apart than this break the log [s], unless that is their usual rate.
pub(super) const GAP: f64 = 0.5;
/// So many usual intervals are a gap.
const INTERVALS: f64 = 5.0;
/// Intervals that the usual one is taken from.
const WINDOW: usize = 255;
/// A counter that runs this many times faster than it usually does was reset, or its reading is wrong.
const LEAP: f64 = 20.0;
/// The rate that is exceeded by one in twenty is the usual one of a vehicle that drives.
const USUAL: f64 = 0.95;
/// Rates that must be known before one can be unusual.
const WARM_UP: u32 = 20;
/// Bins of the histogram of rates: an eighth of an octave each, from 2^-64 to 2^64 units a second.
const BINS: usize = 1024;

/// Intervals between readings, and which of them are gaps.
#[derive(Clone, Debug)]
pub(super) struct Intervals {
    recent: VecDeque<f64>,
    sorted: Vec<f64>,
}

impl Intervals {
    pub(super) fn new() -> Self {
        Self { recent: VecDeque::new(), sorted: Vec::new() }
    }

    /// Whether an interval [s] is a gap; it counts for the next ones.
    pub(super) fn is_gap(&mut self, dt: f64) -> bool {
        self.remember(dt);
        dt > GAP.max(INTERVALS * self.usual())
    }

    /// The median of the last intervals, the lower of two [s].
    pub(super) fn usual(&self) -> f64 {
        self.sorted.get((self.sorted.len().max(1) - 1) / 2).copied().unwrap_or(0.0)
    }

    fn remember(&mut self, dt: f64) {
        if self.recent.len() >= WINDOW
            && let Some(oldest) = self.recent.pop_front()
        {
            self.sorted.remove(self.sorted.partition_point(|x| *x < oldest));
        }
        self.recent.push_back(dt);
        self.sorted.insert(self.sorted.partition_point(|x| *x < dt), dt);
    }
}

/// Rates of the counters, and which of them are leaps.
#[derive(Clone, Debug)]
pub(super) struct Rates {
    counts: Vec<u32>,
    total: u32,
    last: f64,
}

impl Rates {
    pub(super) fn new() -> Self {
        Self { counts: vec![0; BINS], total: 0, last: 0.0 }
    }

    /// Whether one of the rates [1/s] of a step is a leap; they count for the next ones.
    pub(super) fn is_leap(&mut self, rates: &[f64]) -> bool {
        let fastest = rates.iter().fold(0.0, |a: f64, b| a.max(*b));
        let is_leap = self.total >= WARM_UP && fastest > LEAP * self.usual().max(self.last);
        for rate in rates.iter().filter(|r| **r > 0.0) {
            self.counts[bin(*rate)] += 1;
            self.total += 1;
        }
        if !is_leap {
            self.last = fastest;
        }
        is_leap
    }

    /// The upper edge of the bin in which the usual rate lies.
    fn usual(&self) -> f64 {
        let wanted = (USUAL * f64::from(self.total)).ceil() as u32;
        let mut sum = 0;
        let reached = self.counts.iter().position(|count| {
            sum += count;
            sum >= wanted
        });
        reached.map_or(f64::INFINITY, |k| ((k + 1) as f64 / 8.0 - 64.0).exp2())
    }
}

fn bin(rate: f64) -> usize {
    ((rate.log2() + 64.0) * 8.0).clamp(0.0, (BINS - 1) as f64) as usize
}

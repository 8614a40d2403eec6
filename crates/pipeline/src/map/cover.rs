//! Scans wait in here until the odometry has reached their last beam: what was extrapolated is then corrected.
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
             were extrapolated, and corrected when it came"
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

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::BeamGeometry;

    /// A sweep of 50 ms.
    fn scan(cover: &mut Cover, stamp: f64) -> Vec<f64> {
        let geometry =
            BeamGeometry { angle_min: 0.0, angle_increment: 0.1, time_increment: 0.05, range_min: 0.1, range_max: 9.0 };
        let scan = LaserScan { stamp, geometry, ranges: vec![1.0; 2], intensities: vec![] };
        cover.scan(scan, stamp + 0.05).iter().map(|s| s.stamp).collect()
    }

    fn odometry(cover: &mut Cover, stamp: f64) -> Vec<f64> {
        cover.odometry(stamp).iter().map(|s| s.stamp).collect()
    }

    #[test]
    fn a_scan_is_taken_once_odometry_reaches_its_last_beam() {
        let mut cover = Cover::default();
        assert!(odometry(&mut cover, 1.0).is_empty() && scan(&mut cover, 1.25).is_empty());
        assert!(scan(&mut cover, 1.5).is_empty() && odometry(&mut cover, 1.25).is_empty());
        assert_eq!(cover.waiting(), Some((1.25, 1.5)));
        assert_eq!((odometry(&mut cover, 1.25 + 0.05), odometry(&mut cover, 2.0)), (vec![1.25], vec![1.5]));
        assert_eq!((scan(&mut cover, 1.75), cover.waiting()), (vec![1.75], None), "it was there before");
    }

    #[test]
    fn nobody_waits_for_odometry_that_is_silent_and_silence_begins_with_the_first_scan() {
        let mut cover = Cover::default();
        let early: usize = (0..10).map(|k| scan(&mut cover, 100.0 + 0.1 * f64::from(k)).len()).sum();
        assert_eq!((early, scan(&mut cover, 101.1).len(), scan(&mut cover, 101.2)), (0, 11, vec![101.2]));
    }

    #[test]
    fn scans_by_the_thousand_do_not_pile_up() {
        let mut cover = Cover::default();
        let taken: Vec<f64> = (0..2000).flat_map(|k| scan(&mut cover, 1e-4 * f64::from(k))).collect();
        assert!(taken.len() > 1000 && taken.len() < 1990 && taken.is_sorted(), "{}", taken.len());
    }

    #[test]
    fn how_late_odometry_was_at_most_is_distinguished_from_its_first_to_its_last_late_reading() {
        let mut cover = Cover::default();
        for (end, reading) in [(10.0, 9.98), (10.1, 9.99), (11.0, 10.75), (11.1, 10.9), (12.0, 12.0)] {
            scan(&mut cover, end - 0.05);
            odometry(&mut cover, reading);
        }
        let found = cover.finding().unwrap();
        let values: Vec<_> = found.values.iter().map(|v| (v.value, v.unit)).collect();
        assert_eq!((found.span, values[0]), (Some((9.99, 10.9)), (3.0, "1")));
        assert!((values[1].0 - 0.25).abs() < 1e-9 && values[1].1 == "s", "{values:?}");
    }
}

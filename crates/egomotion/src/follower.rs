//! Scans in order of time in; at any moment the motions between stations out.
//!
//! The tracker follows every scan; of a scan that the caller wants kept the readings stay, for the registration
//! between stations. Which stations there are need not be known before: a kept scan belongs to a standstill when its whole
//! sweep lies in it, to a moment when it is the first kept one that begins there or later, before the next station. The twist
//! during a sweep is the mean one of the tracked poses around it.
//!
//! Memory: one pose per scan, the tracker, and the scans that were kept.

use crate::station::{Motion, Sight, Station, motion, unseen};
use groma_geometry::Se2;
use groma_models::{Cancelled, LaserScan, Token};
use groma_registration::contour::middle;
use groma_registration::{Contour, PolarView};
use groma_tracking::{Tracker, has_enough_hits};
use nalgebra::Vector3;
use std::ops::Range;

/// Neighbouring scans farther apart than this give no twist [s].
const NEIGHBOURS: f64 = 0.6;

/// Why a scan was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Skipped {
    /// Its stamp is not finite or not after that of the scan before.
    Late,
    /// It has fewer than ten hits.
    Empty,
}

/// Follows the scans and keeps those that are wanted.
#[derive(Default)]
pub struct Follower {
    tracker: Tracker,
    track: Vec<Tracked>,
    kept: Vec<Kept>,
}

/// Where a scan was taken.
#[derive(Clone, Copy)]
struct Tracked {
    stamp: f64,
    pose: Se2,
    /// With turns counted [rad].
    heading: f64,
}

/// A scan and its place in the track.
struct Kept {
    index: usize,
    scan: LaserScan,
}

impl Follower {
    /// Follows the next scan, of a vehicle that `stands` or may move, and keeps it where `keep` says so.
    ///
    /// # Errors
    /// [`Skipped`] when it cannot be used; nothing has changed then.
    pub fn push(&mut self, scan: LaserScan, stands: bool, keep: bool) -> Result<(), Skipped> {
        if !scan.stamp.is_finite() || self.track.last().is_some_and(|last| scan.stamp <= last.stamp) {
            return Err(Skipped::Late);
        }
        if !has_enough_hits(&scan) {
            return Err(Skipped::Empty);
        }
        let twist = if stands { Vector3::zeros() } else { self.tracker.velocity() };
        let view = PolarView::new(&scan, &Se2::IDENTITY, twist);
        let step = self.tracker.step(scan.stamp, view, None);
        let heading = self.track.last().map_or(0.0, |last| last.heading + last.pose.between(&step.pose).theta());
        self.track.push(Tracked { stamp: scan.stamp, pose: step.pose, heading });
        if keep {
            self.kept.push(Kept { index: self.track.len() - 1, scan });
        }
        Ok(())
    }

    /// First and last stamp of the scans so far [s].
    #[must_use]
    pub fn span(&self) -> Option<(f64, f64)> {
        Some((self.track.first()?.stamp, self.track.last()?.stamp))
    }

    /// Scans followed.
    #[must_use]
    pub fn len(&self) -> usize {
        self.track.len()
    }

    /// Whether no scan was followed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.track.is_empty()
    }

    /// Scans kept.
    #[must_use]
    pub fn kept(&self) -> usize {
        self.kept.len()
    }

    /// The motions between successive stations, which are in order of time.
    ///
    /// # Errors
    /// [`Cancelled`] soon after the token was.
    pub fn motions(&self, stations: &[Station], token: &Token) -> Result<Vec<Motion>, Cancelled> {
        token.begin(stations.len());
        let mut motions = Vec::with_capacity(stations.len().saturating_sub(1));
        let mut before: Option<(Sight, Contour)> = None;
        for (k, station) in stations.iter().enumerate() {
            token.step()?;
            let seen = self.sight(station, stations.get(k + 1)).map(|sight| {
                let contour = sight.contour();
                (sight, contour)
            });
            if k > 0 {
                motions.push(match (&before, &seen) {
                    (Some((a, of_a)), Some((b, of_b))) => motion((a, of_a), (b, of_b)),
                    _ => unseen(&stations[k - 1], station),
                });
            }
            before = seen;
        }
        Ok(motions)
    }

    /// What was seen at a station; nothing where no scan belongs to it.
    fn sight(&self, station: &Station, next: Option<&Station>) -> Option<Sight> {
        let kept = &self.kept[self.of_station(station, next)];
        let first = kept.first()?;
        let scans: Vec<LaserScan> = kept.iter().map(|k| k.scan.clone()).collect();
        let at = self.track[first.index];
        if station.is_standstill() {
            let stamp = f64::midpoint(station.from, station.to);
            return Some(Sight { stamp, scans, pose: at.pose, heading: at.heading, twist: Vector3::zeros() });
        }
        let half = middle(&first.scan);
        let twist = self.twist_after(first.index);
        let (stamp, pose, heading) = (at.stamp + half, at.pose.plus(twist * half), at.heading + twist.z * half);
        Some(Sight { stamp, scans, pose, heading, twist })
    }

    /// The kept scans that belong to a station.
    fn of_station(&self, station: &Station, next: Option<&Station>) -> Range<usize> {
        let from = self.kept.partition_point(|k| k.scan.stamp < station.from);
        if !station.is_standstill() {
            let inside = self.kept.get(from).filter(|k| next.is_none_or(|next| k.scan.stamp < next.from));
            return from..from + usize::from(inside.is_some());
        }
        let end = |k: &Kept| k.scan.beam_stamp(k.scan.ranges.len().saturating_sub(1));
        from..from + self.kept[from..].iter().take_while(|k| end(k) <= station.to).count()
    }

    /// The mean twist from the scan before a scan to the second one after it, as far as they are near.
    fn twist_after(&self, index: usize) -> Vector3<f64> {
        let here = self.track[index].stamp;
        let near = |k: &usize| (self.track[*k].stamp - here).abs() < NEIGHBOURS;
        let first = Some(index.saturating_sub(1)).filter(near).unwrap_or(index);
        let last = (index..self.track.len().min(index + 3)).rev().find(near).unwrap_or(index);
        let (a, b) = (self.track[first], self.track[last]);
        if last > first { a.pose.between(&b.pose).log() / (b.stamp - a.stamp) } else { Vector3::zeros() }
    }
}

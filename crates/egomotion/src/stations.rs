//! Scans in order of time in, motions between stations out.
//!
//! A scan belongs to a standstill when its whole sweep lies in it, to a moment when it is the first that begins there or
//! later, before the next station. The twist during a sweep is the mean one of the tracked poses around it.

use crate::station::{Motion, Sight, Station, motion, unseen};
use groma_geometry::Se2;
use groma_mapping::keyframe::Keyframe;
use groma_mapping::tracker::Tracker;
use groma_models::LaserScan;
use groma_registration::contour::middle;
use groma_registration::{Contour, PolarView};
use nalgebra::Vector3;

/// A scan with fewer hits says nothing of where it was taken.
const LEAST_HITS: usize = 10;
/// Neighbouring scans farther apart than this tell no twist [s].
const NEIGHBOURS: f64 = 0.6;

/// Why a scan was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skipped {
    /// Its stamp is not finite or not after that of the scan before.
    Late,
    /// It has fewer than ten hits.
    Empty,
}

/// Follows the scans and keeps what was seen at the stations.
pub struct Stations {
    stations: Vec<Station>,
    /// Per station the index of its first scan in the track, and its scans.
    seen: Vec<Option<(usize, Vec<LaserScan>)>>,
    tracker: Tracker,
    keyframes: Vec<Keyframe>,
    track: Vec<Tracked>,
}

/// Where a scan was taken.
#[derive(Clone, Copy)]
struct Tracked {
    stamp: f64,
    pose: Se2,
    /// With turns counted [rad].
    heading: f64,
}

impl Stations {
    /// For stations in order of time.
    #[must_use]
    pub fn new(stations: Vec<Station>) -> Self {
        let seen = vec![None; stations.len()];
        Self { stations, seen, tracker: Tracker::default(), keyframes: vec![], track: vec![] }
    }

    /// Takes the next scan.
    ///
    /// # Errors
    /// [`Skipped`] when it cannot be used; nothing has changed then.
    pub fn push(&mut self, scan: LaserScan) -> Result<(), Skipped> {
        if !scan.stamp.is_finite() || self.track.last().is_some_and(|last| scan.stamp <= last.stamp) {
            return Err(Skipped::Late);
        }
        if scan.hits().take(LEAST_HITS).count() < LEAST_HITS {
            return Err(Skipped::Empty);
        }
        let at = self.station_of(&scan);
        let stands = at.is_some_and(|k| self.stations[k].is_standstill());
        let twist = if stands { Vector3::zeros() } else { self.tracker.velocity() };
        let view = PolarView::new(&scan, &Se2::IDENTITY, twist);
        let pose = self.tracker.step(scan.stamp, view, None, &mut self.keyframes).pose;
        let heading = self.track.last().map_or(0.0, |last| last.heading + last.pose.between(&pose).theta());
        self.track.push(Tracked { stamp: scan.stamp, pose, heading });
        if let Some(k) = at {
            self.seen[k].get_or_insert_with(|| (self.track.len() - 1, vec![])).1.push(scan);
        }
        Ok(())
    }

    /// The motions between successive stations.
    #[must_use]
    pub fn finish(mut self) -> Vec<Motion> {
        let seen = std::mem::take(&mut self.seen).into_iter().enumerate();
        let sights: Vec<Option<(Sight, Contour)>> = seen
            .map(|(k, seen)| {
                let sight = seen.map(|(index, scans)| self.sight(&self.stations[k], index, scans))?;
                let contour = sight.contour();
                Some((sight, contour))
            })
            .collect();
        let between = |k: usize| match (&sights[k - 1], &sights[k]) {
            (Some((a, ca)), Some((b, cb))) => motion((a, ca), (b, cb)),
            _ => unseen(&self.stations[k - 1], &self.stations[k]),
        };
        (1..self.stations.len()).map(between).collect()
    }

    /// The station that a scan belongs to.
    fn station_of(&self, scan: &LaserScan) -> Option<usize> {
        let k = self.stations.partition_point(|s| s.from <= scan.stamp).checked_sub(1)?;
        let station = self.stations[k];
        let end = scan.beam_stamp(scan.ranges.len().saturating_sub(1));
        let belongs = if station.is_standstill() { end <= station.to } else { self.seen[k].is_none() };
        belongs.then_some(k)
    }

    fn sight(&self, station: &Station, index: usize, scans: Vec<LaserScan>) -> Sight {
        let at = self.track[index];
        if station.is_standstill() {
            let stamp = (station.from + station.to) / 2.0;
            return Sight { stamp, scans, pose: at.pose, heading: at.heading, twist: Vector3::zeros() };
        }
        let half = scans.first().map_or(0.0, middle);
        let twist = self.twist_after(index);
        let (stamp, pose, heading) = (at.stamp + half, at.pose.plus(twist * half), at.heading + twist.z * half);
        Sight { stamp, scans, pose, heading, twist }
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

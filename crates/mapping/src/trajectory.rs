//! The trajectory at the rate of the odometry, from the poses of the scans.
//!
//! Between two scans with poses `P_1`, `P_2` the odometry tells the shape of the way and the scans its ends: with `D(t)` the
//! odometry since the first scan and `e = log((P_1 D(t_2))^-1 P_2)` what it missed,
//!
//! ```text
//! P(t) = P_1 D(t) exp(u e),     u = (t - t_1) / (t_2 - t_1)
//! ```
//!
//! Before the first and after the last scan the odometry goes on alone. Online it does so after every scan, for the next one is
//! not known yet.

use groma_geometry::Se2;
use groma_models::{Odometry, OdometryTrack};

/// Stamps this close are one: formats round them [s].
const SAME: f64 = 1e-6;

/// Poses at the stamps of the scans and, where `track` has readings, between them; in order of time.
///
/// `shift` maps an odometry increment to the frame that the scans are given in.
#[must_use]
pub fn at_odometry_rate(scans: &[(f64, Se2)], track: &OdometryTrack, shift: impl Fn(&Se2) -> Se2) -> Vec<(f64, Se2)> {
    merged(scans, track, |k, reading| match scans.get(k) {
        Some(after) if k > 0 => between(&scans[k - 1], after, reading, track, &shift),
        _ => onward(&scans[k.saturating_sub(1)], reading, track, &shift),
    })
}

/// The same as it was estimated at the time: the odometry goes on from the last scan, shifted by what was known there of
/// the laser's place, the `offsets`.
#[must_use]
pub fn ahead(scans: &[(f64, Se2)], offsets: &[Se2], track: &OdometryTrack) -> Vec<(f64, Se2)> {
    merged(scans, track, |k, reading| {
        let last = k.saturating_sub(1);
        onward(&scans[last], reading, track, &|u: &Se2| offsets[last].inverse() * *u * offsets[last])
    })
}

/// The scans, and the readings of `track` with the pose that `place` gives to those before scan k (after all: k scans).
fn merged(scans: &[(f64, Se2)], track: &OdometryTrack, place: impl Fn(usize, &Odometry) -> Se2) -> Vec<(f64, Se2)> {
    let mut out = Vec::with_capacity(scans.len() + track.readings().len());
    let mut readings = track.readings().iter().peekable();
    for (k, (stamp, pose)) in scans.iter().enumerate() {
        while let Some(r) = readings.next_if(|r| r.stamp < stamp - SAME) {
            out.push((r.stamp, place(k, r)));
        }
        while readings.next_if(|r| r.stamp <= stamp + SAME).is_some() {}
        out.push((*stamp, *pose));
    }
    if !scans.is_empty() && track.readings().len() > 1 {
        out.extend(readings.map(|r| (r.stamp, place(scans.len(), r))));
    }
    out
}

/// The pose at a reading by odometry alone, from a scan.
fn onward(scan: &(f64, Se2), reading: &Odometry, track: &OdometryTrack, shift: &impl Fn(&Se2) -> Se2) -> Se2 {
    let start = track.at(scan.0).unwrap_or(reading.pose);
    scan.1 * shift(&start.between(&reading.pose))
}

/// The pose at a reading between two scans.
fn between(
    before: &(f64, Se2),
    after: &(f64, Se2),
    reading: &Odometry,
    track: &OdometryTrack,
    shift: &impl Fn(&Se2) -> Se2,
) -> Se2 {
    let end = Odometry { stamp: after.0, pose: track.at(after.0).unwrap_or(reading.pose) };
    let missed = after.1.minus(&onward(before, &end, track, shift));
    let u = (reading.stamp - before.0) / (after.0 - before.0);
    onward(before, reading, track, shift).plus(missed * u)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(stamps: &[f64]) -> OdometryTrack {
        let mut track = OdometryTrack::default();
        for t in stamps {
            track.push(Odometry { stamp: *t, pose: Se2::new(*t, 0.0, 0.0) });
        }
        track
    }

    #[test]
    fn keeps_the_scans_and_spreads_what_odometry_missed() {
        let scans = [(1.0, Se2::IDENTITY), (2.0, Se2::new(1.2, 0.0, 0.0))];
        let out = at_odometry_rate(&scans, &track(&[0.5, 1.0, 1.5, 2.5]), |u| *u);
        let expected = [(0.5, -0.5), (1.0, 0.0), (1.5, 0.6), (2.0, 1.2), (2.5, 1.7)];
        assert_eq!(out.len(), expected.len());
        for ((t, p), (te, x)) in out.iter().zip(expected) {
            assert!(*t == te && (p.x() - x).abs() < 1e-12, "{t} {}", p.x());
        }
    }

    #[test]
    fn online_what_odometry_missed_is_not_known_before_the_next_scan() {
        let scans = [(1.0, Se2::IDENTITY), (2.0, Se2::new(1.2, 0.0, 0.0))];
        let out = ahead(&scans, &[Se2::IDENTITY; 2], &track(&[0.5, 1.0, 1.5, 2.5]));
        let expected = [(0.5, -0.5), (1.0, 0.0), (1.5, 0.5), (2.0, 1.2), (2.5, 1.7)];
        assert_eq!(out.len(), expected.len());
        for ((t, p), (te, x)) in out.iter().zip(expected) {
            assert!(*t == te && (p.x() - x).abs() < 1e-12, "{t} {}", p.x());
        }
    }

    #[test]
    fn without_odometry_only_the_scans_remain() {
        let scans = [(1.0, Se2::IDENTITY), (2.0, Se2::new(1.0, 0.0, 0.0))];
        assert_eq!(at_odometry_rate(&scans, &OdometryTrack::default(), |u| *u), scans);
    }
}

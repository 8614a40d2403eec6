//! The trajectory at the rate of the odometry, from the poses of the scans.
//!
//! Between two scans with poses `P_1`, `P_2` the odometry tells the shape of the way and the scans its ends: with `D(t)` the
//! odometry since the first scan and `e = log((P_1 D(t_2))^-1 P_2)` what it missed,
//!
//! ```text
//! P(t) = P_1 D(t) exp(u e),     u = (t - t_1) / (t_2 - t_1)
//! ```
//!
//! Before the first and after the last scan the odometry goes on alone.

use groma_geometry::Se2;
use groma_models::{Odometry, OdometryTrack};

/// Stamps this close are one: formats round them [s].
const SAME: f64 = 1e-6;

/// Poses at the stamps of the scans and, where `track` has readings, between them; in order of time.
///
/// `shift` maps an odometry increment to the frame that the scans are given in.
#[must_use]
pub fn at_odometry_rate(scans: &[(f64, Se2)], track: &OdometryTrack, shift: impl Fn(&Se2) -> Se2) -> Vec<(f64, Se2)> {
    let mut out = Vec::with_capacity(scans.len() + track.readings().len());
    let mut readings = track.readings().iter().peekable();
    for (k, (stamp, pose)) in scans.iter().enumerate() {
        while let Some(r) = readings.next_if(|r| r.stamp < stamp - SAME) {
            out.push((r.stamp, between(k.checked_sub(1).map(|j| &scans[j]), &scans[k], r, track, &shift)));
        }
        while readings.next_if(|r| r.stamp <= stamp + SAME).is_some() {}
        out.push((*stamp, *pose));
    }
    if let (Some((stamp, pose)), true) = (scans.last(), track.readings().len() > 1) {
        let start = track.at(*stamp).unwrap_or(Se2::IDENTITY);
        out.extend(readings.map(|r| (r.stamp, *pose * shift(&start.between(&r.pose)))));
    }
    out
}

fn between(
    before: Option<&(f64, Se2)>,
    after: &(f64, Se2),
    reading: &Odometry,
    track: &OdometryTrack,
    shift: &impl Fn(&Se2) -> Se2,
) -> Se2 {
    let (_, Some(end)) = (after.0, track.at(after.0)) else { return after.1 };
    let Some((t1, p1)) = before else {
        return after.1 * shift(&end.between(&reading.pose));
    };
    let start = track.at(*t1).unwrap_or(reading.pose);
    let missed = after.1.minus(&(*p1 * shift(&start.between(&end))));
    let u = (reading.stamp - t1) / (after.0 - t1);
    (*p1 * shift(&start.between(&reading.pose))).plus(missed * u)
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
    fn without_odometry_only_the_scans_remain() {
        let scans = [(1.0, Se2::IDENTITY), (2.0, Se2::new(1.0, 0.0, 0.0))];
        assert_eq!(at_odometry_rate(&scans, &OdometryTrack::default(), |u| *u), scans);
    }
}

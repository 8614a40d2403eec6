//! Times at which the vehicle stood.
//!
//! It stands where it moved by less than `STILL` since the scan before. A halt lasts `LEAST` at least; its scatter is the root
//! mean square distance of the positions from their mean, the first `SETTLING` of it left out.

use super::track::Fix;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Moved and turned by less between two scans it stands [m], [rad].
const STILL: (f64, f64) = (5e-4, 2e-4);
/// Shortest halt [s].
const LEAST: f64 = 1.0;
/// The first moments do not count for the scatter [s].
const SETTLING: f64 = 0.3;

/// A time at which the vehicle stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Halt {
    /// First stamp [s].
    pub from: f64,
    /// Last stamp [s].
    pub to: f64,
    /// The last pose.
    pub pose: Se2,
    /// Standard deviation of its position along the weakest direction [m].
    pub sigma: f64,
    /// Root mean square distance of the positions while standing from their mean [m].
    pub scatter: f64,
    /// Landmarks paired in the mean.
    pub matched: f64,
}

/// The halts of a drive.
pub(super) fn halts(track: &[Fix]) -> Vec<Halt> {
    let stands = |fix: &Fix| fix.distance < STILL.0 && fix.turn < STILL.1;
    track
        .chunk_by(|a, b| stands(a) == stands(b))
        .filter(|run| run.first().is_some_and(stands))
        .filter_map(halt)
        .collect()
}

fn halt(run: &[Fix]) -> Option<Halt> {
    let (first, last) = (run.first()?, run.last()?);
    if last.stamp - first.stamp < LEAST {
        return None;
    }
    let settled = || run.iter().filter(|fix| fix.stamp >= first.stamp + SETTLING).map(|fix| fix.pose.translation);
    let n = settled().count() as f64;
    let mean = settled().sum::<Vector2<f64>>() / n;
    let square = settled().map(|p| (p - mean).norm_squared()).sum::<f64>() / n;
    let matched = run.iter().map(|fix| fix.quality.matched as f64).sum::<f64>() / run.len() as f64;
    let sigma = last.quality.sigma_position;
    Some(Halt { from: first.stamp, to: last.stamp, pose: last.pose, sigma, scatter: square.sqrt(), matched })
}

#[cfg(test)]
mod tests {
    use super::super::track::test_track::{moving, standing};
    use super::*;

    #[test]
    fn a_stop_of_seconds_is_a_halt_and_a_pause_is_none() {
        let track = [moving(2.0), standing(3.0), moving(2.0), standing(0.5), moving(1.0)].concat();
        let found = halts(&super::super::track::test_track::timed(track, 0.1));
        assert_eq!(found.len(), 1);
        assert!((found[0].to - found[0].from - 2.9).abs() < 1e-9 && (found[0].from - 102.0).abs() < 0.11);
    }

    #[test]
    fn creeping_is_no_halt_and_turning_on_the_spot_neither() {
        let mut creeping = standing(3.0);
        creeping.iter_mut().for_each(|fix| fix.distance = 0.002);
        let mut turning = standing(3.0);
        turning.iter_mut().for_each(|fix| fix.turn = 0.002);
        let timed = |track| super::super::track::test_track::timed(track, 0.1);
        assert!(halts(&timed(creeping)).is_empty() && halts(&timed(turning)).is_empty());
        assert!(halts(&[]).is_empty());
    }

    #[test]
    fn scatter_is_that_of_the_positions_in_both_directions() {
        let mut track = super::super::track::test_track::timed(standing(4.0), 0.1);
        for (k, fix) in track.iter_mut().enumerate() {
            let (a, b) = (if k % 2 == 0 { 0.003 } else { -0.003 }, if k % 4 < 2 { 0.004 } else { -0.004 });
            fix.pose = Se2::new(5.0 + a, 2.0 + b, 0.1);
            fix.quality.matched = k % 2 * 4;
        }
        let found = halts(&track);
        assert!((found[0].scatter - 0.005).abs() < 3e-4, "{}", found[0].scatter);
        assert!((found[0].matched - 2.0).abs() < 0.1);
        assert_eq!(found[0].pose, track[track.len() - 1].pose);
    }

    #[test]
    fn the_sway_of_coming_to_a_halt_is_no_scatter_of_a_short_one() {
        let mut track = super::super::track::test_track::timed(standing(2.0), 0.1);
        track[..2].iter_mut().for_each(|fix| fix.pose = Se2::new(0.05, 1.0, 0.0));
        assert!(halts(&track)[0].scatter < 1e-9, "{}", halts(&track)[0].scatter);
    }
}

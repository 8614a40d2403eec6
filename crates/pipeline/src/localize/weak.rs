//! Stretches of a drive where the pose is poorly held, and why.

use super::track::Fix;
use groma_localization::Status;

/// A stretch lasts so long at least [s].
const LEAST: f64 = 0.5;
/// A direction is open when the last scan alone holds it no better than this [m].
const OPEN: f64 = 0.1;
/// Landmarks disagree when the squared innovations are so many times what they should be.
const DISAGREES: f64 = 3.0;

/// Why a pose is poorly held, what matters most first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Why {
    /// It is not known.
    Lost,
    /// No landmark holds it.
    Coasting,
    /// The landmarks do not fit each other.
    Disagreeing,
    /// The landmarks in view do not determine a direction.
    Open,
}

impl Why {
    /// For a person.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Lost => "the pose is not known",
            Self::Coasting => "no landmark constrains the pose",
            Self::Disagreeing => "the landmarks disagree",
            Self::Open => "few landmarks in view",
        }
    }

    fn of(fix: &Fix) -> Option<Self> {
        let q = &fix.quality;
        match q.status {
            Status::Lost => Some(Self::Lost),
            Status::Coasting => Some(Self::Coasting),
            Status::Tracking if q.dof > 0 && q.nis > DISAGREES * q.dof as f64 => Some(Self::Disagreeing),
            Status::Tracking => (q.geometry > OPEN).then_some(Self::Open),
        }
    }
}

/// A stretch of the drive where the pose is poorly held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weak {
    /// First stamp [s].
    pub from: f64,
    /// Last stamp [s].
    pub to: f64,
    /// Where it is worst [m].
    pub place: [f64; 2],
    /// Standard deviation of the position there [m].
    pub sigma: f64,
    /// Why.
    pub why: Why,
}

/// The weak stretches of a drive in order of time.
pub(super) fn weak_stretches(track: &[Fix]) -> Vec<Weak> {
    track.chunk_by(|a, b| Why::of(a) == Why::of(b)).filter_map(stretch).collect()
}

fn stretch(run: &[Fix]) -> Option<Weak> {
    let (first, last) = (run.first()?, run.last()?);
    let why = Why::of(first).filter(|_| last.stamp - first.stamp >= LEAST)?;
    let worse = |a: &Fix, b: &Fix| b.quality.sigma_position > a.quality.sigma_position;
    let worst = run.iter().fold(first, |a, b| if worse(a, b) { b } else { a });
    let place = [worst.pose.x(), worst.pose.y()];
    Some(Weak { from: first.stamp, to: last.stamp, place, sigma: worst.quality.sigma_position, why })
}

#[cfg(test)]
mod tests {
    use super::super::track::test_track::{moving, timed};
    use super::*;

    #[test]
    fn each_reason_is_told_with_its_time() {
        let mut track = timed(moving(6.0), 0.1);
        track[5..15].iter_mut().for_each(|fix| fix.quality.status = Status::Lost);
        track[20..30].iter_mut().for_each(|fix| fix.quality.status = Status::Coasting);
        track[35..45].iter_mut().for_each(|fix| fix.quality.nis = 5.0 * fix.quality.dof as f64);
        track[50..60].iter_mut().for_each(|fix| fix.quality.geometry = f64::INFINITY);
        let found = weak_stretches(&track);
        let reasons: Vec<Why> = found.iter().map(|w| w.why).collect();
        assert_eq!(reasons, [Why::Lost, Why::Coasting, Why::Disagreeing, Why::Open]);
        for (weak, first) in found.iter().zip([5, 20, 35, 50]) {
            assert_eq!((weak.from, weak.to), (track[first].stamp, track[first + 9].stamp));
        }
    }

    #[test]
    fn a_moment_is_no_stretch_and_what_is_held_well_none() {
        let mut track = timed(moving(3.0), 0.1);
        assert!(weak_stretches(&track).is_empty());
        track[10..13].iter_mut().for_each(|fix| fix.quality.status = Status::Coasting);
        assert!(weak_stretches(&track).is_empty());
    }

    #[test]
    fn the_place_is_where_it_is_worst() {
        let mut track = timed(moving(3.0), 0.1);
        track.iter_mut().for_each(|fix| fix.quality.status = Status::Coasting);
        track[17].quality.sigma_position = 0.7;
        let found = weak_stretches(&track);
        assert_eq!((found[0].sigma, found[0].place), (0.7, [track[17].pose.x(), track[17].pose.y()]));
    }
}

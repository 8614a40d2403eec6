//! Promotion of persistent landmarks: those observed on several days and missing in the static map.
//!
//! Days are taken in their order. What is one mark as a landmark of the map ([`crate::pairing`]) confirms it; of the rest,
//! what was dependable that day goes on with the mark of the days before that it is one with, else begins a new one. A mark
//! thus counts at most once per day.
//!
//! ```text
//! dependable   detected LEAST_SEEN times that day, and in the share that the options ask of the scans that had it in view
//! lasting      dependable on so many days as the options ask
//! x = S^-1 sum P_d^-1 x_d,   S = sum P_d^-1
//! P = S^-1 max(1, chi^2 / (2 (n - 1))),   chi^2 = sum (x_d - x)^T P_d^-1 (x_d - x),   n days
//! ```
//!
//! The last line is Birge's ratio ("The calculation of errors by the method of least squares", Phys. Rev. 40, 1932): the
//! covariance is widened by as much as the days differ by more than they say, never narrowed. The orientation is that of
//! the mean unit vector, the counts are sums, the descriptor is that of the first day.
//!
//! Assumes that the days are independent: an error that all share, of the map above all, is in no covariance here. The
//! landmarks of the map stay as they are, and none is taken away: what is gone is never paired, and localization tells how
//! often each was.

use crate::pairing::pairs;
use groma_models::finding::Code;
use groma_models::{Finding, Landmark, LandmarkMap, ModelError};
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// Scans of a day that must have detected it.
const LEAST_SEEN: u32 = 5;

/// Settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// Days on which a mark must have been seen, two at least: what one day saw may be gone the next.
    pub days: usize,
    /// Of the scans of a day that had a mark in view, the share that must have detected it. Where vehicles or goods often
    /// stand before it, less.
    pub share: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { days: 2, share: 0.5 }
    }
}

impl Options {
    /// Refuses what is out of range.
    ///
    /// # Errors
    /// [`ModelError::Setting`], which names it.
    pub fn validate(&self) -> Result<(), ModelError> {
        if self.days < 2 {
            let rule = "must be at least 2: what one day saw may be gone the next";
            return Err(ModelError::Setting { name: "days", value: self.days as f64, rule });
        }
        let is_share = self.share > 0.0 && self.share <= 1.0;
        let refused = || ModelError::Setting { name: "share", value: self.share, rule: "must be above 0, at most 1" };
        is_share.then_some(()).ok_or_else(refused)
    }
}

/// The new map and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Promotion {
    /// The landmarks of the map, then the promoted ones in the order of their first day.
    pub map: LandmarkMap,
    /// How many were promoted.
    pub promoted: usize,
    /// Landmarks of the map that some day saw.
    pub confirmed: usize,
    /// What was noticed.
    pub findings: Vec<Finding>,
}

/// Adds to `map` what several `days` saw, in its frame, and it lacks.
///
/// # Errors
/// A setting out of range, or fewer days than it asks for.
pub fn promote(map: &LandmarkMap, days: &[LandmarkMap], options: &Options) -> Result<Promotion, ModelError> {
    options.validate()?;
    if days.len() < options.days {
        let rule = "there must be at least as many as a mark must have been seen on";
        return Err(ModelError::Setting { name: "drives", value: days.len() as f64, rule });
    }
    let mut confirmed = vec![false; map.landmarks.len()];
    let mut tracks: Vec<Vec<Landmark>> = Vec::new();
    for day in days {
        let mut known = vec![false; day.landmarks.len()];
        for (at, seen) in pairs(&map.landmarks, &day.landmarks) {
            (confirmed[at], known[seen]) = (true, true);
        }
        let fresh =
            day.landmarks.iter().zip(known).filter(|(mark, known)| !known && is_dependable(mark, options.share));
        follow(&mut tracks, fresh.map(|(mark, _)| mark.clone()).collect());
    }
    let lasting: Vec<Landmark> =
        tracks.iter().filter(|track| track.len() >= options.days).filter_map(|track| fused(track)).collect();
    let confirmed = confirmed.into_iter().filter(|c| *c).count();
    let findings = findings(map, days, confirmed);
    let promoted = lasting.len();
    let landmarks = map.landmarks.iter().cloned().chain(lasting).collect();
    Ok(Promotion { map: LandmarkMap { landmarks }, promoted, confirmed, findings })
}

/// Whether a mark was detected often enough on its day, at a place that is known.
fn is_dependable(mark: &Landmark, share: f64) -> bool {
    let often = mark.seen >= LEAST_SEEN && f64::from(mark.seen) >= share * f64::from(mark.visible);
    often && is_usable(mark)
}

/// Whether the numbers of a mark are a place with a covariance.
fn is_usable(mark: &Landmark) -> bool {
    let finite = mark.position.iter().chain(mark.covariance.iter()).all(|v| v.is_finite());
    finite && mark.covariance.cholesky().is_some()
}

/// Lets each mark of a day go on with a track of the days before, or begin one.
fn follow(tracks: &mut Vec<Vec<Landmark>>, day: Vec<Landmark>) {
    let ends: Vec<Landmark> = tracks.iter().filter_map(|track| track.last().cloned()).collect();
    let mut track_of = vec![None; day.len()];
    for (track, mark) in pairs(&ends, &day) {
        track_of[mark] = Some(track);
    }
    for (mark, track) in day.into_iter().zip(track_of) {
        match track {
            Some(track) => tracks[track].push(mark),
            None => tracks.push(vec![mark]),
        }
    }
}

/// One landmark of what several days saw; none if its covariance is beyond the numbers.
fn fused(days: &[Landmark]) -> Option<Landmark> {
    let first = days.first()?;
    // From the first: coordinates far from the origin would cost digits.
    let apart = |mark: &Landmark| mark.position - first.position;
    let (mut information, mut weighted) = (Matrix2::zeros(), Vector2::zeros());
    for mark in days {
        let w = mark.covariance.try_inverse()?;
        information += w;
        weighted += w * apart(mark);
    }
    let covariance = information.try_inverse()?;
    let mean = covariance * weighted;
    let chi_square = |mark: &Landmark| {
        let e = apart(mark) - mean;
        mark.covariance.try_inverse().map_or(0.0, |w| e.dot(&(w * e)))
    };
    let freedom = 2.0 * days.len().saturating_sub(1).max(1) as f64;
    let widened = (days.iter().map(chi_square).sum::<f64>() / freedom).max(1.0);
    Some(Landmark {
        position: first.position + mean,
        covariance: covariance * widened,
        orientation: orientation(days),
        seen: days.iter().fold(0, |sum, mark| mark.seen.saturating_add(sum)),
        visible: days.iter().fold(0, |sum, mark| mark.visible.saturating_add(sum)),
        ..first.clone()
    })
}

/// The direction of the mean unit vector; none if a day measured none.
fn orientation(days: &[Landmark]) -> Option<f64> {
    let unit = |mark: &Landmark| mark.orientation.map(|angle| Vector2::new(angle.cos(), angle.sin()));
    let sum = days.iter().map(unit).sum::<Option<Vector2<f64>>>()?;
    Some(sum.y.atan2(sum.x))
}

fn findings(map: &LandmarkMap, days: &[LandmarkMap], confirmed: usize) -> Vec<Finding> {
    let mut findings = Vec::new();
    let all = map.landmarks.len();
    let unusable = days.iter().flat_map(|day| &day.landmarks).filter(|mark| !is_usable(mark)).count();
    if unusable > 0 {
        let text = format!("{unusable} landmarks of the drives have no covariance that can be used and were left out");
        findings.push(Finding::new(Code::ValuesInvalid, text).with("landmarks", unusable as f64, "1"));
    }
    if all > 0 && confirmed == 0 {
        let text = format!("none of the {all} landmarks of the map was seen on any of {} drives", days.len());
        findings.push(Finding::new(Code::MapMismatch, text).with("landmarks", all as f64, "1"));
    } else if confirmed < all {
        let unseen = all - confirmed;
        let text = format!("{unseen} of the {all} landmarks of the map were seen on none of the drives");
        findings.push(Finding::new(Code::LandmarksUnseen, text).with("landmarks", unseen as f64, "1"));
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::LandmarkKind;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    const CM: f64 = 1e-4;

    fn corner(x: f64, y: f64) -> Landmark {
        Landmark {
            kind: LandmarkKind::Corner,
            position: Vector2::new(x, y),
            covariance: Matrix2::identity() * CM,
            orientation: Some(0.0),
            descriptor: Some(7),
            seen: 20,
            visible: 25,
        }
    }

    fn map(landmarks: Vec<Landmark>) -> LandmarkMap {
        LandmarkMap { landmarks }
    }

    fn corners(points: &[(f64, f64)]) -> LandmarkMap {
        map(points.iter().map(|&(x, y)| corner(x, y)).collect())
    }

    fn promoted(days: &[LandmarkMap]) -> Vec<Landmark> {
        promote(&LandmarkMap::default(), days, &Options::default()).unwrap().map.landmarks
    }

    #[test]
    fn what_two_days_saw_joins_after_what_is_there_and_what_one_saw_does_not() {
        let before = corners(&[(0.0, 0.0)]);
        let days = [
            corners(&[(0.01, 0.0), (5.0, 5.0), (9.0, 9.0)]),
            corners(&[(5.01, 5.0), (0.0, 0.02)]),
            corners(&[(5.02, 5.0)]),
        ];
        let result = promote(&before, &days, &Options::default()).unwrap();
        assert_eq!((result.promoted, result.confirmed), (1, 1));
        assert_eq!(result.map.landmarks[0], before.landmarks[0]);
        let new = &result.map.landmarks[1];
        assert!((new.position - Vector2::new(5.01, 5.0)).norm() < 1e-12);
        assert!((new.covariance - Matrix2::identity() * CM / 3.0).amax() < 1e-15, "three days average");
        assert_eq!((new.seen, new.visible, new.descriptor), (60, 75, Some(7)));
        assert_eq!(result.findings, []);
    }

    #[test]
    fn more_days_may_be_requested() {
        let days = [corners(&[(5.0, 5.0)]), corners(&[(5.0, 5.0)]), corners(&[(1.0, 1.0)])];
        let count =
            |least| promote(&map(vec![]), &days, &Options { days: least, ..Options::default() }).map(|r| r.promoted);
        assert_eq!((count(2), count(3)), (Ok(1), Ok(0)));
        assert!(count(1).unwrap_err().to_string().contains("days"));
        assert!(count(4).unwrap_err().to_string().contains("drives = 3"));
    }

    #[test]
    fn marks_that_are_often_hidden_join_where_a_smaller_share_is_requested() {
        let mut day = corners(&[(5.0, 5.0)]);
        (day.landmarks[0].seen, day.landmarks[0].visible) = (20, 80);
        let days = [day.clone(), day];
        let count = |share| promote(&map(vec![]), &days, &Options { share, ..Options::default() }).map(|r| r.promoted);
        assert_eq!((count(1.0), count(0.5), count(0.25), count(0.2)), (Ok(0), Ok(0), Ok(1), Ok(1)));
        for wrong in [0.0, 1.1, f64::NAN] {
            assert!(count(wrong).unwrap_err().to_string().contains("share"));
        }
    }

    #[test]
    fn two_marks_of_one_day_are_not_two_days() {
        assert_eq!(promoted(&[corners(&[(5.0, 5.0), (5.05, 5.0)]), corners(&[])]), []);
        let twins = [corners(&[(5.0, 5.0), (5.1, 5.0)]), corners(&[(5.1, 5.0), (5.0, 5.0)])];
        assert_eq!(promoted(&twins).len(), 2);
        let first = promoted(&[corners(&[(5.0, 5.0)]), corners(&[(5.04, 5.0), (5.02, 5.0)])]);
        assert_eq!(first.len(), 1);
        assert!((first[0].position.x - 5.01).abs() < 1e-12, "the nearer of the two goes on with it");
    }

    #[test]
    fn a_mark_goes_on_with_the_last_day_that_saw_it() {
        let days = [0.0, 0.15, 0.3].map(|x| corners(&[(x, 5.0)]));
        let options = Options { days: 3, ..Options::default() };
        assert_eq!(promote(&map(vec![]), &days, &options).unwrap().promoted, 1);
    }

    #[test]
    fn days_that_differ_widen_the_covariance_and_days_that_agree_do_not_narrow_it() {
        // Each day is 5 sigma off the mean: chi-square 50 for two degrees of freedom.
        let apart = promoted(&[corners(&[(0.0, 0.0)]), corners(&[(0.1, 0.0)])]);
        assert!((apart[0].covariance - Matrix2::identity() * (CM / 2.0 * 25.0)).amax() < 1e-12);
        let same = promoted(&[corners(&[(0.0, 0.0)]), corners(&[(0.0, 0.0)])]);
        assert!((same[0].covariance - Matrix2::identity() * (CM / 2.0)).amax() < 1e-15);
    }

    #[test]
    fn the_better_day_counts_for_more_along_each_axis() {
        let (mut along, mut across) = (corner(0.0, 0.0), corner(0.01, 0.01));
        along.covariance = Matrix2::new(CM, 0.0, 0.0, 9.0 * CM);
        across.covariance = Matrix2::new(9.0 * CM, 0.0, 0.0, CM);
        let mean = promoted(&[map(vec![along]), map(vec![across])]).remove(0).position;
        assert!((mean - Vector2::new(0.001, 0.009)).norm() < 1e-12);
    }

    #[test]
    fn orientations_are_averaged_across_half_a_turn() {
        let turned = |angle| {
            let mark = Landmark { orientation: Some(angle), ..corner(2.0, 2.0) };
            map(vec![mark])
        };
        let mean = promoted(&[turned(PI - 0.1), turned(-PI + 0.3)]).remove(0).orientation.unwrap();
        assert!((mean - (-PI + 0.1)).abs() < 1e-12);
        let reflector = Landmark { orientation: None, kind: LandmarkKind::Reflector, ..corner(2.0, 2.0) };
        assert_eq!(promoted(&[map(vec![reflector.clone()]), map(vec![reflector])])[0].orientation, None);
    }

    #[test]
    fn what_is_rarely_detected_does_not_join() {
        let day = |seen, visible| map(vec![Landmark { seen, visible, ..corner(5.0, 5.0) }]);
        for (seen, visible, joins) in [(5, 20, false), (9, 20, false), (11, 20, true), (4, 4, false), (5, 5, true)] {
            let count = promoted(&[day(seen, visible), day(seen, visible)]).len();
            assert_eq!(count == 1, joins, "{seen} of {visible}");
        }
        assert_eq!(promoted(&[day(20, 25), day(5, 20)]), [], "a day on which it is hardly found does not count");
    }

    #[test]
    fn what_the_map_has_is_not_promoted_a_second_time() {
        let day = corners(&[(0.1, 0.0), (3.0, 0.0)]);
        let result = promote(&corners(&[(0.0, 0.0)]), &[day.clone(), day], &Options::default()).unwrap();
        assert_eq!((result.promoted, result.confirmed, result.map.landmarks.len()), (1, 1, 2));
    }

    #[test]
    fn landmarks_that_no_drive_saw_are_told_and_a_map_of_elsewhere_decides_the_verdict() {
        let told = |before: &LandmarkMap| {
            let day = corners(&[(0.0, 0.0)]);
            let result = promote(before, &[day.clone(), day], &Options::default()).unwrap();
            result.findings.iter().map(|f| (f.code, f.values[0].value)).collect::<Vec<_>>()
        };
        assert_eq!(told(&corners(&[(0.0, 0.0), (50.0, 0.0), (51.0, 0.0)])), [(Code::LandmarksUnseen, 2.0)]);
        assert_eq!(told(&corners(&[(50.0, 0.0), (51.0, 0.0)])), [(Code::MapMismatch, 2.0)]);
        assert_eq!(told(&map(vec![])), []);
    }

    #[test]
    fn a_mark_without_a_covariance_is_counted_and_left_out() {
        let flat = Landmark { covariance: Matrix2::zeros(), ..corner(1.0, 1.0) };
        let lost = Landmark { position: Vector2::new(f64::NAN, 0.0), ..corner(1.0, 1.0) };
        let negative = Landmark { covariance: Matrix2::identity() * -CM, ..corner(3.0, 1.0) };
        let open = Landmark { covariance: Matrix2::new(f64::INFINITY, 0.0, 0.0, CM), ..corner(5.0, 1.0) };
        let day = map(vec![flat, lost, negative, open]);
        let result = promote(&map(vec![]), &[day.clone(), day], &Options::default()).unwrap();
        assert_eq!((result.promoted, result.findings.len()), (0, 1));
        assert_eq!((result.findings[0].code, result.findings[0].values[0].value), (Code::ValuesInvalid, 8.0));
    }

    proptest! {
        /// Marks on a lattice a metre wide, each day a little off: the days may come in any order.
        #[test]
        fn the_order_of_the_days_only_orders_the_new_marks(
            days in prop::collection::vec(
                prop::collection::vec((0..4_u8, 0..4_u8, -0.04..0.04_f64, -0.04..0.04_f64), 0..12), 2..5),
        ) {
            let day = |marks: &Vec<(u8, u8, f64, f64)>| {
                let mut marks = marks.clone();
                marks.sort_by_key(|m| (m.0, m.1));
                marks.dedup_by_key(|m| (m.0, m.1));
                corners(&marks.iter().map(|m| (f64::from(m.0) + m.2, f64::from(m.1) + m.3)).collect::<Vec<_>>())
            };
            let days: Vec<LandmarkMap> = days.iter().map(day).collect();
            let sorted = |days: &[LandmarkMap]| {
                let mut all = promoted(days);
                let cell = |m: &Landmark| (m.position.x.round() as i64, m.position.y.round() as i64);
                all.sort_by_key(cell);
                all
            };
            let (forth, back) = (sorted(&days), sorted(&days.iter().rev().cloned().collect::<Vec<_>>()));
            prop_assert_eq!(forth.len(), back.len());
            for (a, b) in forth.iter().zip(&back) {
                prop_assert!((a.position - b.position).norm() < 1e-12);
                prop_assert!((a.covariance - b.covariance).amax() < 1e-12);
                prop_assert_eq!((a.seen, a.visible), (b.seen, b.visible));
            }
        }
    }
}

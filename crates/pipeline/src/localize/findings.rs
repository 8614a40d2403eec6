//! What is noticed about a localized drive.

use super::result::Localized;
use super::weak::{Weak, Why};
use crate::order::Order;
use groma_models::Finding;
use groma_models::finding::Code;

/// Motions that come so much later than the scans are worth a word [s].
const LATE: f64 = 0.1;
/// Stretches of a kind that are told one by one.
const MOST: usize = 10;

/// All findings, the weightiest first.
pub(super) fn findings(result: &Localized, order: &Order, jumps: &[f64]) -> Vec<Finding> {
    let mut found = Vec::new();
    match result.found_after() {
        None => found.push(never_found(result)),
        Some(_) => found.extend(weak_stretches(&result.weak)),
    }
    found.extend(missing(result));
    found.extend(jumped(jumps));
    found.extend(late_motions(result));
    found.extend(order.findings());
    found
}

fn never_found(result: &Localized) -> Finding {
    let driven: f64 = result.track.iter().map(|fix| fix.distance).sum();
    let scans = result.track.len();
    let found = Finding::new(Code::NeverFound, format!("no place of the map fits what {scans} scans saw"));
    spanned(found.with("scans", scans as f64, "1").with("driven", driven, "m"), result)
}

fn spanned(finding: Finding, result: &Localized) -> Finding {
    match (result.track.first(), result.track.last()) {
        (Some(first), Some(last)) => finding.during(first.stamp, last.stamp),
        _ => finding,
    }
}

/// The longest stretches of each kind one by one, the others counted.
fn weak_stretches(all: &[Weak]) -> Vec<Finding> {
    let mut found = Vec::new();
    for code in [Code::PoseLost, Code::LandmarksDisagree, Code::WeakStretch] {
        let mut stretches: Vec<&Weak> = all.iter().filter(|weak| code_of(weak.why) == code).collect();
        stretches.sort_by(|a, b| (b.to - b.from).total_cmp(&(a.to - a.from)));
        found.extend(stretches.iter().take(MOST).map(|weak| stretch(code, weak)));
        let others = stretches.len().saturating_sub(MOST);
        if others > 0 {
            let text = format!("{others} more stretches like these, none longer");
            found.push(Finding::new(code, text).with("stretches", others as f64, "1"));
        }
    }
    found
}

fn code_of(why: Why) -> Code {
    match why {
        Why::Lost => Code::PoseLost,
        Why::Disagreeing => Code::LandmarksDisagree,
        Why::Coasting | Why::Open => Code::WeakStretch,
    }
}

fn stretch(code: Code, stretch: &Weak) -> Finding {
    let seconds = stretch.to - stretch.from;
    let text = format!("{} for {seconds:.1} s", stretch.why.text());
    let [x, y] = stretch.place;
    let found = Finding::new(code, text).during(stretch.from, stretch.to).at(x, y);
    found.with("duration", seconds, "s").with("sigma_position", stretch.sigma, "m")
}

fn missing(result: &Localized) -> Option<Finding> {
    let none = result.counts.odometry_read + result.counts.wheels_read == 0;
    none.then(|| Finding::new(Code::OdometryMissing, "no motion was reported: poses go on from scan to scan"))
}

fn jumped(jumps: &[f64]) -> Option<Finding> {
    let (first, last) = (jumps.first()?, jumps.last()?);
    let count = jumps.len();
    let text = format!("{count} steps of the odometry are longer than a robot drives");
    Some(Finding::new(Code::OdometryJump, text).during(*first, *last).with("steps", count as f64, "1"))
}

fn late_motions(result: &Localized) -> Option<Finding> {
    let late = || result.track.iter().filter(|fix| fix.extrapolated > LATE);
    let (first, last) = (late().next()?, late().next_back()?);
    let (count, corrected) = (late().count(), result.corrected());
    let longest = late().map(|fix| fix.extrapolated).fold(0.0, f64::max);
    let text = format!(
        "{count} scans came up to {longest:.2} s before the motion that covers them: their poses were extrapolated, and \
         {corrected} corrected later"
    );
    let found = Finding::new(Code::OdometryLate, text).during(first.stamp, last.stamp);
    Some(found.with("scans", count as f64, "1").with("corrected", corrected as f64, "1").with("longest", longest, "s"))
}

#[cfg(test)]
mod tests {
    use super::super::result::Counts;
    use super::super::track::test_track::{moving, timed};
    use super::*;
    use crate::message::Message;
    use groma_geometry::Se2;
    use groma_localization::Status;
    use groma_models::Odometry;
    use groma_models::finding::{Kind, verdict};

    fn judged(change: impl Fn(&mut super::super::Fix, usize)) -> (Vec<Finding>, &'static str) {
        let mut track = timed(moving(5.0), 0.1);
        track.iter_mut().enumerate().for_each(|(k, fix)| change(fix, k));
        let counts = Counts { odometry_read: 9, ..Counts::default() };
        let found = findings(&Localized::new(track, 3, None, counts), &Order::new(0.0), &[]);
        let codes: Vec<Code> = found.iter().map(|f| f.code).collect();
        (found, verdict(Kind::Localization, &codes))
    }

    #[test]
    fn a_good_drive_has_none() {
        assert_eq!(judged(|_, _| ()), (Vec::new(), "tracked"));
    }

    #[test]
    fn a_vehicle_that_is_never_found_forces_the_verdict() {
        let (found, word) = judged(|fix, _| fix.quality.status = Status::Lost);
        assert_eq!((found.len(), found[0].code, word), (1, Code::NeverFound, "not-found"));
        assert!(found[0].span.unwrap().1 - found[0].span.unwrap().0 > 4.8);
    }

    #[test]
    fn where_and_when_the_pose_was_lost_is_told() {
        let (found, _) = judged(|fix, k| {
            if (20..30).contains(&k) {
                (fix.quality.status, fix.quality.sigma_position) = (Status::Lost, 1.5);
            }
        });
        assert_eq!(found[0].code, Code::PoseLost);
        assert!((found[0].span.unwrap().0 - 102.0).abs() < 1e-9 && (found[0].place.unwrap()[0] - 1.05).abs() < 1e-9);
        assert!(found[0].values.iter().any(|v| v.unit == "m" && v.value == 1.5));
    }

    #[test]
    fn motions_that_come_late_are_told_and_those_a_little_late_are_not() {
        let late = |by: f64| judged(move |fix, k| fix.extrapolated = if k > 9 { by } else { 0.0 }).0;
        assert!(late(0.02).is_empty());
        let found = late(0.35);
        assert_eq!(found[0].code, Code::OdometryLate);
        assert!(found[0].text.contains("40 scans") && found[0].text.contains("0.35 s"));
    }

    #[test]
    fn what_was_left_out_is_reported_by_kind() {
        let mut order = Order::new(0.0);
        for stamp in [1.0, 2.0, 1.5, 2.0, f64::NAN] {
            order.push(Message::Odometry(Odometry { stamp, pose: Se2::IDENTITY }));
        }
        let result = Localized::new(timed(moving(1.0), 0.1), 0, None, Counts::default());
        let found = findings(&result, &order, &[3.0, 4.0]);
        let codes: Vec<Code> = found.iter().map(|f| f.code).collect();
        for code in [Code::OdometryMissing, Code::OdometryJump, Code::StampsLate, Code::StampsInvalid] {
            assert!(codes.contains(&code), "{}", code.name());
        }
        assert!(found.iter().any(|f| f.code == Code::StampsLate && f.span == Some((1.5, 1.5))));
    }
}

//! Which motions count, and why the others do not.

use super::coupling::couplings;
use super::standstill::Rates;
use groma_calibration::vehicle::{Motion, Motions};
use groma_egomotion::Verdict;
use groma_geometry::Se2;
use groma_models::WheelLog;
use nalgebra::Matrix3;

/// A motion this near to a break of the wheels is left out: a delay may reach across [s].
const BREAK_MARGIN: f64 = 0.2;

/// Why a motion was left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reason {
    /// No scan was taken at one of its ends.
    Unseen,
    /// Its ends have too little in view in common.
    Apart,
    /// No surface constrains one direction.
    Open,
    /// The scans of its ends could not be registered to each other.
    Astray,
    /// No pose of the sensor at one of its ends.
    NoPose,
    /// No wheels at one of its ends.
    NoWheels,
    /// The readings of the wheels are broken on the way.
    Broken,
    /// The wheels stood.
    Stood,
}

impl Reason {
    /// In words.
    #[must_use]
    pub fn text(self) -> &'static str {
        match self {
            Self::Unseen => "no scan at one of its ends",
            Self::Apart => "its ends have too little in view in common",
            Self::Open => "no surface constrains one direction: a corridor, an open space",
            Self::Astray => "the scans of its ends could not be registered to each other",
            Self::NoPose => "no pose at one of its ends",
            Self::NoWheels => "no wheels at one of their ends",
            Self::Broken => "the readings of the wheels are broken on the way",
            Self::Stood => "the wheels stood",
        }
    }
}

/// A motion before the gates.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) motion: Se2,
    /// The whole turn [rad].
    pub(super) turn: f64,
    pub(super) covariance: Option<Matrix3<f64>>,
    pub(super) reason: Option<Reason>,
}

impl From<&groma_egomotion::Motion> for Candidate {
    fn from(found: &groma_egomotion::Motion) -> Self {
        let reason = match found.verdict {
            Verdict::Good => None,
            Verdict::Unseen => Some(Reason::Unseen),
            Verdict::Apart => Some(Reason::Apart),
            Verdict::Open => Some(Reason::Open),
            Verdict::Astray => Some(Reason::Astray),
        };
        let (m, covariance) = (found.motion, Some(found.covariance));
        Self { start: found.start, end: found.end, motion: Se2::new(m.x, m.y, m.z), turn: m.z, covariance, reason }
    }
}

/// A motion that does not count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeftOut {
    /// Why.
    pub reason: Reason,
    /// When it began and ended [s].
    pub span: (f64, f64),
}

/// The motions that count, with what neighbours share, and those that do not.
pub(super) fn gated(
    candidates: &[Candidate],
    log: &WheelLog,
    breaks: &[(f64, f64)],
    rates: &Rates,
) -> (Motions, Vec<LeftOut>) {
    let (mut motions, mut covariances, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
    for c in candidates {
        if let Some(reason) = c.reason.or_else(|| objection(c, log, breaks, rates)) {
            left_out.push(LeftOut { reason, span: (c.start, c.end) });
            continue;
        }
        motions.push(Motion { start: c.start, end: c.end, motion: c.motion, turn: c.turn });
        covariances.extend(c.covariance);
    }
    let stated = !covariances.is_empty() && covariances.len() == motions.len();
    let couplings = stated.then(|| couplings(&motions, &covariances));
    (Motions { couplings, covariances: stated.then_some(covariances), motions }, left_out)
}

fn objection(c: &Candidate, log: &WheelLog, breaks: &[(f64, f64)], rates: &Rates) -> Option<Reason> {
    let (first, last) = log.span();
    let across = |(from, to): &(f64, f64)| c.start < to + BREAK_MARGIN && c.end > from - BREAK_MARGIN;
    if c.start < first || c.end > last {
        Some(Reason::NoWheels)
    } else if breaks.iter().any(across) {
        Some(Reason::Broken)
    } else {
        (!rates.turned(log, c.start, c.end)).then_some(Reason::Stood)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::WheelKind;
    use nalgebra::Vector2;

    /// Ten seconds at a steady pace, standing from 4 s to 6 s.
    fn log() -> WheelLog {
        let time: Vec<f64> = (0..=500).map(|k| 0.02 * f64::from(k)).collect();
        let count = |t: f64| if t < 4.0 { t } else { 4.0 + (t - 6.0).max(0.0) };
        let readings = time.iter().map(|t| Vector2::new(10.0 * count(*t), -10.0 * count(*t))).collect();
        WheelLog::new(WheelKind::Differential, time, readings).unwrap()
    }

    fn from_to(start: f64, end: f64) -> Candidate {
        let covariance = Some(Matrix3::identity() * 1e-6);
        Candidate { start, end, motion: Se2::new(0.3, 0.1, 0.2), turn: 0.2, covariance, reason: None }
    }

    #[test]
    fn what_does_not_count_has_a_reason_and_a_time() {
        let log = log();
        let breaks = [(8.0, 8.02)];
        let astray = Candidate { reason: Some(Reason::Astray), ..from_to(0.5, 1.0) };
        let all = [
            astray,
            from_to(1.0, 2.0),
            from_to(2.0, 3.0),
            from_to(4.2, 5.8),
            from_to(7.0, 7.85),
            from_to(8.2, 9.0),
            from_to(8.3, 9.0),
            from_to(9.5, 10.5),
            from_to(-0.1, 0.5),
        ];
        let (used, left_out) = gated(&all, &log, &breaks, &Rates::new(&log, &breaks));
        let times: Vec<_> = used.motions.iter().map(|m| m.start).collect();
        assert_eq!(times, [1.0, 2.0, 8.3]);
        let reasons: Vec<_> = left_out.iter().map(|l| (l.reason, l.span.0)).collect();
        let expected = [
            (Reason::Astray, 0.5),
            (Reason::Stood, 4.2),
            (Reason::Broken, 7.0),
            (Reason::Broken, 8.2),
            (Reason::NoWheels, 9.5),
            (Reason::NoWheels, -0.1),
        ];
        assert_eq!(reasons, expected);
        let shared = used.couplings.unwrap();
        assert!(shared[0].norm() > 0.0 && shared[1].norm() == 0.0, "neighbours of those that count");
    }

    #[test]
    fn motions_of_unknown_covariance_share_nothing_that_is_known() {
        let log = log();
        let unknown = |s: f64| Candidate { covariance: None, ..from_to(s, s + 1.0) };
        let (used, _) = gated(&[unknown(1.0), unknown(2.0)], &log, &[], &Rates::new(&log, &[]));
        assert!(used.covariances.is_none() && used.couplings.is_none() && used.motions.len() == 2);
    }
}

//! Where a drive is cut into motions: between standstills, or into windows of ordinary driving.
//!
//! **Stop and go** is a drive with at least four moves between standstills, which last at most a minute each: every move is then
//! one motion, whose ends are averaged over many scans. Any other drive is cut into windows at
//!
//! ```text
//! first reading + 0.15 s + k length,   k = 0, 1, ...      to 0.15 s before the last reading
//! ```
//!
//! one such moment between two readings at most, and none where readings are missing: the number of windows is bounded by
//! that of the readings, whatever their stamps say.

use super::standstill::{MARGIN, Rates};
use groma_egomotion::Station;
use groma_models::WheelLog;

/// Moves without which a drive is not stop and go.
const LEAST_MOVES: usize = 4;
/// A move that lasts longer is ordinary driving [s].
const LONGEST_MOVE: f64 = 60.0;
/// Length of a window of ordinary driving when not told [s].
pub(super) const WINDOW: f64 = 0.5;

/// A moment this share of a window before a reading is at it.
const ROUNDING: f64 = 1e-6;

/// How a drive was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegmentKind {
    /// Between standstills.
    StopAndGo,
    /// Windows of one length.
    Windows,
}

impl SegmentKind {
    /// What it is called.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::StopAndGo => "stop and go",
            Self::Windows => "windows",
        }
    }
}

/// Stations in order of time; motions run from each to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Segments {
    /// How the drive was cut.
    pub kind: SegmentKind,
    /// Standstills or moments.
    pub stations: Vec<Station>,
}

impl Segments {
    /// Cuts a drive; `window` [s] asks for windows, also where it stops and goes.
    pub(super) fn new(log: &WheelLog, rates: &Rates, window: Option<f64>) -> Self {
        let stops = rates.standstills(log);
        if window.is_none() && is_stop_and_go(&stops) {
            return Self { kind: SegmentKind::StopAndGo, stations: stops };
        }
        let moments = moments(log, rates, window.unwrap_or(WINDOW));
        Self { kind: SegmentKind::Windows, stations: moments.map(moment).collect() }
    }
}

/// The station of a moment.
pub(super) fn moment(time: f64) -> Station {
    Station { from: time, to: time }
}

fn is_stop_and_go(stops: &[Station]) -> bool {
    let moves = stops.windows(2).map(|w| w[1].from - w[0].to);
    stops.len() > LEAST_MOVES && moves.fold(0.0, f64::max) <= LONGEST_MOVE
}

/// The moments between readings that hang together.
fn moments<'a>(log: &'a WheelLog, rates: &'a Rates, length: f64) -> impl Iterator<Item = f64> + 'a {
    let time = log.time();
    let (origin, last) = (time[0] + MARGIN, time[time.len() - 1] - MARGIN);
    let mut next = 0.0_f64;
    (0..time.len() - 1).filter(|k| !rates.is_broken(*k)).filter_map(move |k| {
        let count = ((time[k] - origin) / length - ROUNDING).ceil().max(next);
        let at = origin + count * length;
        let is_here = at < time[k + 1] && at < last;
        next = if is_here { count + 1.0 } else { next };
        is_here.then_some(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::WheelKind;
    use nalgebra::Vector2;

    /// Counters at 50 Hz of a speed over time; both wheels alike.
    fn driven(kind: WheelKind, seconds: f64, speed: impl Fn(f64) -> f64) -> WheelLog {
        let time: Vec<f64> = (0..(seconds * 50.0) as usize).map(|k| 1000.0 + 0.02 * k as f64).collect();
        let mut sum = 0.0;
        let readings = time.iter().map(|t| {
            sum += 0.02 * speed(t - 1000.0);
            if kind == WheelKind::Steered {
                Vector2::new(sum, 0.1 * (t - 1000.0).sin())
            } else {
                Vector2::new(0.0, sum)
            }
        });
        let readings = readings.collect();
        WheelLog::new(kind, time, readings).unwrap()
    }

    fn cut(log: &WheelLog, breaks: &[(f64, f64)], window: Option<f64>) -> Segments {
        Segments::new(log, &Rates::new(log, breaks), window)
    }

    /// Drives three seconds of every five.
    fn stopping(t: f64) -> f64 {
        if t % 5.0 < 2.0 { 0.0 } else { 4.0 }
    }

    #[test]
    fn stops_keep_a_margin_and_either_wheel_moves() {
        for kind in [WheelKind::Steered, WheelKind::Differential] {
            let log = driven(kind, 31.0, stopping);
            let found = cut(&log, &[], None);
            assert_eq!((found.kind, found.stations.len()), (SegmentKind::StopAndGo, 7));
            for (k, stop) in found.stations[..6].iter().enumerate() {
                let begin = 1000.0 + 5.0 * k as f64;
                assert!((stop.from - begin - 0.15).abs() < 0.05 && (stop.to - begin - 1.85).abs() < 0.05, "{stop:?}");
            }
            assert!((found.stations[6].to - 1030.83).abs() < 0.05, "the last one ends with the log");
        }
    }

    #[test]
    fn short_pauses_few_moves_and_long_ones_are_ordinary_driving() {
        let short = |t: f64| if t % 5.0 < 0.7 { 0.0 } else { 4.0 };
        let long = |t: f64| if t % 70.0 < 2.0 { 0.0 } else { 4.0 };
        for (seconds, speed) in [(31.0, short as fn(f64) -> f64), (18.0, stopping), (400.0, long)] {
            let log = driven(WheelKind::Steered, seconds, speed);
            assert_eq!(cut(&log, &[], None).kind, SegmentKind::Windows);
        }
        let log = driven(WheelKind::Steered, 31.0, stopping);
        assert_eq!(cut(&log, &[], Some(2.0)).kind, SegmentKind::Windows, "where they are requested");
    }

    /// Half a percent of the usual pace is standing, five percent is driving, however long it lasts.
    #[test]
    fn a_creeping_robot_drives_and_who_hardly_moves_stands() {
        let between = |pace: f64| move |t: f64| if t % 5.0 < 2.0 { 4.0 * pace } else { 4.0 };
        for kind in [WheelKind::Steered, WheelKind::Differential] {
            assert_eq!(cut(&driven(kind, 31.0, between(0.005)), &[], None).kind, SegmentKind::StopAndGo);
            assert_eq!(cut(&driven(kind, 31.0, between(0.05)), &[], None).kind, SegmentKind::Windows);
        }
        let slowly =
            |pace: f64| driven(WheelKind::Differential, 60.0, move |t| if t < 30.0 { 4.0 } else { 4.0 * pace });
        for (pace, turned) in [(0.005, false), (0.05, true), (-0.05, true)] {
            let log = slowly(pace);
            let rates = Rates::new(&log, &[]);
            assert_eq!(rates.turned(&log, 1031.0, 1059.0), turned, "{pace}, half a minute");
            assert_eq!(rates.turned(&log, 1031.0, 1031.3), turned, "{pace}, a moment");
        }
    }

    #[test]
    fn wheels_that_never_turn_have_no_stops() {
        let log = driven(WheelKind::Differential, 10.0, |_| 0.0);
        assert!(Rates::new(&log, &[]).standstills(&log).is_empty());
    }

    #[test]
    fn windows_have_one_length_and_stay_within_the_log() {
        let log = driven(WheelKind::Differential, 10.0, |_| 3.0);
        for length in (1..40).map(|k| 0.053 * f64::from(k)) {
            let stations = cut(&log, &[], Some(length)).stations;
            let (first, last) = log.span();
            assert!(stations[0].from > first + 0.1 && stations[stations.len() - 1].from < last - 0.1);
            assert!(stations.windows(2).all(|w| (w[1].from - w[0].from - length).abs() < 1e-9));
            assert_eq!(stations.len(), ((last - first - 0.3) / length).ceil() as usize);
        }
    }

    /// A day, or the age of the universe, without readings adds no window.
    #[test]
    fn a_step_of_the_clock_costs_nothing() {
        for step in [86_400.0, 1.7e9, 1e18] {
            let mut time: Vec<f64> = (0..200).map(|k| 0.02 * f64::from(k)).collect();
            time[100..].iter_mut().for_each(|t| *t += step);
            let distinct: Vec<f64> = time
                .iter()
                .enumerate()
                .map(|(k, t)| t.max(step * f64::from(u8::from(k >= 100)) * (1.0 + 1e-15 * k as f64)))
                .collect();
            let readings: Vec<_> = (0..200).map(|k| Vector2::new(f64::from(k), f64::from(k))).collect();
            let Ok(log) = WheelLog::new(WheelKind::Differential, distinct.clone(), readings) else { continue };
            for breaks in [vec![], vec![(distinct[99], distinct[100])]] {
                let found = cut(&log, &breaks, Some(0.5));
                assert!(found.stations.len() < 200);
                assert!(breaks.is_empty() || found.stations.iter().all(|s| s.from < 2.0 || s.from > step));
            }
        }
    }

    #[test]
    fn a_standstill_does_not_reach_over_missing_readings() {
        let log = driven(WheelKind::Steered, 31.0, stopping);
        let (a, b) = (log.time()[525], log.time()[526]);
        let rates = Rates::new(&log, &[(a, b)]);
        assert!(rates.standstills(&log).iter().all(|s| s.to < a || s.from > b), "10.5 s lies within a stop");
        assert!(rates.is_broken(525) && !rates.is_broken(524));
    }

    #[test]
    fn turning_is_distinguished_from_standing() {
        let log = driven(WheelKind::Differential, 31.0, stopping);
        let rates = Rates::new(&log, &[]);
        assert!(rates.turned(&log, 1000.5, 1004.0));
        assert!(!rates.turned(&log, 1000.2, 1001.8));
    }
}

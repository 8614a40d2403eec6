//! When a robot stands still, by its odometry: pairs what cameras see with stops instead of clocks.
//!
//! It stands when within the last `SETTLE` seconds no pose was farther than `SHIFT` or `TURN` from the newest, so that
//! vibrations have died away when images are taken. It has gone on as soon as a pose is farther than that from where it
//! began to stand: a creeping robot represents a while, then anew elsewhere. No odometry, no stop.
//!
//! Readings are taken in the order of their arrival. One that is older than the newest changes nothing: it came late. When
//! the clock of the sender was set back, or the sender started anew, say so ([`Standstill::restart`]): what was known before
//! is undecided then.

use groma_geometry::Se2;
use groma_models::Odometry;
use std::collections::VecDeque;

/// Time without motion before it counts [s].
const SETTLE: f64 = 0.5;
/// Less than this is no motion [m].
const SHIFT: f64 = 0.002;
/// Less than this is no turn [rad].
const TURN: f64 = 0.2 * std::f64::consts::PI / 180.0;
/// Differences of stamps are known to this [s].
const TICK: f64 = 1e-9;

/// Whether two poses are one standstill.
#[must_use]
pub fn is_still(a: &Se2, b: &Se2) -> bool {
    let moved = a.between(b);
    moved.translation.norm() <= SHIFT && moved.theta().abs() <= TURN
}

/// Tells stops from odometry as it comes.
#[derive(Clone, Debug, Default)]
pub struct Standstill {
    /// The readings of the last `SETTLE` seconds, and the last one before.
    recent: VecDeque<Odometry>,
    /// Where it began to stand.
    anchor: Option<Se2>,
}

impl Standstill {
    /// Takes a reading and tells whether the robot stands at its time.
    pub fn push(&mut self, reading: Odometry) -> bool {
        let finite = reading.stamp.is_finite() && reading.pose.to_vector().iter().all(|v| v.is_finite());
        let late = self.recent.back().is_some_and(|newest| reading.stamp < newest.stamp);
        if !finite || late {
            return self.stands();
        }
        let gone_on = |from: &Se2| !is_still(from, &reading.pose);
        if self.recent.iter().any(|r| gone_on(&r.pose)) || self.anchor.as_ref().is_some_and(gone_on) {
            self.restart();
        }
        self.recent.push_back(reading);
        while self.recent.get(1).is_some_and(|second| reading.stamp - second.stamp >= SETTLE) {
            self.recent.pop_front();
        }
        let settled = self.recent.front().is_some_and(|first| reading.stamp - first.stamp >= SETTLE - TICK);
        if settled && self.anchor.is_none() {
            self.anchor = Some(reading.pose);
        }
        self.stands()
    }

    /// Whether it stood at the newest reading.
    #[must_use]
    pub fn stands(&self) -> bool {
        self.anchor.is_some()
    }

    /// Forgets all: the sender started anew, or its clock was set.
    pub fn restart(&mut self) {
        self.recent.clear();
        self.anchor = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 20.0;

    fn reading(stamp: f64, pose: Se2) -> Odometry {
        Odometry { stamp, pose }
    }

    /// Whether it stands after each of `count` readings of a path over time.
    fn run(still: &mut Standstill, from: f64, count: usize, path: impl Fn(f64) -> Se2) -> Vec<bool> {
        let stamp = |k: usize| from + k as f64 / RATE;
        (0..count).map(|k| still.push(reading(stamp(k), path(stamp(k))))).collect()
    }

    fn at(x: f64, theta: f64) -> Se2 {
        Se2::new(x, 0.0, theta)
    }

    #[test]
    fn it_stands_half_a_second_after_it_has_come_to_rest_and_goes_on_at_once() {
        let mut still = Standstill::default();
        assert!(!run(&mut still, 0.0, 20, |t| at(0.5 * t, 0.0)).contains(&true));
        let standing = run(&mut still, 1.0, 40, |_| at(0.5, 0.0));
        let first = standing.iter().position(|s| *s).unwrap() as f64 / RATE;
        assert!((0.4..=0.6).contains(&first), "{first} s");
        assert!(standing.iter().skip_while(|s| !**s).all(|s| *s));
        assert!(!still.push(reading(3.0, at(0.51, 0.0))));
    }

    #[test]
    fn vibrations_of_a_millimetre_are_no_motion_and_of_a_centimetre_are() {
        let shaken = |amplitude: f64| {
            let mut still = Standstill::default();
            run(&mut still, 0.0, 200, |t| Se2::new(amplitude * (31.0 * t).sin(), amplitude * (47.0 * t).cos(), 0.0))
        };
        assert!(shaken(0.0005)[20..].iter().all(|s| *s));
        assert!(!shaken(0.01).contains(&true));
        let mut still = Standstill::default();
        assert!(!run(&mut still, 0.0, 200, |t| at(0.0, 0.01 * (31.0 * t).sin())).contains(&true), "half a degree");
    }

    #[test]
    fn a_creeping_robot_does_not_stand_and_slower_never_far_from_where_it_began() {
        let mut still = Standstill::default();
        assert!(!run(&mut still, 0.0, 400, |t| at(0.01 * t, 0.0)).contains(&true), "a centimetre a second");
        for turn in [0.02, -0.02] {
            assert!(!run(&mut Standstill::default(), 0.0, 400, |t| at(0.0, turn * t)).contains(&true), "{turn} rad/s");
        }
        let speed = 0.001;
        let mut slow = Standstill::default();
        let standing = run(&mut slow, 0.0, 2000, |t| at(speed * t, 0.0));
        let longest = standing.split(|s| !s).map(<[bool]>::len).max().unwrap();
        assert!(longest > 0 && longest as f64 / RATE * speed < 0.003, "{longest} readings as one stop");
    }

    #[test]
    fn a_turn_across_half_a_circle_or_by_whole_ones_is_none() {
        let mut still = Standstill::default();
        let pi = std::f64::consts::PI;
        let swung = run(&mut still, 0.0, 40, |t| {
            at(1.0, if ((t * RATE) as usize).is_multiple_of(2) { pi - 1e-4 } else { -pi + 1e-4 })
        });
        assert!(swung[20..].iter().all(|s| *s));
        let mut still = Standstill::default();
        assert!(run(&mut still, 0.0, 40, |t| at(1.0, 2.0 * pi * (t * RATE).round()))[20..].iter().all(|s| *s));
    }

    #[test]
    fn far_from_the_origin_and_turned_it_stands_as_well() {
        let mut still = Standstill::default();
        assert!(run(&mut still, 1.7e9, 40, |_| Se2::new(-4e3, 7e3, 2.5))[20..].iter().all(|s| *s));
    }

    #[test]
    fn late_readings_change_nothing_and_readings_without_number_neither() {
        let mut still = Standstill::default();
        assert!(run(&mut still, 10.0, 40, |_| at(1.0, 0.0))[39]);
        assert!(still.push(reading(9.0, at(7.0, 0.0))), "sent again");
        assert!(still.push(reading(f64::NAN, at(1.0, 0.0))) && still.push(reading(12.5, at(f64::INFINITY, 0.0))));
        assert!(still.push(reading(12.6, at(1.0, 0.0))));
    }

    #[test]
    fn after_a_restart_of_the_sender_or_its_clock_it_takes_its_time_again() {
        let mut still = Standstill::default();
        assert!(run(&mut still, 1000.0, 40, |_| at(1.0, 0.0))[39]);
        still.restart();
        assert!(!still.stands());
        let again = run(&mut still, 5.0, 40, |_| at(1.0, 0.0));
        assert!(!again[0] && !again[5] && again[20]);
    }

    #[test]
    fn a_pause_of_the_odometry_hides_no_motion() {
        let mut still = Standstill::default();
        assert!(run(&mut still, 0.0, 20, |_| at(1.0, 0.0))[19]);
        assert!(!still.push(reading(30.0, at(1.5, 0.0))), "it drove in the pause");
        assert!(!still.push(reading(30.1, at(1.5, 0.0))));
    }

    #[test]
    fn stamps_in_milliseconds_are_not_seconds() {
        let mut still = Standstill::default();
        let moving: Vec<bool> =
            (0..60).map(|k| still.push(reading(50.0 * f64::from(k), at(0.02 * f64::from(k), 0.0)))).collect();
        assert!(!moving.contains(&true));
    }
}

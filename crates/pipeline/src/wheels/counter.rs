//! A counter that wraps around, unrolled as its readings come.
//!
//! An angle may be kept within a turn (-pi .. pi or 0 .. 2 pi), a whole number within 16 or 32 bits, with or without sign. A
//! counter of period P can only be one that wraps while every reading lies within such a span. A step d between readings
//! with |d| > P/2 is then a passage of the end of the span, a step of `s = d -+ P` in truth, if the wheel was moving the way
//! of s (so against d), or s is tiny (at most P/16). From then on the turns k are those that bring the step nearest to what
//! the last rate lets expect:
//!
//! ```text
//! k = round((e - d)/P),   e = rate dt, at most P/4 either way:   steps from -P/4 to 3P/4 in the direction of motion are told
//! ```
//!
//! A counter that leaves the span does not wrap: what it counted before stands, the step is taken as it is. Nothing
//! is reported of a counter that passes more than half a turn between readings before it was seen to wrap once.

use std::f64::consts::{PI, TAU};

/// An end of the span may be passed by this share of the period: rounding, and counters that stop a little later.
const TOLERANCE: f64 = 1e-3;
/// Steps up to this share of the period are believed to pass an end whatever the rate before.
const TINY: f64 = 1.0 / 16.0;

/// The readings that a counter can have.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Span {
    low: f64,
    period: f64,
}

const ANGLES: [Span; 2] = [Span { low: -PI, period: TAU }, Span { low: 0.0, period: TAU }];
const WHOLE: [Span; 4] = [
    Span { low: 0.0, period: 65_536.0 },
    Span { low: -32_768.0, period: 65_536.0 },
    Span { low: 0.0, period: 4_294_967_296.0 },
    Span { low: -2_147_483_648.0, period: 4_294_967_296.0 },
];

impl Span {
    fn holds(&self, raw: f64) -> bool {
        let slack = TOLERANCE * self.period;
        raw >= self.low - slack && raw <= self.low + self.period + slack
    }
}

/// One counter.
#[derive(Clone, Debug)]
pub(super) struct Counter {
    spans: Vec<Span>,
    is_whole: bool,
    last: Option<(f64, f64)>,
    rate: f64,
    period: Option<f64>,
    turns: f64,
    wrapped_at: Option<f64>,
}

impl Counter {
    pub(super) fn new() -> Self {
        let spans = ANGLES.into_iter().chain(WHOLE).collect();
        Self { spans, is_whole: true, last: None, rate: 0.0, period: None, turns: 0.0, wrapped_at: None }
    }

    /// The unrolled reading at a stamp after the one before.
    pub(super) fn read(&mut self, stamp: f64, raw: f64) -> f64 {
        self.narrow(raw);
        if let Some((before, last)) = self.last {
            let (step, expected) = (raw - last, self.rate * (stamp - before));
            let (period, turns) = self.turns_of(step, expected);
            self.turns += turns * period;
            if turns != 0.0 {
                self.wrapped_at.get_or_insert(stamp);
            }
            self.rate = (step + turns * period) / (stamp - before);
        }
        self.last = Some((stamp, raw));
        raw + self.turns
    }

    /// When it was first seen to wrap [s].
    pub(super) fn wrapped_at(&self) -> Option<f64> {
        self.wrapped_at
    }

    /// Drops the spans that a reading contradicts: a whole number is no sign of an angle, a fraction one against counts.
    fn narrow(&mut self, raw: f64) {
        self.is_whole &= raw == raw.round();
        let is_whole = self.is_whole;
        self.spans.retain(|span| span.holds(raw) && (is_whole || span.period == TAU));
        if !self.spans.iter().any(|span| Some(span.period) == self.period) {
            self.period = None;
        }
    }

    /// Period and turns of a step.
    fn turns_of(&mut self, step: f64, expected: f64) -> (f64, f64) {
        if let Some(period) = self.period {
            let likely = expected.clamp(-period / 4.0, period / 4.0);
            return (period, ((likely - step) / period).round());
        }
        let of_kind = |span: &&Span| (span.period != TAU) == self.is_whole;
        let Some(period) = self.spans.iter().find(of_kind).map(|span| span.period) else { return (0.0, 0.0) };
        let true_step = step - period.copysign(step);
        let passes = step.abs() > period / 2.0 && (true_step * expected > 0.0 || true_step.abs() <= TINY * period);
        if !passes {
            return (0.0, 0.0);
        }
        self.period = Some(period);
        (period, -1.0_f64.copysign(step))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::wrap;
    use proptest::prelude::*;

    /// Readings at 50 Hz of a true position, kept within a span.
    fn unrolled(truth: &[f64], kept: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut counter = Counter::new();
        truth.iter().enumerate().map(|(k, x)| counter.read(0.02 * k as f64, kept(*x))).collect()
    }

    fn same_steps(a: &[f64], b: &[f64]) -> bool {
        a.windows(2).zip(b.windows(2)).all(|(a, b)| ((a[1] - a[0]) - (b[1] - b[0])).abs() < 1e-6)
    }

    fn there_and_back(step: f64) -> Vec<f64> {
        let speed = |k: usize| if k < 5 { 0.0 } else { step * (0.05 * (k - 5) as f64).sin() };
        (0..400).scan(0.3, |x, k| Some(std::mem::replace(x, *x + speed(k)))).collect()
    }

    #[test]
    fn angles_within_a_turn_are_unrolled_both_ways() {
        for step in [0.1, 1.0, 1.5] {
            let truth = there_and_back(step);
            assert!(same_steps(&unrolled(&truth, wrap), &truth), "-pi .. pi, {step}");
            assert!(same_steps(&unrolled(&truth, |x| x.rem_euclid(TAU)), &truth), "0 .. 2 pi, {step}");
        }
    }

    #[test]
    fn whole_counters_of_16_and_32_bits_are_unrolled() {
        for bits in [16, 32] {
            let period = 2.0_f64.powi(bits);
            let truth: Vec<f64> = there_and_back(0.2 * period).iter().map(|x| x.round()).collect();
            assert!(same_steps(&unrolled(&truth, |x| x.rem_euclid(period)), &truth), "{bits} bits");
            let signed = |x: f64| (x + period / 2.0).rem_euclid(period) - period / 2.0;
            assert!(same_steps(&unrolled(&truth, signed), &truth), "{bits} bits with sign");
        }
    }

    #[test]
    fn a_fast_wheel_read_seldom_is_not_taken_to_wrap() {
        // 5 rad between readings from rest, and the same in ticks.
        let truth: Vec<f64> = (0..20).map(|k| if k < 3 { 0.25 } else { 0.25 + 5.0 * f64::from(k - 2) }).collect();
        assert_eq!(unrolled(&truth, |x| x), truth);
        let ticks: Vec<f64> = (0..20).map(|k| 40_000.0 * f64::from(k)).collect();
        assert_eq!(unrolled(&ticks, |x| x), ticks);
    }

    #[test]
    fn a_wheel_that_gathers_speed_is_followed_beyond_half_a_turn_a_reading() {
        let steps = (0..60).map(|k| (0.2 * f64::from(k)).min(4.0));
        let truth: Vec<f64> = steps.scan(0.0, |x, s| Some(std::mem::replace(x, *x + s))).collect();
        assert!(same_steps(&unrolled(&truth, wrap), &truth));
    }

    #[test]
    fn a_counter_reset_to_zero_does_not_wrap() {
        let truth: Vec<f64> =
            (0..100).map(|k| if k < 50 { 70.0 + 0.1 * f64::from(k) } else { 0.1 * f64::from(k - 50) }).collect();
        assert_eq!(unrolled(&truth, |x| x), truth);
    }

    proptest! {
        #[test]
        fn a_wrapped_counter_makes_the_steps_of_the_true_one(
            steps in prop::collection::vec(-0.1..0.1_f64, 2..300), start in -1.0..1.0_f64, speed in -1.3..1.3_f64,
        ) {
            let truth: Vec<f64> = steps.iter().scan(start, |x, s| Some(std::mem::replace(x, *x + s + speed))).collect();
            prop_assert!(same_steps(&unrolled(&truth, wrap), &truth));
        }
    }
}

//! What the wheels said over time, and the steps between any two times.
//!
//! Counts are cumulative and are interpolated as such, never as speeds; so is the angle of the steering:
//!
//! ```text
//! knots of [a, b]:  a, every reading between, b
//! step:             counts(after) - counts(before), steering (before + after)/2
//! rate of a step:   derivative of that by a shift of both a and b
//! ```
//!
//! The rate is what an unknown delay between the clocks of wheels and scanner needs. Assumes that readings are close
//! enough for the steering to be even within a step: the error is of second order in their distance.

use groma_geometry::wrap;
use nalgebra::Vector2;
use thiserror::Error;

/// Which two numbers a reading has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WheelKind {
    /// Cumulative counts of the drive wheel, angle of the steering encoder [rad].
    Steered,
    /// Cumulative counts of the left and the right wheel.
    Differential,
}

impl WheelKind {
    /// How many of the two numbers are counters.
    #[must_use]
    pub fn counters(self) -> usize {
        match self {
            Self::Steered => 1,
            Self::Differential => 2,
        }
    }

    /// What was gained between two readings; a steering angle takes the short way round.
    #[must_use]
    pub fn gained(self, before: Vector2<f64>, after: Vector2<f64>) -> Vector2<f64> {
        let gained = after - before;
        match self {
            Self::Steered => Vector2::new(gained.x, wrap(gained.y)),
            Self::Differential => gained,
        }
    }

    /// Input of the drive between two readings: counts and the mean of the steering, or both counts.
    #[must_use]
    pub fn input(self, before: Vector2<f64>, after: Vector2<f64>) -> Vector2<f64> {
        let gained = self.gained(before, after);
        match self {
            Self::Steered => Vector2::new(gained.x, before.y + gained.y / 2.0),
            Self::Differential => gained,
        }
    }
}

/// Why a log is none.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Error {
    /// Fewer than two readings.
    #[error("the wheel log has {got} readings: it needs two at least")]
    TooShort {
        /// Their number.
        got: usize,
    },
    /// Times and readings differ in number.
    #[error("the wheel log has {times} times and {readings} readings: they must be as many")]
    Size {
        /// Number of times.
        times: usize,
        /// Number of readings.
        readings: usize,
    },
    /// A time or a reading is NaN or infinite.
    #[error("reading {index} of the wheel log is not finite")]
    NotFinite {
        /// Which, from 0.
        index: usize,
    },
    /// A time is not after the one before.
    #[error("the time of reading {index} of the wheel log does not rise: sort the log, leave out repeated times")]
    Time {
        /// Which, from 0.
        index: usize,
    },
}

/// Readings of the wheels in strictly rising order of time.
#[derive(Clone, Debug)]
pub struct WheelLog {
    kind: WheelKind,
    time: Vec<f64>,
    readings: Vec<Vector2<f64>>,
}

/// Input of a drive over a step, as [`crate::Drive`] takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// The two inputs.
    pub input: Vector2<f64>,
    /// Derivative of the inputs by a shift of the whole interval [1/s].
    pub rate: Vector2<f64>,
    /// Time it takes [s].
    pub duration: f64,
}

/// Values at a time and their slopes.
#[derive(Clone, Copy)]
struct Knot {
    time: f64,
    value: Vector2<f64>,
    slope: Vector2<f64>,
}

impl WheelLog {
    /// Checks and keeps readings.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn new(kind: WheelKind, time: Vec<f64>, readings: Vec<Vector2<f64>>) -> Result<Self, Error> {
        if time.len() != readings.len() {
            return Err(Error::Size { times: time.len(), readings: readings.len() });
        }
        if time.len() < 2 {
            return Err(Error::TooShort { got: time.len() });
        }
        let finite = |k: &usize| time[*k].is_finite() && readings[*k].iter().all(|v| v.is_finite());
        if let Some(index) = (0..time.len()).find(|k| !finite(k)) {
            return Err(Error::NotFinite { index });
        }
        if let Some(index) = (1..time.len()).find(|&k| time[k] <= time[k - 1]) {
            return Err(Error::Time { index });
        }
        Ok(Self { kind, time, readings })
    }

    /// Which numbers the readings have.
    #[must_use]
    pub fn kind(&self) -> WheelKind {
        self.kind
    }

    /// First and last time [s].
    #[must_use]
    pub fn span(&self) -> (f64, f64) {
        (self.time[0], self.time[self.time.len() - 1])
    }

    /// Times of the readings [s].
    #[must_use]
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// One reading.
    #[must_use]
    pub fn reading(&self, index: usize) -> Vector2<f64> {
        self.readings[index]
    }

    /// The steps from `start` to `end`, or nothing where the log does not reach or the interval is empty.
    #[must_use]
    pub fn steps(&self, start: f64, end: f64) -> Option<Vec<Step>> {
        let mut steps = Vec::new();
        self.append_steps(start, end, &mut steps).then_some(steps)
    }

    /// Appends the steps from `start` to `end`; returns false and appends nothing where the log does not reach or the
    /// interval is empty.
    pub fn append_steps(&self, start: f64, end: f64, steps: &mut Vec<Step>) -> bool {
        let (first, last) = self.span();
        if !(start >= first && end <= last && start < end) {
            return false;
        }
        let after = self.time.partition_point(|&t| t <= start);
        let before = after + self.time[after..].iter().take_while(|&&t| t < end).count();
        let still = |k: usize| Knot { time: self.time[k], value: self.readings[k], slope: Vector2::zeros() };
        let mut knot = self.knot(after, start);
        let inner = (after..before).map(still).chain([self.knot(before, end)]);
        steps.extend(inner.map(|next| self.step(std::mem::replace(&mut knot, next), next)));
        true
    }

    /// The reading at a time before reading `after` and not before the one that precedes it.
    fn knot(&self, after: usize, time: f64) -> Knot {
        let (a, b) = (after - 1, after);
        let slope = self.kind.gained(self.readings[a], self.readings[b]) / (self.time[b] - self.time[a]);
        Knot { time, value: self.readings[a] + slope * (time - self.time[a]), slope }
    }

    fn step(&self, a: Knot, b: Knot) -> Step {
        let rate = match self.kind {
            WheelKind::Steered => Vector2::new(b.slope.x - a.slope.x, (a.slope.y + b.slope.y) / 2.0),
            WheelKind::Differential => b.slope - a.slope,
        };
        Step { input: self.kind.input(a.value, b.value), rate, duration: b.time - a.time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(kind: WheelKind) -> WheelLog {
        let time = vec![0.0, 1.0, 2.0, 4.0];
        let readings = [(0.0, 0.0), (10.0, 0.2), (30.0, 0.2), (20.0, -0.6)];
        WheelLog::new(kind, time, readings.map(|(a, b)| Vector2::new(a, b)).to_vec()).unwrap()
    }

    #[test]
    fn steps_add_up_to_the_counts_between() {
        let steps = log(WheelKind::Differential).steps(0.5, 3.0).unwrap();
        let total: Vector2<f64> = steps.iter().map(|s| s.input).sum();
        assert_eq!(steps.len(), 3);
        assert_eq!(steps.iter().map(|s| s.duration).collect::<Vec<_>>(), [0.5, 1.0, 1.0]);
        assert!((total - Vector2::new(25.0 - 5.0, -0.2 - 0.1)).norm() < 1e-14);
    }

    #[test]
    fn steering_is_the_mean_of_a_step() {
        let steps = log(WheelKind::Steered).steps(0.5, 3.0).unwrap();
        for (step, mean) in steps.iter().zip([0.15, 0.2, 0.0]) {
            assert!((step.input.y - mean).abs() < 1e-14);
        }
    }

    #[test]
    fn a_steering_that_passes_half_a_turn_does_not_swing_round() {
        let readings = [(0.0, 3.1), (1.0, -3.1)].map(|(a, b)| Vector2::new(a, b)).to_vec();
        let log = WheelLog::new(WheelKind::Steered, vec![0.0, 1.0], readings).unwrap();
        for step in log.steps(0.2, 0.9).unwrap().iter().chain(&log.steps(0.0, 1.0).unwrap()) {
            assert!(wrap(step.input.y - std::f64::consts::PI).abs() < 0.05, "{step:?}");
        }
    }

    #[test]
    fn rates_equal_differences() {
        let h = 1e-6;
        for kind in [WheelKind::Steered, WheelKind::Differential] {
            for (a, b) in [(0.5, 3.0), (0.1, 0.7), (1.5, 3.9)] {
                let [low, middle, high] = [-h, 0.0, h].map(|d| log(kind).steps(a + d, b + d).unwrap());
                for ((low, middle), high) in low.iter().zip(&middle).zip(&high) {
                    assert!(((high.input - low.input) / (2.0 * h) - middle.rate).norm() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn readings_at_the_ends_are_met_exactly() {
        let steps = log(WheelKind::Steered).steps(1.0, 4.0).unwrap();
        assert_eq!(steps.iter().map(|s| s.input.x).collect::<Vec<_>>(), [20.0, -10.0]);
        assert!(log(WheelKind::Steered).steps(-0.1, 1.0).is_none());
        assert!(log(WheelKind::Steered).steps(1.0, 4.1).is_none() && log(WheelKind::Steered).steps(2.0, 2.0).is_none());
        assert!(log(WheelKind::Steered).steps(f64::NAN, 2.0).is_none());
    }

    #[test]
    fn bad_logs_are_refused() {
        let row = Vector2::new(0.0, 0.0);
        let new = |time: &[f64], rows: Vec<Vector2<f64>>| WheelLog::new(WheelKind::Steered, time.to_vec(), rows);
        assert_eq!(new(&[0.0], vec![row]).unwrap_err(), Error::TooShort { got: 1 });
        assert_eq!(new(&[0.0, 1.0], vec![row]).unwrap_err(), Error::Size { times: 2, readings: 1 });
        assert_eq!(new(&[0.0, 0.0], vec![row; 2]).unwrap_err(), Error::Time { index: 1 });
        assert_eq!(new(&[0.0, f64::NAN], vec![row; 2]).unwrap_err(), Error::NotFinite { index: 1 });
    }
}

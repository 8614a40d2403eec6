//! Two joints brought together: a row at every stamp of the first joint, the second interpolated between its readings around.
//!
//! ```text
//! second(t) = a + (b - a) (t - t_a)/(t_b - t_a),   t_a <= t < t_b      a steering angle takes the short way round
//! ```
//!
//! Nothing is extrapolated: a row is complete when the second joint has reached its stamp, so a joint in messages of its own
//! holds rows back by at most its own interval, and rows do not depend on how the joints are spread over messages. Where the
//! readings of the second joint are farther apart than a gap there is no row.

use super::breaks::Intervals;
use groma_geometry::wrap;
use groma_models::WheelKind;
use nalgebra::Vector2;
use std::collections::VecDeque;

/// Readings of a joint that wait for the other, at most.
const MOST: usize = 4096;

/// Stamp [s] and reading of one joint.
type Reading = (f64, f64);

/// Brings two joints together.
#[derive(Clone, Debug)]
pub(super) struct Join {
    kind: WheelKind,
    first: VecDeque<Reading>,
    second: VecDeque<Reading>,
    intervals: Intervals,
    /// Begin of the last interval of the second joint that is a gap.
    gap: Option<f64>,
}

impl Join {
    pub(super) fn new(kind: WheelKind) -> Self {
        Self { kind, first: VecDeque::new(), second: VecDeque::new(), intervals: Intervals::new(), gap: None }
    }

    /// Takes readings of the first joint (0) or the second (1), in order of time within each, and hands on what is complete.
    pub(super) fn push(&mut self, joint: usize, stamp: f64, value: f64, rows: &mut Vec<(f64, Vector2<f64>)>) {
        if joint == 0 {
            keep(&mut self.first, (stamp, value));
        } else {
            if let Some((before, _)) = self.second.back()
                && self.intervals.is_gap(stamp - before)
            {
                self.gap = Some(*before);
            }
            keep(&mut self.second, (stamp, value));
        }
        while let Some(ready) = self.next() {
            rows.extend(ready);
        }
    }

    /// Stamps of the first joint that still wait for the second: first and last [s].
    pub(super) fn waiting(&self) -> Option<(f64, f64)> {
        Some((self.first.front()?.0, self.first.back()?.0))
    }

    /// The row at the oldest stamp of the first joint, an empty answer where it has none, nothing where it must wait.
    fn next(&mut self) -> Option<Option<(f64, Vector2<f64>)>> {
        let &(stamp, first) = self.first.front()?;
        while self.second.get(1).is_some_and(|(t, _)| *t <= stamp) {
            self.second.pop_front();
        }
        let &(before, a) = self.second.front()?;
        let second = if before >= stamp {
            (before == stamp).then_some(a)
        } else {
            let &(after, b) = self.second.get(1)?;
            let share = (stamp - before) / (after - before);
            (self.gap != Some(before)).then(|| self.between(a, b, share))
        };
        self.first.pop_front();
        Some(second.map(|second| (stamp, Vector2::new(first, second))))
    }

    fn between(&self, a: f64, b: f64, share: f64) -> f64 {
        match self.kind {
            WheelKind::Steered => wrap(a + wrap(b - a) * share),
            WheelKind::Differential => a + (b - a) * share,
        }
    }
}

fn keep(queue: &mut VecDeque<Reading>, reading: Reading) {
    if queue.len() >= MOST {
        queue.pop_front();
    }
    queue.push_back(reading);
}

//! What a reader of wheels left out or had to break, as findings.

use super::breaks::GAP;
use groma_models::finding::Code;
use groma_models::{Finding, WheelKind};

/// How often something happened, when, and for how long at most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    count: u32,
    span: Option<(f64, f64)>,
    longest: f64,
}

impl Tally {
    /// Counts an event from one stamp to another; a stamp that is no number has no place in the span.
    pub(super) fn add(&mut self, from: f64, to: f64) {
        self.count += 1;
        if from.is_finite() && to.is_finite() {
            let (first, last) = self.span.unwrap_or((from, to));
            self.span = Some((first.min(from), last.max(to)));
            self.longest = self.longest.max(to - from);
        }
    }

    fn finding(&self, code: Code, text: &str) -> Option<Finding> {
        let times = if self.count == 1 { "once".to_owned() } else { format!("{} times", self.count) };
        let finding = Finding::new(code, format!("{text} {times}")).with("count", f64::from(self.count), "1");
        let finding = if self.longest > 0.0 { finding.with("longest", self.longest, "s") } else { finding };
        let placed = self.span.map_or(finding.clone(), |(from, to)| finding.during(from, to));
        (self.count > 0).then_some(placed)
    }
}

/// All of it.
#[derive(Clone, Debug, Default)]
pub(super) struct Account {
    pub(super) invalid: Tally,
    pub(super) late: Tally,
    pub(super) repeated: Tally,
    pub(super) gaps: Tally,
    pub(super) leaps: Tally,
}

impl Account {
    /// The findings; `wrapped` says when each counter was first seen to wrap, `waiting` which stamps lack the second joint.
    pub(super) fn findings(
        &self,
        kind: WheelKind,
        wrapped: [Option<f64>; 2],
        waiting: Option<(f64, f64)>,
    ) -> Vec<Finding> {
        let names = match kind {
            WheelKind::Steered => ["driven wheel", "steering"],
            WheelKind::Differential => ["left wheel", "right wheel"],
        };
        let counted = [
            self.invalid.finding(Code::ValuesInvalid, "a reading of the wheels was no number or out of range"),
            self.late.finding(Code::StampsLate, "a reading of the wheels came after a later one of its joint"),
            self.repeated.finding(Code::StampsInvalid, "a reading of the wheels repeated the stamp of the one before"),
            self.gaps.finding(Code::WheelsGap, "readings of the wheels are missing"),
            self.leaps.finding(Code::WheelsLeap, "a counter of the wheels leaps"),
        ];
        let unrolled = (0..2).filter_map(|k| {
            let text = format!("the counter of the {} wraps around: it was unrolled", names[k]);
            wrapped[k].map(|stamp| Finding::new(Code::WheelsUnrolled, text).during(stamp, stamp))
        });
        let missing = waiting.filter(|(from, to)| to - from > GAP).map(|(from, to)| {
            let text = format!("readings of the {} are missing to the end", names[1]);
            Finding::new(Code::WheelsGap, text).during(from, to).with("longest", to - from, "s")
        });
        counted.into_iter().flatten().chain(unrolled).chain(missing).collect()
    }
}

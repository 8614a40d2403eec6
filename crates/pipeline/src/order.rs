//! Messages put into the order of their stamps, as far as a bounded lateness allows.
//!
//! ```text
//! a message waits until one has come that is `lateness` younger;  lateness 0: nobody waits
//! ```
//!
//! The key of a message is the time at which it was complete, so odometry up to the end of a sweep precedes the scan where
//! anything waits at all; of equal keys, odometry and wheels go before scans, then arrival decides. What cannot be sorted is
//! left out and counted by reason, never silently:
//!
//! - late: its stamp is not after that of the message of its stream that was passed on before;
//! - far ahead: a stamp `LEAP` ahead of all before is accepted only if a later message is later still; when the next one
//!   is back where it was, the leaper is dropped. A real pause in a recording passes, a single wrong stamp does not.
//!
//! At most `MOST` messages wait; beyond that the oldest goes first.

use crate::message::Message;
use groma_models::Finding;
use groma_models::finding::Code;
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};

/// A stamp so far ahead of all before needs a witness [s].
pub const LEAP: f64 = 30.0;
/// Messages that wait, at most.
const MOST: usize = 4096;
/// Messages far ahead that wait for a witness, at most.
const MOST_LEAPERS: usize = 16;

/// Why a message was left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Left {
    /// One of its numbers is not finite or out of its bound.
    Invalid,
    /// It has the stamp of the message of its stream before.
    Repeated,
    /// It is older than the message of its stream before, by more than the lateness.
    Late,
    /// Its stamp is far ahead of its neighbours.
    Leap,
}

/// How late the messages of a recorded stream come, at most [s]: what a file asks for. Stamps that are no numbers or far
/// ahead of all before do not count, and no file asks for more than [`LEAP`].
pub fn disorder(stamps: impl IntoIterator<Item = f64>) -> f64 {
    let (mut newest, mut latest) = (None, 0.0_f64);
    for stamp in stamps.into_iter().filter(|s| s.is_finite()) {
        let before = newest.unwrap_or(stamp);
        if stamp <= before + LEAP {
            latest = latest.max(before - stamp);
            newest = Some(stamp.max(before));
        }
    }
    latest.min(LEAP)
}

#[derive(Clone)]
struct Waiting {
    key: f64,
    rank: u8,
    arrival: u64,
    message: Message,
}

/// A stage that orders messages.
#[derive(Clone, Default)]
pub struct Order {
    lateness: f64,
    waiting: Vec<Waiting>,
    leapers: VecDeque<Message>,
    newest: Option<f64>,
    arrivals: u64,
    last: BTreeMap<(u8, usize), f64>,
    left: BTreeMap<(Left, &'static str), (usize, f64, f64)>,
}

impl Order {
    /// A stage that waits for messages up to `lateness` seconds late; a lateness that is no number is none.
    #[must_use]
    pub fn new(lateness: f64) -> Self {
        Self { lateness: if lateness.is_finite() { lateness.max(0.0) } else { 0.0 }, ..Self::default() }
    }

    /// Takes a message and hands on those whose turn has come.
    pub fn push(&mut self, message: Message) -> Vec<Message> {
        let mut out = Vec::new();
        if message.validate().is_err() {
            self.leave(Left::Invalid, &message);
            return out;
        }
        if self.sets_aside(message) {
            return out;
        }
        self.release(&mut out, false);
        out
    }

    /// Hands on all that still waits.
    pub fn drain(&mut self) -> Vec<Message> {
        let mut out = Vec::new();
        self.believe();
        self.release(&mut out, true);
        out
    }

    /// What was left out: reason, kind of message, how many, first and last stamp [s].
    pub fn left(&self) -> impl Iterator<Item = (Left, &'static str, usize, (f64, f64))> + '_ {
        self.left.iter().map(|((why, kind), (count, from, to))| (*why, *kind, *count, (*from, *to)))
    }

    /// What was left out, as findings.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let finding = |(why, kind, count, (from, to)): (Left, &str, usize, (f64, f64))| {
            let (code, what) = match why {
                Left::Invalid => (Code::ValuesInvalid, "with a number that is not finite or out of its bound"),
                Left::Repeated => (Code::StampsInvalid, "with the stamp of the one before"),
                Left::Leap => (Code::StampsInvalid, "with a stamp far ahead of all others"),
                Left::Late => (Code::StampsLate, "older than the one before"),
            };
            let found = Finding::new(code, format!("{count} {kind} {what} were left out"));
            let found = found.with("messages", count as f64, "1");
            if from.is_finite() && to.is_finite() { found.during(from, to) } else { found }
        };
        self.left().map(finding).collect()
    }

    /// Keeps a message far ahead apart; each message decides about those that already wait so.
    fn sets_aside(&mut self, message: Message) -> bool {
        if let Some(first) = self.leapers.front().map(Message::end) {
            if message.end() > first || self.leapers.len() >= MOST_LEAPERS {
                self.believe();
            } else if message.end() < first - LEAP / 2.0 {
                self.disbelieve();
            }
        }
        if self.newest.is_some_and(|newest| message.end() > newest + LEAP) {
            self.leapers.push_back(message);
            return true;
        }
        self.add(message);
        false
    }

    fn believe(&mut self) {
        while let Some(message) = self.leapers.pop_front() {
            self.add(message);
        }
    }

    fn disbelieve(&mut self) {
        while let Some(message) = self.leapers.pop_front() {
            self.leave(Left::Leap, &message);
        }
    }

    fn add(&mut self, message: Message) {
        let key = message.end();
        self.newest = Some(self.newest.map_or(key, |newest| newest.max(key)));
        self.arrivals += 1;
        let (rank, arrival) = (message.stream().0, self.arrivals);
        self.waiting.push(Waiting { key, rank, arrival, message });
    }

    /// Hands on, oldest first, what has waited long enough.
    fn release(&mut self, out: &mut Vec<Message>, all: bool) {
        let due = self.newest.map_or(f64::NEG_INFINITY, |newest| newest - self.lateness);
        if self.lateness > 0.0 {
            self.waiting
                .sort_by(|a, b| a.key.total_cmp(&b.key).then(a.rank.cmp(&b.rank)).then(a.arrival.cmp(&b.arrival)));
        }
        let ripe = self.waiting.iter().take_while(|w| all || self.lateness == 0.0 || w.key <= due).count();
        let count = ripe.max(self.waiting.len().saturating_sub(MOST));
        let ripe: Vec<Waiting> = self.waiting.drain(..count).collect();
        for waiting in ripe {
            self.pass(waiting.message, out);
        }
    }

    fn pass(&mut self, message: Message, out: &mut Vec<Message>) {
        let (stream, stamp) = (message.stream(), message.stamp());
        match self.last.get(&stream) {
            Some(last) if stamp == *last => self.leave(Left::Repeated, &message),
            Some(last) if stamp < *last => self.leave(Left::Late, &message),
            _ => {
                self.last.insert(stream, stamp);
                out.push(message);
            }
        }
    }

    fn leave(&mut self, why: Left, message: &Message) {
        let stamp = message.stamp();
        let entry = self.left.entry((why, message.kind())).or_insert((0, stamp, stamp));
        entry.0 += 1;
        (entry.1, entry.2) = (entry.1.min(stamp), entry.2.max(stamp));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;
    use groma_models::{BeamGeometry, LaserScan, Odometry};

    fn odometry(stamp: f64) -> Message {
        Message::Odometry(Odometry { stamp, pose: Se2::IDENTITY })
    }

    fn scan(stamp: f64) -> Message {
        let geometry =
            BeamGeometry { angle_min: 0.0, angle_increment: 0.1, time_increment: 0.01, range_min: 0.1, range_max: 9.0 };
        Message::Scan { scanner: 0, scan: LaserScan { stamp, geometry, ranges: vec![1.0; 11], intensities: vec![] } }
    }

    type Passed = (Vec<(f64, u8)>, Vec<(Left, usize)>);

    fn run(lateness: f64, messages: Vec<Message>) -> Passed {
        let mut order = Order::new(lateness);
        let mut out: Vec<Message> = messages.into_iter().flat_map(|m| order.push(m)).collect();
        out.extend(order.drain());
        let left = order.left().map(|(why, _, count, _)| (why, count)).collect();
        (out.iter().map(|m| (m.stamp(), m.stream().0)).collect(), left)
    }

    #[test]
    fn without_lateness_arrival_decides_and_nobody_waits() {
        let mut order = Order::new(0.0);
        assert_eq!(order.push(scan(1.0)).len(), 1);
        assert_eq!(order.push(odometry(0.5)).len(), 1, "another stream, so not late");
        assert_eq!(order.push(odometry(0.4)).len(), 0);
        assert_eq!(
            order.left().map(|(why, _, n, span)| (why, n, span)).collect::<Vec<_>>(),
            [(Left::Late, 1, (0.4, 0.4))]
        );
    }

    #[test]
    fn with_lateness_odometry_up_to_the_end_of_a_sweep_precedes_it() {
        let (out, left) = run(0.2, vec![scan(1.0), odometry(1.05), odometry(1.1), odometry(1.15), odometry(1.02)]);
        assert_eq!(out, [(1.02, 0), (1.05, 0), (1.1, 0), (1.0, 5), (1.15, 0)]);
        assert!(left.is_empty());
    }

    #[test]
    fn a_single_wrong_stamp_is_dropped_and_a_pause_passes() {
        let (out, left) = run(0.0, [0.0, 0.1, 5e5, 0.2, 0.3].map(odometry).to_vec());
        assert_eq!((out.len(), left), (4, vec![(Left::Leap, 1)]));
        let (out, left) = run(0.0, [0.0, 0.1, 90.0, 90.1, 90.2].map(odometry).to_vec());
        assert_eq!((out.len(), left.len()), (5, 0));
        // The first scan after a pause was complete a little before the odometry that came first.
        let (out, left) = run(0.0, vec![odometry(0.0), scan(0.1), odometry(90.0), scan(89.8), odometry(90.1)]);
        assert_eq!((out.len(), left.len()), (5, 0));
    }

    #[test]
    fn repeated_and_endless_stamps_are_counted() {
        let (out, left) = run(0.0, [0.0, 0.0, f64::NAN, f64::INFINITY, 1.0].map(odometry).to_vec());
        assert_eq!((out.len(), left), (2, vec![(Left::Invalid, 2), (Left::Repeated, 1)]));
    }

    #[test]
    fn what_was_left_out_is_found_with_its_count_and_its_time() {
        let mut order = Order::new(0.0);
        [3.0, 1.0, 2.0, f64::NAN].map(odometry).into_iter().for_each(|m| drop(order.push(m)));
        let mut found = order.findings();
        found.sort_by_key(|f| f.code.name());
        assert_eq!(found.iter().map(|f| f.code).collect::<Vec<_>>(), [Code::StampsLate, Code::ValuesInvalid]);
        assert_eq!((found[0].span, found[1].span), (Some((1.0, 2.0)), None));
        assert_eq!(found[0].values[0].value, 2.0);
    }

    #[test]
    fn a_file_asks_for_the_lateness_it_needs() {
        let stamps = [0.0, 0.1, 0.3, 0.2, 5e5, 0.4, 0.25, f64::NAN, 0.5];
        let needed = disorder(stamps);
        assert!((needed - 0.15).abs() < 1e-12);
        let (out, left) = run(needed, stamps.map(odometry).to_vec());
        assert_eq!(out.iter().map(|m| m.0).collect::<Vec<_>>(), [0.0, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5]);
        assert_eq!(left, vec![(Left::Invalid, 1), (Left::Leap, 1)]);
        assert_eq!(disorder([3.0, 4.0, 5.0]), 0.0);
        assert_eq!(disorder([0.0, 20.0, 40.0, 60.0, 1.0]), LEAP, "no file asks for more");
    }

    #[test]
    fn what_waits_is_bounded() {
        let mut order = Order::new(10.0);
        let passed: usize = (0..3 * MOST).map(|k| order.push(odometry(1e-4 * k as f64)).len()).sum();
        assert_eq!(passed, 2 * MOST);
    }
}

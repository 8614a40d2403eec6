//! All rows of a drive at once, for an estimate over the whole of it, and where they do not hang together.

use super::{WheelReader, WheelRow};
use crate::message::{Message, WheelReading};
use crate::order::{Order, disorder};
use groma_models::finding::Code;
use groma_models::{Finding, WheelKind, WheelLog, wheel_log};
use nalgebra::Vector2;

/// The rows of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct WheelRecord {
    kind: WheelKind,
    times: Vec<f64>,
    readings: Vec<Vector2<f64>>,
    breaks: Vec<(f64, f64)>,
}

impl WheelRecord {
    /// A record without rows.
    #[must_use]
    pub fn new(kind: WheelKind) -> Self {
        Self { kind, times: Vec::new(), readings: Vec::new(), breaks: Vec::new() }
    }

    /// Reads the messages of a file, which asks for as much lateness as its joints are disordered.
    #[must_use]
    pub fn read(kind: WheelKind, messages: Vec<WheelReading>) -> (Self, Vec<Finding>) {
        let of_joint = |joint: usize| {
            let has = move |m: &&WheelReading| m.positions.iter().any(|(k, _)| *k == joint);
            disorder(messages.iter().filter(has).map(|m| m.stamp))
        };
        let lateness = of_joint(0).max(of_joint(1));
        let (record, findings) = Self::ordered(kind, messages, lateness);
        let text = format!("readings of the wheels came up to {lateness:.3} s late and were put into order");
        let disordered = Finding::new(Code::StampsDisordered, text).with("lateness", lateness, "s");
        (record, (lateness > 0.0).then_some(disordered).into_iter().chain(findings).collect())
    }

    /// Reads messages, those up to `lateness` seconds late put into order.
    pub fn ordered(
        kind: WheelKind,
        messages: impl IntoIterator<Item = WheelReading>,
        lateness: f64,
    ) -> (Self, Vec<Finding>) {
        let (mut record, mut reader, mut order) = (Self::new(kind), WheelReader::new(kind), Order::new(lateness));
        let mut take = |ordered: Vec<Message>| {
            for message in ordered {
                if let Message::Wheels(reading) = message {
                    reader.push(&reading).iter().for_each(|row| record.push(row));
                }
            }
        };
        for message in messages {
            take(order.push(Message::Wheels(message)));
        }
        take(order.drain());
        let findings = order.findings().into_iter().chain(reader.findings()).collect();
        (record, findings)
    }

    /// Appends a row of a [`WheelReader`].
    pub fn push(&mut self, row: &WheelRow) {
        if let Some(before) = self.times.last().filter(|_| row.step.is_none()) {
            self.breaks.push((*before, row.stamp));
        }
        self.times.push(row.stamp);
        self.readings.push(row.reading);
    }

    /// Stamps of the rows, strictly rising [s].
    #[must_use]
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Counters unrolled; a steering angle within half a turn [rad].
    #[must_use]
    pub fn readings(&self) -> &[Vector2<f64>] {
        &self.readings
    }

    /// Neighbouring stamps between which the rows do not hang together [s].
    #[must_use]
    pub fn breaks(&self) -> &[(f64, f64)] {
        &self.breaks
    }

    /// The rows as a log.
    ///
    /// # Errors
    /// When there are fewer than two.
    pub fn log(&self) -> Result<WheelLog, wheel_log::Error> {
        WheelLog::new(self.kind, self.times.clone(), self.readings.clone())
    }
}

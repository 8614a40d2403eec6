//! Calibration of a vehicle from its messages: wheels, and scans or poses of the sensor.
//!
//! ```text
//! wheels -> one reader          rows, breaks
//! scans  -> follower            tracked as they come; those that a station may use are kept      (keeping)
//! poses  -> kept                where somebody else measured how the sensor moved                (poses)
//! asked  -> segments            standstills or windows, by the wheels so far                     (segments, standstill)
//!        -> motions             between stations, gated by reason                                (gate)
//!        -> coupling            what neighbours share: a scan                                    (coupling)
//!        -> estimate            wheels, steering, laser pose, delay with covariance              (`calibration`)
//!        -> findings, verdict                                                                    (judgement)
//! ```
//!
//! Messages are taken in the order of their arrival; nothing looks ahead. What a drive is cut into needs all of its wheels, so
//! it is cut anew whenever somebody asks: [`CalibrateVehicle::snapshot`] gives what `finish` would give if nothing more came.

mod coupling;
mod gate;
mod judgement;
mod keeping;
mod paths;
mod poses;
mod segments;
mod settings;
mod standstill;

use crate::message::Message;
use crate::order::Order;
use crate::wheels::{WheelReader, WheelRecord};
use gate::{Candidate, gated};
use groma_calibration::vehicle::{self, Calibration, Model, Motions, Request, calibrate};
use groma_egomotion::Follower;
use groma_egomotion::follower::Skipped;
use groma_models::finding::{Code, Kind, verdict};
use groma_models::{Cancelled, Finding, LaserScan, ModelError, Token, WheelLog};
use keeping::Keeping;
use poses::SensorPoses;
use standstill::Rates;
use std::collections::BTreeMap;
use thiserror::Error;

pub use gate::{LeftOut, Reason};
pub use judgement::{CONFIDENCE, missed, more_driving};
pub use paths::LaserPath;
pub use segments::{SegmentKind, Segments};
pub use settings::{Settings, Source};

/// Readings of the wheels without which there is nothing to work with.
const LEAST_READINGS: usize = 3;

/// Why there is no calibration.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum Error {
    /// A setting is out of range.
    #[error(transparent)]
    Setting(#[from] ModelError),
    /// No model has this name.
    #[error("model {0:?}: it is one of tricycle, tricycle-asymmetric, differential")]
    UnknownModel(String),
    /// Hardly a reading of the wheels came.
    #[error("{0} readings of the wheels are too few to calibrate by")]
    FewReadings(usize),
    /// No motion of the sensor can be used.
    #[error("no motion of the sensor to calibrate by ({0})")]
    NoMotion(String),
    /// The estimate refused its input.
    #[error(transparent)]
    Estimate(#[from] vehicle::Error),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What has come so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Readings of the wheels, and first and last of their stamps [s].
    pub readings: usize,
    /// See [`Self::readings`].
    pub wheels: Option<(f64, f64)>,
    /// Scans or poses of the sensor, and first and last of their stamps [s].
    pub sights: usize,
    /// See [`Self::sights`].
    pub sensor: Option<(f64, f64)>,
    /// Scans that are kept.
    pub kept: usize,
    /// Whether the wheels stand, by their last reading.
    pub stands: bool,
}

/// A calibration with what it was made of.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The estimate.
    pub calibration: Calibration,
    /// Readings of the wheels.
    pub log: WheelLog,
    /// Intervals in which the readings do not hang together [s].
    pub breaks: Vec<(f64, f64)>,
    /// How the drive was cut.
    pub segments: Segments,
    /// The motions it was made of.
    pub motions: Motions,
    /// Those that were left out.
    pub left_out: Vec<LeftOut>,
    /// All that was noticed.
    pub findings: Vec<Finding>,
    /// The one word that follows.
    pub verdict: &'static str,
}

/// Calibrates a vehicle from its messages.
pub struct CalibrateVehicle {
    settings: Settings,
    model: Option<Model>,
    order: Order,
    reader: WheelReader,
    record: WheelRecord,
    keeping: Keeping,
    follower: Follower,
    poses: SensorPoses,
    skipped: BTreeMap<Skipped, (usize, f64, f64)>,
    bad_poses: usize,
}

impl CalibrateVehicle {
    /// A machine that has seen nothing.
    ///
    /// # Errors
    /// A setting out of range, by name.
    pub fn new(settings: Settings) -> Result<Self, Error> {
        settings.validate()?;
        settings.estimate.validate()?;
        let (kind, model) = (settings.wheels()?, settings.asked_model()?);
        Ok(Self {
            model,
            order: Order::new(settings.lateness),
            reader: WheelReader::new(kind),
            record: WheelRecord::new(kind),
            keeping: Keeping::new(kind, settings.window),
            follower: Follower::default(),
            poses: SensorPoses::default(),
            skipped: BTreeMap::new(),
            bad_poses: 0,
            settings,
        })
    }

    /// Takes a message: wheels, scans of the first scanner, or odometry that is poses of the sensor. Others are passed over.
    pub fn push(&mut self, message: Message) {
        for message in self.order.push(message) {
            self.take(message);
        }
    }

    /// What has come so far.
    #[must_use]
    pub fn state(&self) -> State {
        let times = self.record.times();
        let of_scans = self.settings.source == Source::Scans;
        State {
            readings: times.len(),
            wheels: times.first().copied().zip(times.last().copied()),
            sights: if of_scans { self.follower.len() } else { self.poses.len() },
            sensor: if of_scans { self.follower.span() } else { self.poses.span() },
            kept: self.follower.kept(),
            stands: self.keeping.stands(f64::INFINITY),
        }
    }

    /// What was noticed about the messages so far.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let skipped = self.skipped.iter().map(|(why, (count, from, to))| {
            let reason = match why {
                Skipped::Late => "their stamp is not after that of the scan before",
                Skipped::Empty => "fewer than ten hits",
            };
            let text = format!("{count} scans left out: {reason}");
            Finding::new(Code::ScansUnusable, text).during(*from, *to).with("count", *count as f64, "1")
        });
        let bad = (self.bad_poses > 0).then(|| {
            let text =
                format!("{} poses of the sensor left out: no number, or not after the one before", self.bad_poses);
            Finding::new(Code::ValuesInvalid, text).with("count", self.bad_poses as f64, "1")
        });
        self.order.findings().into_iter().chain(self.reader.findings()).chain(skipped).chain(bad).collect()
    }

    /// What `finish` would give if nothing more came; messages that still wait for their turn do not count.
    ///
    /// # Errors
    /// See [`Error`]; [`Error::Cancelled`] soon after the token was.
    pub fn snapshot(&self, token: &Token) -> Result<Outcome, Error> {
        let (log, breaks) = self.log()?;
        let rates = Rates::new(&log, &breaks);
        let mut segments = Segments::new(&log, &rates, self.settings.window);
        let candidates: Vec<Candidate> = if self.settings.source == Source::Scans {
            self.follower.motions(&segments.stations, token)?.iter().map(Candidate::from).collect()
        } else {
            segments = self.poses.as_stations(segments, self.settings.window);
            self.poses.motions(&segments.stations)
        };
        let (motions, left_out) = gated(&candidates, &log, &breaks, &rates);
        if motions.motions.is_empty() {
            return Err(Error::NoMotion(reasons(&left_out)));
        }
        token.begin(0);
        let free: Vec<&str> = self.settings.free.iter().map(String::as_str).collect();
        let calibration = calibrate(&log, &motions, &self.request(&free), &self.settings.estimate, token)?;
        let mut findings = self.findings();
        findings.extend(judgement::left_out(&left_out));
        findings.extend(judgement::findings(&calibration, segments.kind));
        let codes: Vec<Code> = findings.iter().map(|f| f.code).collect();
        let verdict = verdict(Kind::Vehicle, &codes);
        Ok(Outcome { calibration, log, breaks, segments, motions, left_out, findings, verdict })
    }

    /// The result of all messages.
    ///
    /// # Errors
    /// As [`Self::snapshot`].
    pub fn finish(&mut self, token: &Token) -> Result<Outcome, Error> {
        for message in self.order.drain() {
            self.take(message);
        }
        self.snapshot(token)
    }

    fn take(&mut self, message: Message) {
        match message {
            Message::Wheels(reading) => {
                for row in self.reader.push(&reading) {
                    self.keeping.read(&row);
                    self.record.push(&row);
                }
            }
            Message::Scan { scanner: 0, scan } if self.settings.source == Source::Scans => self.follow(scan),
            Message::Odometry(pose) if self.settings.source == Source::Poses => {
                self.bad_poses += usize::from(!self.poses.push(&pose));
            }
            _ => {}
        }
    }

    fn follow(&mut self, scan: LaserScan) {
        let stamp = scan.stamp;
        let fate = self.keeping.decide(stamp);
        if let Err(why) = self.follower.push(scan, fate.stands, fate.keep) {
            let entry = self.skipped.entry(why).or_insert((0, stamp, stamp));
            *entry = (entry.0 + 1, entry.1.min(stamp), entry.2.max(stamp));
        }
    }

    fn log(&self) -> Result<(WheelLog, Vec<(f64, f64)>), Error> {
        let count = self.record.times().len();
        if count < LEAST_READINGS {
            return Err(Error::FewReadings(count));
        }
        let log = self.record.log().map_err(vehicle::Error::from)?;
        Ok((log, self.record.breaks().to_vec()))
    }

    fn request<'a>(&self, free: &'a [&'a str]) -> Request<'a> {
        let s = &self.settings;
        Request { model: self.model, wheelbase: s.wheelbase, gain: s.gain, delay: s.delay, free }
    }
}

/// Why motions were left out, in one line.
fn reasons(left_out: &[LeftOut]) -> String {
    let told = judgement::left_out(left_out);
    let told: Vec<&str> = told.iter().map(|f| f.text.as_str()).collect();
    if told.is_empty() { "the vehicle never drove".into() } else { told.join(", ") }
}

#[cfg(test)]
mod tests;

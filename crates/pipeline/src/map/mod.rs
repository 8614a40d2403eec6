//! Mapping as a machine: scans and odometry pushed as they come, a map at any moment.
//!
//! ```text
//! message -> order (bounded lateness) -> cover -> mapper: tracker, local maps, closures -> pose graph -> map, findings, verdict
//! ```
//!
//! Odometry comes as such, or is summed from the wheels of a calibrated vehicle ([`Map::of_vehicle`]).
//!
//! Nobody waits for odometry: the pose of a scan that it does not cover yet is extrapolated, and corrected when it comes
//! (`cover.rs`). Asking for the state or for a snapshot changes nothing: a drive mapped in one go and one that was looked at on
//! the way give the same bytes, as do any numbers of threads. Messages of other kinds, and scans of other scanners than the
//! first, are passed over.
//!
//! What was noticed on the way and in the result is told as findings (`findings.rs`), and the verdict follows from them.

mod cover;
mod findings;
mod stream;

use crate::message::Message;
use crate::order::Order;
use crate::wheels::WheelOdometry;
use cover::Cover;
use groma_geometry::Se2;
use groma_mapping::conclude::Error;
use groma_mapping::map_result::MapResult;
use groma_mapping::mapper::{Mapper, State};
use groma_mapping::options::Options;
use groma_models::bounds::{ANGLE, COORDINATE};
use groma_models::finding::{Kind, verdict};
use groma_models::{Finding, LaserScan, Odometry, Token, Vehicle};
use stream::Stream;

pub use stream::Refused;

/// A map, and what is to be said of it.
pub struct Outcome {
    /// The map.
    pub map: MapResult,
    /// Numbers of the run, under the names that files give them.
    pub counts: Vec<(&'static str, f64)>,
    /// What was noticed.
    pub findings: Vec<Finding>,
    /// The word that follows from the findings.
    pub verdict: &'static str,
}

/// Builds a map from messages.
#[derive(Clone)]
pub struct Map {
    order: Order,
    cover: Cover,
    mapper: Mapper,
    t_base_laser: Se2,
    wheels: Option<WheelOdometry>,
    stream: Stream,
}

impl Map {
    /// An empty map of a laser mounted at `t_base_laser`.
    ///
    /// # Errors
    /// A setting or a number of the mount that is out of range, by name.
    pub fn new(options: Options, t_base_laser: Se2) -> Result<Self, Refused> {
        options.validate()?;
        COORDINATE.check("laser_x", t_base_laser.x())?;
        COORDINATE.check("laser_y", t_base_laser.y())?;
        ANGLE.check("laser_yaw", t_base_laser.theta())?;
        Ok(Self {
            order: Order::new(options.lateness),
            cover: Cover::default(),
            mapper: Mapper::new(options),
            t_base_laser,
            wheels: None,
            stream: Stream::default(),
        })
    }

    /// An empty map of a calibrated vehicle: its odometry is that of its wheels, its laser the first scanner's. Other odometry
    /// is passed over.
    ///
    /// # Errors
    /// A setting that is out of range, by name.
    pub fn of_vehicle(options: Options, vehicle: &Vehicle) -> Result<Self, Refused> {
        let map = Self::new(options, vehicle.mount())?;
        Ok(Self { wheels: Some(WheelOdometry::new(vehicle)), ..map })
    }

    /// Takes a message. Those whose turn has come are worked off.
    pub fn push(&mut self, message: Message) {
        let message = match (message, &self.wheels) {
            (Message::Wheels(reading), Some(wheels)) => Message::Wheels(wheels.on_scan_clock(reading)),
            (other, _) => other,
        };
        self.stream.read(&message);
        for message in self.order.push(message) {
            self.take(message);
        }
    }

    fn take(&mut self, message: Message) {
        let end = message.end();
        match message {
            Message::Scan { scanner: 0, scan } => {
                let ready = self.cover.scan(scan, end);
                self.register(&ready);
            }
            Message::Odometry(reading) if self.wheels.is_none() => self.take_odometry(reading),
            Message::Wheels(reading) => {
                let poses = self.wheels.as_mut().map_or_else(Vec::new, |wheels| wheels.push(&reading));
                poses.into_iter().for_each(|pose| self.take_odometry(pose));
            }
            _ => {}
        }
    }

    fn take_odometry(&mut self, reading: Odometry) {
        self.mapper.push_odometry(reading);
        self.stream.odometry(reading);
        let ready = self.cover.odometry(reading.stamp);
        self.register(&ready);
    }

    fn register(&mut self, scans: &[LaserScan]) {
        for scan in scans {
            let outcome = self.mapper.push_scan(scan, &self.t_base_laser);
            self.stream.scan(scan.stamp, outcome);
        }
    }

    /// Where the vehicle was at the last scan, with its covariance, and how large the map is; none before the first scan.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        match self.cover.waiting() {
            Some((first, last)) => Some(self.mapper.predict(first, last)),
            None => self.mapper.state(),
        }
    }

    /// The map of the messages whose turn has come; the machine goes on as if nobody had asked. Cancelled, it is the map
    /// of the current graph.
    ///
    /// # Errors
    /// When no scan could be used, or the pose graph cannot be solved.
    pub fn snapshot(&self, token: &Token) -> Result<Outcome, Error> {
        if self.cover.waiting().is_none() {
            return self.outcome(token);
        }
        let mut copy = self.clone();
        copy.settle();
        copy.outcome(token)
    }

    /// Takes the scans whose odometry has not come as it is.
    fn settle(&mut self) {
        let rest = self.cover.drain();
        self.register(&rest);
    }

    fn outcome(&self, token: &Token) -> Result<Outcome, Error> {
        let map = self.mapper.finish(token)?;
        let mut found = self.order.findings();
        found.extend(self.wheels.iter().flat_map(WheelOdometry::findings));
        found.extend(self.cover.finding());
        found.extend(self.stream.findings());
        found.extend(findings::findings(&map));
        let mut counts = self.stream.counts();
        counts.extend(map.counts());
        let codes: Vec<_> = found.iter().map(|f| f.code).collect();
        Ok(Outcome { verdict: verdict(Kind::Map, &codes), map, counts, findings: found })
    }

    /// The map of all messages, those that still waited for their turn included.
    ///
    /// # Errors
    /// As [`Self::snapshot`].
    pub fn finish(mut self, token: &Token) -> Result<Outcome, Error> {
        for message in self.order.drain() {
            self.take(message);
        }
        self.settle();
        self.outcome(token)
    }
}

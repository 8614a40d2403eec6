//! The machine: messages in, fixes out.

use super::considered::considered;
use super::filter::{Change, Filter};
use super::motions::{Reading, Source};
use super::result::{Counts, Localized};
use super::seen::Seen;
use super::{Error, Options, findings};
use crate::message::{Message, StartPose, WheelReading};
use crate::order::Order;
use crate::wheels::WheelReader;
use groma_geometry::Se2;
use groma_localization::{Localizer, Mode, Quality, Relocalizer, Start};
use groma_models::{Grid, LandmarkMap, LaserScan, Odometry, Vehicle};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Standard deviations of a start in a map that a person gave [m], [m], [rad].
const GIVEN: [f64; 3] = [0.2, 0.2, 0.1];
/// Those of a start that is the origin by definition, because there is no map.
const EXACT: [f64; 3] = [1e-4, 1e-4, 1e-5];

/// Where a drive begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Begin {
    /// Nobody knows: it is searched for; without a map it is the origin.
    #[default]
    Unknown,
    /// About there, as a person says.
    About(Se2),
    /// There, with the covariance of the right perturbation.
    At(Se2, Matrix3<f64>),
}

/// What a drive is localized with.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Landmarks of the map; none where there is no map.
    pub map: LandmarkMap,
    /// Walls of the map, where it has any.
    pub grid: Option<Grid>,
    /// Where the drive begins.
    pub begin: Begin,
    /// `T_base_laser`, where there is no vehicle.
    pub mount: Se2,
    /// A calibrated vehicle: motions are those of its wheels, the mount is its first scanner's.
    pub vehicle: Option<Vehicle>,
    /// Settings.
    pub options: Options,
}

/// What a message brought.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// The fix that is new or was corrected, counted from 0.
    pub scan: usize,
    /// Whether it was there before.
    pub corrected: bool,
}

/// The vehicle now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Time of the last motion or scan [s].
    pub stamp: f64,
    /// `T_map_base`.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
    /// The quality of the pose.
    pub quality: Quality,
}

/// A drive on its way through the localizer.
pub struct Localize {
    order: Order,
    filter: Filter,
    seen: Seen,
    /// The reader of the wheels of a vehicle, and the delay of their clock [s].
    wheels: Option<(WheelReader, f64)>,
    landmarks: usize,
    started: bool,
    counts: Counts,
    odometry: Option<Odometry>,
    jumps: Vec<f64>,
}

impl Localize {
    /// Gets ready; where the start is searched for this prepares the map, which takes a while.
    ///
    /// # Errors
    /// A setting out of range; a map or a start that cannot be used.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        setup.options.validate()?;
        let Setup { map, grid, begin, mount, vehicle, options } = setup;
        let start = Start {
            stamp: 0.0,
            pose: start_pose(begin, map.landmarks.is_empty() && grid.is_none()),
            mount: vehicle.as_ref().map_or(mount, Vehicle::mount),
            calibration: vehicle.as_ref().and_then(considered),
        };
        let landmarks = map.landmarks.len();
        let searched = options.localizer.mode != Mode::Dynamic && (landmarks > 0 || grid.is_some());
        let mut localizer = Localizer::new(map.clone(), &start, options.localizer)?;
        if searched {
            let relocalizer = Relocalizer::new(map, grid, options.relocalize)?;
            localizer = localizer.with_relocalizer(Arc::new(relocalizer));
        }
        let source = match &vehicle {
            Some(vehicle) => Source::Wheels(*vehicle.drive(), *vehicle.noise()),
            None => Source::Odometry(options.odometry),
        };
        Ok(Self {
            order: Order::new(options.lateness),
            filter: Filter::new(localizer, source),
            seen: Seen::new(start.mount),
            wheels: vehicle.map(|v| (WheelReader::new(v.wheels()), v.delay())),
            landmarks,
            started: false,
            counts: Counts::default(),
            odometry: None,
            jumps: Vec::new(),
        })
    }

    /// Takes a message.
    pub fn push(&mut self, message: Message) -> Vec<Event> {
        let ready = self.order.push(message);
        ready.into_iter().flat_map(|message| self.take(message)).collect()
    }

    /// The vehicle now; none before the first message that tells the time.
    #[must_use]
    pub fn state(&self) -> Option<State> {
        let now = self.filter.localizer();
        let (stamp, pose, covariance, quality) = (now.stamp(), now.pose(), now.covariance(), now.quality());
        self.started.then_some(State { stamp, pose, covariance, quality })
    }

    /// Scans taken so far.
    #[must_use]
    pub fn scans(&self) -> usize {
        self.filter.track.len()
    }

    /// The result so far, without what still waits for later messages.
    ///
    /// # Errors
    /// [`Error::NoScan`].
    pub fn snapshot(&self) -> Result<Localized, Error> {
        if self.filter.track.is_empty() {
            return Err(Error::NoScan);
        }
        let mut result = Localized::new(self.filter.track.clone(), self.landmarks, self.seen.landmarks(), self.counts);
        result.findings = findings::findings(&result, &self.order, &self.jumps);
        result.findings.extend(self.wheels.iter().flat_map(|(reader, _)| reader.findings()));
        Ok(result)
    }

    /// Takes what still waits; the result.
    ///
    /// # Errors
    /// [`Error::NoScan`].
    pub fn finish(&mut self) -> Result<Localized, Error> {
        for message in self.order.drain() {
            self.take(message);
        }
        let changes = self.filter.release();
        self.note(changes);
        self.snapshot()
    }

    fn take(&mut self, message: Message) -> Vec<Event> {
        let changes = match message {
            Message::Scan { scanner: 0, scan } => self.take_scan(scan),
            Message::Odometry(reading) if self.wheels.is_none() => self.take_odometry(reading),
            Message::Wheels(reading) if self.wheels.is_some() => self.take_wheels(&reading),
            Message::StartPose(start) => self.take_start(&start),
            _ => {
                self.counts.passed_over += 1;
                Vec::new()
            }
        };
        self.note(changes)
    }

    fn take_scan(&mut self, scan: LaserScan) -> Vec<Change> {
        self.counts.scans_read += 1;
        self.start(scan.stamp);
        self.filter.take(scan)
    }

    fn take_odometry(&mut self, reading: Odometry) -> Vec<Change> {
        self.counts.odometry_read += 1;
        self.start(reading.stamp);
        if self.odometry.replace(reading).is_some_and(|before| before.jumps_to(&reading)) {
            self.jumps.push(reading.stamp);
        }
        self.filter.read(reading.stamp, Reading::Pose(reading.pose))
    }

    fn take_wheels(&mut self, reading: &WheelReading) -> Vec<Change> {
        self.counts.wheels_read += 1;
        let Some((reader, delay)) = &mut self.wheels else { return Vec::new() };
        let (rows, delay) = (reader.push(reading), *delay);
        let mut changes = Vec::new();
        for row in rows {
            self.start(row.stamp - delay);
            if row.step.is_none() {
                self.filter.restart();
            }
            changes.extend(self.filter.read(row.stamp - delay, Reading::Wheels(row.reading)));
        }
        changes
    }

    fn take_start(&mut self, start: &StartPose) -> Vec<Change> {
        self.start(start.stamp);
        let taken = self.filter.relocate(start.stamp, start.pose, &start.covariance);
        taken.unwrap_or_else(|_| {
            self.counts.passed_over += 1;
            Vec::new()
        })
    }

    /// The first message tells the time.
    fn start(&mut self, stamp: f64) {
        if !self.started {
            self.filter.start(stamp);
            self.started = true;
        }
    }

    fn note(&mut self, changes: Vec<Change>) -> Vec<Event> {
        let mut events = Vec::new();
        for change in changes {
            if let Some(scan) = &change.settled {
                self.seen.push(scan, &self.filter.track[change.index]);
            }
            if change.new || change.corrected {
                events.push(Event { scan: change.index, corrected: change.corrected });
            }
        }
        events
    }
}

/// The pose of the start and its covariance; none where it is searched for.
fn start_pose(begin: Begin, empty: bool) -> Option<(Se2, Matrix3<f64>)> {
    let square = |sigmas: [f64; 3]| Matrix3::from_diagonal(&Vector3::from(sigmas).map(|s| s * s));
    match begin {
        Begin::At(pose, covariance) => Some((pose, covariance)),
        Begin::About(pose) => Some((pose, square(if empty { EXACT } else { GIVEN }))),
        Begin::Unknown => empty.then(|| (Se2::IDENTITY, square(EXACT))),
    }
}

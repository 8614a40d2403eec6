//! Everything that a simulation depends on, and the scenarios that have a name.

use crate::drive::{Limits, Vehicle, WheelErrors};
use crate::error::SimulationError;
use crate::scanner::Scanner;
use crate::scenes::depot::Depot;
use serde::{Deserialize, Serialize};

/// Bounds of what must be above 0.
const LEAST: f64 = 1e-4;
const MOST: f64 = 1e6;

/// Names of the scenarios.
pub const SCENES: [&str; 6] = ["rooms", "warehouse", "loop", "stalls", "turns", "depot"];

/// A building and a route through it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Building {
    /// An office floor: corridors around two blocks, rooms with doors and furniture.
    Rooms,
    /// Racks with pallets, reflectors, columns, a perimeter.
    Warehouse,
    /// Two kilometres of corridors in one loop.
    Loop,
    /// The warehouse, hung with reflectors, on a day of its life.
    Depot(Depot),
}

/// Everything that a simulation depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Where.
    pub building: Building,
    /// Seed of everything random.
    pub seed: u64,
    /// Time of the start [s].
    pub start: f64,
    /// What drives.
    pub vehicle: Vehicle,
    /// Radius of the circle around the base that must stay free [m].
    pub clearance: f64,
    /// How fast it drives.
    pub limits: Limits,
    /// What it sees with.
    pub scanner: Scanner,
    /// What is wrong with its wheels.
    pub wheels: WheelErrors,
    /// Odometry and joints are reported every so many steps of the drive.
    pub odometry_every: usize,
    /// How often the odometry stalls.
    pub stalls: usize,
    /// How long a stall lasts [s].
    pub stall_duration: f64,
}

impl Default for Scenario {
    /// The office floor.
    fn default() -> Self {
        Self {
            building: Building::Rooms,
            seed: 1,
            start: 100.0,
            vehicle: Vehicle::Differential { left_radius: 0.098, right_radius: 0.098, separation: 0.36 },
            clearance: 0.22,
            limits: Limits::default(),
            scanner: Scanner::default(),
            wheels: WheelErrors::default(),
            odometry_every: 2,
            stalls: 0,
            stall_duration: 0.0,
        }
    }
}

impl Scenario {
    /// The scenario called `name`, with the given seed.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn named(name: &str, seed: u64) -> Result<Self, SimulationError> {
        let rooms = Self { seed, ..Self::default() };
        match name {
            "rooms" => Ok(rooms),
            "stalls" => Ok(Self { stalls: 8, stall_duration: 1.0, ..rooms }),
            "turns" => Ok(turns(rooms)),
            "loop" => Ok(two_kilometres(rooms)),
            "warehouse" => Ok(warehouse(rooms)),
            "depot" => Ok(depot(warehouse(rooms))),
            _ => Err(SimulationError::UnknownScene { kind: "scene", name: name.to_owned(), known: &SCENES }),
        }
    }

    /// Whether every setting makes sense.
    ///
    /// # Errors
    /// Names the first setting that does not.
    pub fn check(&self) -> Result<(), SimulationError> {
        let (limits, scanner) = (&self.limits, &self.scanner);
        let positive = [
            ("limits.step", limits.step),
            ("limits.speed", limits.speed),
            ("limits.acceleration", limits.acceleration),
            ("limits.turn_rate", limits.turn_rate),
            ("limits.turn_acceleration", limits.turn_acceleration),
            ("limits.ahead", limits.ahead),
            ("scanner.period", scanner.period),
            ("scanner.range_max", scanner.range_max),
            ("scanner.beams", scanner.beams as f64),
            ("odometry_every", self.odometry_every as f64),
        ];
        let at_least_zero = [
            ("clearance", self.clearance),
            ("limits.corner_radius", limits.corner_radius),
            ("limits.sway", limits.sway),
            ("scanner.time_increment", scanner.time_increment),
            ("scanner.range_min", scanner.range_min),
            ("scanner.sigma", scanner.sigma),
            ("scanner.quantum", scanner.quantum),
            ("scanner.dropout", scanner.dropout),
            ("wheels.slip", self.wheels.slip),
            ("wheels.encoder_step", self.wheels.encoder_step),
            ("wheels.final_error", self.wheels.final_error.unwrap_or(0.0)),
            ("stall_duration", self.stall_duration),
        ];
        require(&positive, |x| (LEAST..=MOST).contains(&x), "must be from 1e-4 to 1e6")?;
        require(&at_least_zero, |x| (0.0..=MOST).contains(&x), "must be from 0 to 1e6")?;
        require(&[("scanner.dropout", scanner.dropout)], |x| x <= 1.0, "must be at most 1")?;
        scanner.check()?;
        if let Building::Depot(depot) = self.building {
            let shares = [("building.changed", depot.changed), ("building.reflectors", depot.reflectors)];
            require(&shares, |x| (0.0..=1.0).contains(&x), "must be from 0 to 1")?;
        }
        self.check_vehicle()
    }

    fn check_vehicle(&self) -> Result<(), SimulationError> {
        let sizes = match self.vehicle {
            Vehicle::Differential { left_radius, right_radius, separation } => {
                [("left_radius", left_radius), ("right_radius", right_radius), ("separation", separation)]
            }
            Vehicle::Tricycle { radius, wheelbase, .. } => {
                [("radius", radius), ("wheelbase", wheelbase), ("wheelbase", wheelbase)]
            }
        };
        require(&sizes, |x| (LEAST..=MOST).contains(&x), "must be from 1e-4 to 1e6")
    }
}

fn require(
    settings: &[(&'static str, f64)],
    holds: impl Fn(f64) -> bool,
    rule: &'static str,
) -> Result<(), SimulationError> {
    let wrong = settings.iter().find(|(_, value)| !holds(*value));
    wrong.map_or(Ok(()), |&(name, value)| Err(SimulationError::Setting { name, value, rule }))
}

/// Scans so rare that the vehicle turns by more than 40 degrees between two of them.
fn turns(rooms: Scenario) -> Scenario {
    Scenario {
        limits: Limits { speed: 0.6, turn_rate: 1.0, ..Limits::default() },
        scanner: Scanner { period: 1.0, ..Scanner::default() },
        ..rooms
    }
}

/// Two kilometres, a scan every two seconds, 30 m of odometry error.
fn two_kilometres(rooms: Scenario) -> Scenario {
    let step = 0.5_f64.to_radians();
    Scenario {
        building: Building::Loop,
        limits: Limits { speed: 0.6, ..Limits::default() },
        scanner: Scanner {
            beams: 361,
            angle_min: -180.0 * step,
            angle_increment: step,
            period: 2.0,
            range_max: 50.0,
            ..Scanner::default()
        },
        wheels: WheelErrors { final_error: Some(30.0), ..WheelErrors::default() },
        odometry_every: 5,
        ..rooms
    }
}

/// A forklift with a scanner that sees reflectors and takes its time for a sweep.
fn warehouse(rooms: Scenario) -> Scenario {
    let period = 0.2;
    Scenario {
        building: Building::Warehouse,
        vehicle: Vehicle::Tricycle { radius: 0.12, wheelbase: 1.35, steering_offset: 0.0 },
        clearance: 0.6,
        limits: Limits { speed: 1.2, turn_rate: 0.7, corner_radius: 1.8, ahead: 0.8, sway: 0.1, ..Limits::default() },
        scanner: Scanner {
            mount: [1.1, 0.0, 0.0],
            period,
            time_increment: period * 0.75 / 541.0,
            ..Scanner::default()
        },
        ..rooms
    }
}

/// The forklift of the warehouse with a scanner of a quarter of a degree, 12 mm of range noise and a steering offset: the
/// vehicle whose halting accuracy is measured (F. Kallasi, thesis, Parma 2017, tables 5.1 to 5.3).
fn depot(warehouse: Scenario) -> Scenario {
    let (step, period) = (0.25_f64.to_radians(), 0.1);
    Scenario {
        building: Building::Depot(Depot::default()),
        vehicle: Vehicle::Tricycle { radius: 0.12, wheelbase: 1.35, steering_offset: -0.0131 },
        scanner: Scanner {
            mount: [1.1, 0.002, 0.0075],
            beams: 1081,
            angle_min: -540.0 * step,
            angle_increment: step,
            period,
            time_increment: period * 0.75 / 1081.0,
            sigma: 0.012,
            ..warehouse.scanner
        },
        odometry_every: 1,
        ..warehouse
    }
}

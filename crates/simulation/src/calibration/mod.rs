//! Recordings for the calibration of a vehicle: wheels and scans of a drive in a hall, from known parameters.
//!
//! Unlike the other scenarios, which begin with a path and ask what the wheels must do,
//! here the wheels are commanded, and the path is what comes of it: the parameters are then exactly those of the kinematic
//! model, slip and steering error are what the wheels do beside it.
//!
//! Readings of the wheels are those of the true time but bear the stamp `time + delay`.

pub mod drivetrain;
pub mod program;

pub use drivetrain::{Drivetrain, DrivetrainNoise};
pub use program::Program;

use crate::drive::Drive;
use crate::error::SimulationError;
use crate::scanner::Scanner;
use crate::scenes::hall;
use crate::world::{RayCaster, World};
use drivetrain::{Demand, Disturbance};
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::Se2;
use groma_models::{LaserScan, Token};
use nalgebra::Vector2;
use program::Floor;
use serde::{Deserialize, Serialize};

/// Time of one step of the drive [s].
const STEP: f64 = 0.01;
/// Radius around base and front that must stay free [m].
const CLEARANCE: f64 = 0.3;

/// Everything that a recording for calibration depends on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibrationScenario {
    /// Seed of everything random.
    pub seed: u64,
    /// Time of the start [s].
    pub start: f64,
    /// The vehicle.
    pub drivetrain: Drivetrain,
    /// What its wheels do beside what they are told.
    pub noise: DrivetrainNoise,
    /// What is driven.
    pub program: Program,
    /// Speed of the driven wheel, or of the base of a differential drive [m/s].
    pub speed: f64,
    /// The laser; its mount is the truth to be found.
    pub scanner: Scanner,
    /// Stamps of the wheels minus true time [s].
    pub delay: f64,
    /// Time between two readings of the wheels [s].
    pub wheel_period: f64,
}

impl CalibrationScenario {
    /// A forklift (or a differential drive) with the parameters of Kallasi's tables, on 16 arcs.
    #[must_use]
    pub fn new(drivetrain: Drivetrain, seed: u64) -> Self {
        let degrees = f64::to_radians;
        let program = match drivetrain {
            Drivetrain::Tricycle { .. } => {
                Program::Arcs { angles: 4, from: degrees(18.0), to: degrees(50.0), turn: degrees(180.0), pause: 2.0 }
            }
            Drivetrain::Differential { .. } => {
                Program::Arcs { angles: 4, from: degrees(8.0), to: degrees(40.0), turn: degrees(180.0), pause: 2.0 }
            }
        };
        Self {
            seed,
            start: 100.0,
            drivetrain,
            noise: DrivetrainNoise::default(),
            program,
            speed: 1.0,
            scanner: scanner(),
            delay: 0.0,
            wheel_period: 0.02,
        }
    }

    /// Whether every setting makes sense.
    ///
    /// # Errors
    /// Names the first that does not.
    pub fn check(&self) -> Result<(), SimulationError> {
        let (noise, scanner) = (&self.noise, &self.scanner);
        let positive = [
            ("speed", self.speed),
            ("wheel_period", self.wheel_period),
            ("scanner.period", scanner.period),
            ("scanner.range_max", scanner.range_max),
            ("scanner.beams", scanner.beams as f64),
            ("noise.memory", noise.wheels.memory),
        ];
        let at_least_zero = [
            ("noise.slip", noise.wheels.slip),
            ("noise.steering", noise.wheels.steering),
            ("noise.counter_step", noise.counter_step),
            ("noise.steering_step", noise.steering_step),
            ("scanner.sigma", scanner.sigma),
            ("scanner.time_increment", scanner.time_increment),
            ("start + delay", self.start + self.delay),
        ];
        let wrong = |name, value, rule| Err(SimulationError::Setting { name, value, rule });
        if let Some(&(name, value)) = positive.iter().find(|(_, x)| !(1e-4..=1e6).contains(x)) {
            return wrong(name, value, "must be from 1e-4 to 1e6");
        }
        if let Some(&(name, value)) = at_least_zero.iter().find(|(_, x)| !(0.0..=1e11).contains(x)) {
            return wrong(name, value, "must be from 0 to 1e11");
        }
        scanner.check()?;
        self.check_program()
    }

    fn check_program(&self) -> Result<(), SimulationError> {
        let (name, value, holds, rule) = match self.program {
            Program::Arcs { angles, from, to, turn, pause } => {
                let lasts = (1..=1000).contains(&angles) && turn > 0.0 && turn < 100.0 && (0.0..1e4).contains(&pause);
                let sane = lasts && 0.01 < from && from <= to && to < 1.4;
                (
                    "program.from",
                    from,
                    sane,
                    "angles run from above 0.01 to below 1.4 rad, turn and pause are not negative, nothing lasts for hours",
                )
            }
            Program::Continuous { duration, to } => (
                "program.duration",
                duration,
                duration > 0.0 && duration < 1e5 && to > 0.0 && to < 1.4,
                "must be above 0",
            ),
        };
        if holds { Ok(()) } else { Err(SimulationError::Setting { name, value, rule }) }
    }
}

/// A safety scanner of 270 degrees, 0.25 degrees a beam, ten moving sweeps a second, 12 mm of range noise.
fn scanner() -> Scanner {
    let (step, period, beams) = (0.25_f64.to_radians(), 0.1, 1081);
    Scanner {
        mount: [0.39028, 0.00214, 0.5034_f64.to_radians()],
        beams,
        angle_min: -540.0 * step,
        angle_increment: step,
        period,
        time_increment: 0.75 * period / (beams - 1) as f64,
        sigma: 0.012,
        ..Scanner::default()
    }
}

/// A recording for calibration and its truth.
#[derive(Clone, Debug)]
pub struct CalibrationDrive {
    /// Sweeps in order of time.
    pub scans: Vec<LaserScan>,
    /// `T_world_base` at the stamp of each sweep.
    pub scan_poses: Vec<Se2>,
    /// Stamps of the wheels [s].
    pub stamps: Vec<f64>,
    /// Readings: counter and steering, or both counters [rad].
    pub readings: Vec<[f64; 2]>,
    /// `T_world_base` at the true times of the readings.
    pub truth: Vec<Se2>,
    /// The hall.
    pub world: World,
}

/// Simulates a recording for calibration.
///
/// # Errors
/// When a setting makes no sense or the vehicle would leave the floor.
pub fn simulate_calibration(
    scenario: &CalibrationScenario,
    token: &Token,
) -> Result<CalibrationDrive, SimulationError> {
    scenario.check()?;
    let floor = floor(scenario);
    let world = hall::build(floor.half, &mut Random::new(scenario.seed, Purpose::Building));
    let start = Se2::new(0.0, 0.0, 0.0);
    let mut driver = Random::new(scenario.seed, Purpose::Driver);
    let demands = scenario.program.demands(&scenario.drivetrain, scenario.speed, STEP, start, &floor, &mut driver);
    let (drive, sums) = driven(scenario, start, &demands);
    let caster = RayCaster::new(&world);
    stays_clear(&caster, &drive, scenario.drivetrain.front())?;
    let every = (scenario.wheel_period / STEP).round().max(1.0) as usize;
    let given: Vec<usize> = (0..drive.poses.len()).step_by(every).collect();
    let mut random = Random::new(scenario.seed, Purpose::Ranges);
    let base_at = |stamp: f64| drive.at(stamp - scenario.start);
    let scans = scenario.scanner.sweeps(&caster, base_at, (scenario.start, drive.duration()), &mut random, token)?;
    Ok(CalibrationDrive {
        scan_poses: scans.iter().map(|scan| drive.at(scan.stamp - scenario.start)).collect(),
        scans,
        stamps: given.iter().map(|&k| scenario.start + scenario.delay + k as f64 * STEP).collect(),
        readings: given.iter().map(|&k| reading(scenario, sums[k])).collect(),
        truth: given.iter().map(|&k| drive.poses[k]).collect(),
        world,
    })
}

/// A floor wide enough for the widest arc to either side.
fn floor(scenario: &CalibrationScenario) -> Floor {
    let drive = &scenario.drivetrain;
    let half = match scenario.program {
        Program::Arcs { from, turn, .. } => {
            let radius = drive.travel(from, turn) / turn * if drive.steers() { from.cos() } else { 1.0 };
            let reach = drive.front() + 1.0;
            Vector2::new(radius + reach, 2.0 * radius + reach).map(|x| x.max(4.0))
        }
        Program::Continuous { .. } => Vector2::new(9.0, 7.0),
    };
    Floor { half }
}

/// The true path and the true readings at the ends of its steps: sums of the counters, and the steering angle, there the
/// mean of the steps before and after.
fn driven(scenario: &CalibrationScenario, start: Se2, demands: &[Demand]) -> (Drive, Vec<[f64; 2]>) {
    let mut random = Random::new(scenario.seed, Purpose::Wheels);
    let mut disturbance = Disturbance::new(scenario.noise.wheels, &mut random);
    let (mut drive, drivetrain) = (Drive::from(start, STEP), &scenario.drivetrain);
    let first = demands.first().map_or([0.0; 2], |d| drivetrain.readings(*d));
    let mut sums = vec![if drivetrain.steers() { [0.0, first[1]] } else { [0.0; 2] }];
    for (k, demand) in demands.iter().enumerate() {
        let rates = drivetrain.readings(*demand);
        let (slip, error) = disturbance.step(drivetrain.speeds(rates), STEP, &mut random);
        let [v, w] = drivetrain.twist(rates, slip, error);
        drive.advance(v, w);
        let last = sums[k];
        let next = drivetrain.readings(demands[(k + 1).min(demands.len() - 1)]);
        let second = if drivetrain.steers() { (rates[1] + next[1]) / 2.0 } else { last[1] + rates[1] * STEP };
        sums.push([last[0] + rates[0] * STEP, second]);
    }
    (drive, sums)
}

fn reading(scenario: &CalibrationScenario, [first, second]: [f64; 2]) -> [f64; 2] {
    let noise = &scenario.noise;
    let step = if scenario.drivetrain.steers() { noise.steering_step } else { noise.counter_step };
    [rounded(first, noise.counter_step), rounded(second, step)]
}

fn rounded(x: f64, step: f64) -> f64 {
    if step > 0.0 { (x / step).round() * step } else { x }
}

fn stays_clear(caster: &RayCaster, drive: &Drive, front: f64) -> Result<(), SimulationError> {
    for (k, pose) in drive.poses.iter().enumerate() {
        for p in [pose.translation, pose.act(Vector2::new(front, 0.0))] {
            if caster.touches(p, CLEARANCE) {
                return Err(SimulationError::Collision { time: k as f64 * STEP, x: p.x, y: p.y });
            }
        }
    }
    Ok(())
}

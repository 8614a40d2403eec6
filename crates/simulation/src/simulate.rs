//! From a scenario to a recording and its truth.
//!
//! The vehicle drives the route of the building; its body, a circle, must touch nothing. Odometry and joints are
//! reported at the steps of the drive, sweeps begin every `period` seconds as long as they end before the drive does. Stalls
//! are placed at moments of motion, half of them where the vehicle turns fastest, and never overlap.

use crate::drive::{Drive, Route, Stall, WheelReadings};
use crate::error::SimulationError;
use crate::scenario::Scenario;
use crate::scenes;
use crate::world::{RayCaster, World};
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::Se2;
use groma_models::{LaserScan, Odometry, Token};

/// Speed above which a vehicle counts as moving [m/s].
const MOVING: f64 = 0.2;
/// Turn rate above which it counts as turning [rad/s].
const TURNING: f64 = 0.4;
/// Tries to find a free moment for a stall.
const TRIES: usize = 1000;

/// A recording and its truth.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// The building.
    pub world: World,
    /// Sweeps in order of time.
    pub scans: Vec<LaserScan>,
    /// `T_world_base` at the stamp of each sweep.
    pub scan_poses: Vec<Se2>,
    /// Reported odometry.
    pub odometry: Vec<Odometry>,
    /// Joint positions at the stamps of the odometry [rad].
    pub joints: Vec<[f64; 2]>,
    /// `T_world_base` at the stamps of the odometry.
    pub truth: Vec<Se2>,
    /// Stalls, after the start [s].
    pub stalls: Vec<Stall>,
}

/// Simulates `scenario`.
///
/// # Errors
/// When a setting makes no sense, the vehicle cannot follow the route or touches something, or the token cancels the work.
pub fn simulate(scenario: &Scenario, token: &Token) -> Result<Simulated, SimulationError> {
    scenario.check()?;
    let (world, route) = scenes::build(scenario.building, &mut Random::new(scenario.seed, Purpose::Building));
    simulate_in(world, &route, scenario, token)
}

/// Simulates `scenario` in a given world along a given route instead of its building's.
///
/// # Errors
/// As [`simulate`].
pub fn simulate_in(
    world: World,
    route: &Route,
    scenario: &Scenario,
    token: &Token,
) -> Result<Simulated, SimulationError> {
    let drive = Drive::along(route, &scenario.limits, scenario.vehicle.turns_on_the_spot())?;
    let caster = RayCaster::new(&world);
    stays_clear(&caster, &drive, scenario.clearance)?;
    let mut wheels = Random::new(scenario.seed, Purpose::Wheels);
    let readings = WheelReadings::of(&drive, &scenario.vehicle, &scenario.wheels, &mut wheels, token)?;
    let stalls = place_stalls(&drive, scenario);
    let scans = sweeps(&caster, &drive, scenario, token)?;
    let scan_poses = scans.iter().map(|scan| drive.at(scan.stamp - scenario.start)).collect();
    let given: Vec<usize> = (0..drive.poses.len()).step_by(scenario.odometry_every).collect();
    let odometry = given.iter().map(|&k| Odometry {
        stamp: scenario.start + k as f64 * drive.step,
        pose: readings.odometry[seen(k, &drive, &stalls, scenario.odometry_every)],
    });
    Ok(Simulated {
        scans,
        scan_poses,
        odometry: odometry.collect(),
        joints: given.iter().map(|&k| readings.positions[k]).collect(),
        truth: given.iter().map(|&k| drive.poses[k]).collect(),
        stalls,
        world,
    })
}

fn stays_clear(caster: &RayCaster, drive: &Drive, clearance: f64) -> Result<(), SimulationError> {
    match drive.poses.iter().position(|pose| caster.touches(pose.translation, clearance)) {
        None => Ok(()),
        Some(k) => {
            let (time, pose) = (k as f64 * drive.step, drive.poses[k]);
            Err(SimulationError::Collision { time, x: pose.x(), y: pose.y() })
        }
    }
}

fn sweeps(
    caster: &RayCaster,
    drive: &Drive,
    scenario: &Scenario,
    token: &Token,
) -> Result<Vec<LaserScan>, SimulationError> {
    let mut random = Random::new(scenario.seed, Purpose::Ranges);
    let base_at = |stamp: f64| drive.at(stamp - scenario.start);
    scenario.scanner.sweeps(caster, base_at, (scenario.start, drive.duration()), &mut random, token)
}

/// The step whose odometry is reported at step `k`: an earlier one during a stall.
fn seen(k: usize, drive: &Drive, stalls: &[Stall], every: usize) -> usize {
    let t = k as f64 * drive.step;
    let frozen = stalls.iter().find(|stall| t >= stall.start && t < stall.start + stall.duration);
    frozen.map_or(k, |stall| (stall.start / drive.step).floor() as usize / every * every)
}

fn place_stalls(drive: &Drive, scenario: &Scenario) -> Vec<Stall> {
    let mut random = Random::new(scenario.seed, Purpose::Stalls);
    let duration = scenario.stall_duration;
    let mut stalls: Vec<Stall> = vec![];
    for _ in 0..TRIES * scenario.stalls {
        if stalls.len() == scenario.stalls {
            break;
        }
        let k = random.index(drive.twists.len());
        let (start, [v, w]) = (k as f64 * drive.step, drive.twists[k]);
        let wanted = if stalls.len().is_multiple_of(2) { w.abs() > TURNING } else { v > MOVING };
        let free = stalls.iter().all(|s| (s.start - start).abs() > 5.0 * duration);
        if wanted && free && start + duration < drive.duration() {
            stalls.push(Stall { start, duration });
        }
    }
    stalls.sort_by(|a, b| a.start.total_cmp(&b.start));
    stalls
}

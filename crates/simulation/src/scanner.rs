//! A laser scanner: beams, their timing, and what is wrong with the readings.
//!
//! Beam i of the sweep that begins at `t` leaves at `t + i * time_increment` from where the scanner is at that moment.
//! The reading is `round((r + sigma * n) / quantum) * quantum`, n standard normal; `+inf` when nothing is met within
//! `range_max` or the echo drops out (chance `dropout`); NaN when the reading is below `range_min`.
//! Intensity: `1000 * reflectivity * cos(incidence) / (1 + (r / 5 m)^2)`, noiseless, 0 without an echo.
//!
//! Not modelled: beam width (mixed readings at edges), bias with range or reflectivity, multipath, dazzle.

use crate::error::SimulationError;
use crate::world::{Hit, RayCaster};
use groma_estimation::streams::Random;
use groma_geometry::Se2;
use groma_models::bounds::{BEAMS, COORDINATE};
use groma_models::{BeamGeometry, LaserScan, Token};
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// Distance at which the intensity has fallen by half [m].
const HALF_INTENSITY: f64 = 5.0;

/// Readings of a recording, at most.
const MOST_READINGS: f64 = 1e8;

/// A scanner and its mounting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// `T_base_laser` as x [m], y [m], yaw [rad].
    pub mount: [f64; 3],
    /// Beams in a sweep.
    pub beams: usize,
    /// Bearing of the first beam [rad].
    pub angle_min: f64,
    /// Bearing step [rad].
    pub angle_increment: f64,
    /// Time between sweeps [s].
    pub period: f64,
    /// Time between beams [s]; 0 for a snapshot.
    pub time_increment: f64,
    /// Shortest range [m].
    pub range_min: f64,
    /// Longest range [m].
    pub range_max: f64,
    /// Standard deviation of a range [m].
    pub sigma: f64,
    /// Step of the range output [m]; 0 for none.
    pub quantum: f64,
    /// Share of echoes that are lost.
    pub dropout: f64,
}

impl Default for Scanner {
    fn default() -> Self {
        let step = 0.5_f64.to_radians();
        Self {
            mount: [0.15, 0.0, 0.0],
            beams: 541,
            angle_min: -270.0 * step,
            angle_increment: step,
            period: 0.2,
            time_increment: 0.0,
            range_min: 0.05,
            range_max: 30.0,
            sigma: 0.01,
            quantum: 0.001,
            dropout: 0.005,
        }
    }
}

impl Scanner {
    /// Where the beams point, as a recording says it.
    #[must_use]
    pub fn geometry(&self) -> BeamGeometry {
        BeamGeometry {
            angle_min: self.angle_min,
            angle_increment: self.angle_increment,
            time_increment: self.time_increment,
            range_min: self.range_min,
            range_max: self.range_max,
        }
    }

    /// Refuses a scanner that there is not.
    ///
    /// # Errors
    /// The first number that is not finite or out of its bound, by name.
    pub fn check(&self) -> Result<(), SimulationError> {
        let mount = self.mount.iter().try_for_each(|&v| COORDINATE.check("scanner.mount", v));
        let checked = mount.and(BEAMS.check("scanner.beams", self.beams as f64)).and(self.geometry().validate());
        checked.map_err(|e| SimulationError::Scene(e.to_string()))
    }

    /// All sweeps of a drive that lasts so long [s], one every period; each is a step of the token.
    ///
    /// # Errors
    /// When the token cancels the work, or there would be more readings than memory holds.
    pub fn sweeps(
        &self,
        world: &RayCaster,
        base_at: impl Fn(f64) -> Se2,
        (start, lasts): (f64, f64),
        random: &mut Random,
        token: &Token,
    ) -> Result<Vec<LaserScan>, SimulationError> {
        let last = ((lasts - self.duration()) / self.period).floor().max(0.0);
        let readings = (last + 1.0) * self.beams as f64;
        if readings > MOST_READINGS {
            let (name, value, rule) = ("scanner.period", self.period, "must leave at most 1e8 readings");
            return Err(SimulationError::Setting { name, value, rule });
        }
        token.begin(last as usize + 1);
        let mut scans = Vec::new();
        for k in 0..=last as usize {
            scans.push(self.sweep(world, &base_at, start + k as f64 * self.period, random));
            token.step()?;
        }
        Ok(scans)
    }

    /// Time from the first beam of a sweep to the last [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.time_increment * self.beams.saturating_sub(1) as f64
    }

    /// The sweep that begins at `stamp`; `base_at` is `T_world_base` at a time.
    pub fn sweep(&self, world: &RayCaster, base_at: impl Fn(f64) -> Se2, stamp: f64, random: &mut Random) -> LaserScan {
        let mount = Se2::new(self.mount[0], self.mount[1], self.mount[2]);
        let geometry = self.geometry();
        let mut laser = base_at(stamp) * mount;
        let mut scan = LaserScan { stamp, geometry, ranges: vec![], intensities: vec![] };
        for i in 0..self.beams {
            if self.time_increment != 0.0 {
                laser = base_at(scan.beam_stamp(i)) * mount;
            }
            let (sin, cos) = geometry.bearing(i).sin_cos();
            let direction = laser.rotation.act(Vector2::new(cos, sin));
            let (range, intensity) = self.reading(world.cast(laser.translation, direction, self.range_max), random);
            scan.ranges.push(range);
            scan.intensities.push(intensity);
        }
        scan
    }

    fn reading(&self, hit: Option<Hit>, random: &mut Random) -> (f64, f64) {
        let (lost, noise) = (random.chance(self.dropout), random.normal());
        let Some(hit) = hit.filter(|_| !lost) else { return (f64::INFINITY, 0.0) };
        let intensity = echo(&hit);
        match self.quantised(hit.range + self.sigma * noise) {
            r if r > self.range_max => (f64::INFINITY, 0.0),
            r if r < self.range_min => (f64::NAN, intensity),
            r => (r, intensity),
        }
    }

    fn quantised(&self, range: f64) -> f64 {
        if self.quantum > 0.0 { (range / self.quantum).round() * self.quantum } else { range }
    }
}

/// Strength of an echo.
fn echo(hit: &Hit) -> f64 {
    1000.0 * hit.reflectivity * hit.cos_incidence / (1.0 + (hit.range / HALF_INTENSITY).powi(2))
}

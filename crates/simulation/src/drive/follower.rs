//! Following a route: steps of constant speed and turn rate, so that the true path is a chain of exact arcs.
//!
//! Pure pursuit: with the point of the path `ahead` metres further on at distance d and bearing beta seen from the
//! vehicle, the curvature is `2 sin(beta) / d` (R. C. Coulter, CMU-RI-TR-92-01, 1992). The speed is the least of the
//! limit, `rate / curvature`, and `sqrt(2 a remaining)`; speed and turn rate change no faster than their accelerations allow.
//! The point steered to sways about the path, `sway sin(2 pi s / 9 m)`, and the vehicle starts askew: nobody drives along
//! a line, and a start along a wall would flatter mapping on a grid.
//! At the end of a leg the vehicle stops, waits, and, if it can, turns on the spot towards the next leg.

use super::route::{Path, Route};
use crate::error::SimulationError;
use groma_geometry::{Se2, wrap};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// A leg is done when so little of it remains [m].
const ARRIVED: f64 = 0.01;
/// A turn on the spot is done when so little of it remains [rad].
const ALIGNED: f64 = 0.005;
/// Length of one sway [m].
const SWAY_LENGTH: f64 = 9.0;
/// By how much the vehicle stands askew at the start [rad].
const ASKEW: f64 = 0.3;
/// A vehicle that takes this many times the ideal time is not following [1].
const PATIENCE: f64 = 20.0;

/// Steps of a leg, at most.
const MOST_STEPS: usize = 5_000_000;

/// How fast the vehicle may move.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Limits {
    /// Time of one step [s].
    pub step: f64,
    /// Speed [m/s].
    pub speed: f64,
    /// Acceleration [m/s^2].
    pub acceleration: f64,
    /// Turn rate [rad/s].
    pub turn_rate: f64,
    /// Change of the turn rate [rad/s^2].
    pub turn_acceleration: f64,
    /// Radius of rounded corners [m].
    pub corner_radius: f64,
    /// Distance of the point that is steered to [m].
    pub ahead: f64,
    /// How far the vehicle sways to either side of its path [m].
    pub sway: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            step: 0.02,
            speed: 0.8,
            acceleration: 0.6,
            turn_rate: 0.8,
            turn_acceleration: 2.5,
            corner_radius: 0.6,
            ahead: 0.35,
            sway: 0.05,
        }
    }
}

/// A driven path: at `k * step` seconds the base is at `poses[k]` and moves on with `twists[k]` for one step.
#[derive(Clone, Debug)]
pub struct Drive {
    /// Time of one step [s].
    pub step: f64,
    /// `T_world_base`, one more than twists.
    pub poses: Vec<Se2>,
    /// Speed [m/s] and turn rate [rad/s] of each step.
    pub twists: Vec<[f64; 2]>,
}

impl Drive {
    /// Starts standing at `pose`, with steps of `step` seconds.
    #[must_use]
    pub fn from(pose: Se2, step: f64) -> Self {
        Self { step, poses: vec![pose], twists: vec![] }
    }

    /// Drives `route`; `spot` tells whether the vehicle can turn on the spot.
    ///
    /// # Errors
    /// When the route has no leg or the limits do not let the vehicle follow it.
    pub fn along(route: &Route, limits: &Limits, spot: bool) -> Result<Self, SimulationError> {
        let paths = route.paths(limits.corner_radius);
        let (first, _) = paths.first().ok_or(SimulationError::EmptyRoute)?;
        let start = first.at(0.0);
        let mut drive = Self::from(Se2::new(start.x, start.y, first.heading(0.0) + ASKEW), limits.step);
        for (leg, (path, pause)) in paths.iter().enumerate() {
            let aligned = !spot || drive.turn_to(path.heading(0.0), limits);
            if !aligned || !drive.follow(path, limits) {
                let end = path.at(path.length());
                return Err(SimulationError::NotFollowed { leg, x: end.x, y: end.y });
            }
            drive.stand(*pause);
        }
        Ok(drive)
    }

    /// Time from start to end [s].
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.step * self.twists.len() as f64
    }

    /// `T_world_base` at time `t` after the start [s]; the first or last pose outside.
    #[must_use]
    pub fn at(&self, t: f64) -> Se2 {
        let k = ((t / self.step).max(0.0) as usize).min(self.twists.len());
        match self.twists.get(k) {
            Some(twist) => moved(self.poses[k], *twist, (t - k as f64 * self.step).max(0.0)),
            None => self.poses[k],
        }
    }

    /// Length of the path [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.twists.iter().map(|[v, _]| v.abs() * self.step).sum()
    }

    /// Moves one step with speed `v` and turn rate `w`.
    pub fn advance(&mut self, v: f64, w: f64) {
        let here = self.here();
        self.twists.push([v, w]);
        self.poses.push(moved(here, [v, w], self.step));
    }

    fn here(&self) -> Se2 {
        self.poses.last().copied().unwrap_or(Se2::IDENTITY)
    }

    fn last_twist(&self) -> [f64; 2] {
        self.twists.last().copied().unwrap_or([0.0, 0.0])
    }

    fn stand(&mut self, pause: f64) {
        for _ in 0..(pause / self.step).round() as usize {
            self.advance(0.0, 0.0);
        }
    }

    fn turn_to(&mut self, heading: f64, limits: &Limits) -> bool {
        let most = ((PATIENCE * TAU / limits.turn_rate / limits.step) as usize).min(MOST_STEPS);
        for _ in 0..most {
            let left = wrap(heading - self.here().theta());
            if left.abs() < ALIGNED {
                return true;
            }
            let fastest = (limits.turn_acceleration * left.abs()).sqrt().min(limits.turn_rate);
            let [_, w] = self.last_twist();
            self.advance(0.0, ramp(w, fastest * left.signum(), limits.turn_acceleration * limits.step));
        }
        false
    }

    fn follow(&mut self, path: &Path, limits: &Limits) -> bool {
        let most = ((PATIENCE * (path.length() / limits.speed + 1.0) / limits.step) as usize).min(MOST_STEPS);
        let mut s = 0.0;
        for _ in 0..most {
            let here = self.here();
            s = path.progress(here.translation, s, 2.0 * limits.ahead);
            if path.length() - s < ARRIVED {
                return true;
            }
            let [v, w] = pursue(path, s, &here, self.last_twist(), limits);
            self.advance(v, w);
        }
        false
    }
}

/// Speed and turn rate towards the point of `path` that lies ahead of `s`.
fn pursue(path: &Path, s: f64, here: &Se2, [v0, w0]: [f64; 2], limits: &Limits) -> [f64; 2] {
    let target = here.inverse().act(swaying(path, s + limits.ahead, limits.sway));
    let curvature = 2.0 * target.y / target.norm_squared().max(1e-9);
    let brake = (2.0 * limits.acceleration * (path.length() - s)).sqrt();
    let wanted = limits.speed.min(limits.turn_rate / curvature.abs().max(1e-9)).min(brake);
    let v = ramp(v0, wanted, limits.acceleration * limits.step);
    let w = (v * curvature).clamp(-limits.turn_rate, limits.turn_rate);
    [v, ramp(w0, w, limits.turn_acceleration * limits.step)]
}

/// The point after `s` metres, swayed aside.
fn swaying(path: &Path, s: f64, sway: f64) -> Vector2<f64> {
    let aside = sway * (TAU * s.min(path.length()) / SWAY_LENGTH).sin();
    let (sin, cos) = path.heading(s).sin_cos();
    path.at(s) + Vector2::new(-sin, cos) * aside
}

fn ramp(from: f64, to: f64, most: f64) -> f64 {
    from + (to - from).clamp(-most, most)
}

fn moved(pose: Se2, [v, w]: [f64; 2], dt: f64) -> Se2 {
    pose.plus(Vector3::new(v * dt, 0.0, w * dt))
}

//! Settings of a survey, and their defaults.

use crate::{Error, Floor, OdometryNoise};
use serde::{Deserialize, Serialize};

/// Settings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Options {
    /// How good the odometry is.
    pub odometry: OdometryNoise,
    /// How uneven the floor is.
    pub floor: Floor,
    /// The target on the robot: how well the target file knows where it is.
    pub mount: MountPrior,
    /// Error of a view that no corner noise explains: the panel bends, the detector repeats its error.
    pub view: ViewSlack,
    /// Share of true views that pass the gate.
    pub gate: f64,
    /// Views of one camera in a row that must fail the gate before it counts as moved.
    pub moved_after: usize,
    /// Calibration states of each camera, at most: the leading principal components of its covariance.
    pub calibration_states: usize,
    /// Relative standard deviation of the focal length of a camera whose covariance is not known.
    pub focal: f64,
    /// Fewest corners of a view.
    pub corners: usize,
    /// Most steps of the batch; 0 leaves the filter's result.
    pub batch_steps: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            odometry: OdometryNoise::default(),
            floor: Floor::default(),
            mount: MountPrior::default(),
            view: ViewSlack::default(),
            gate: 0.999,
            moved_after: 3,
            calibration_states: 4,
            focal: 0.005,
            corners: 12,
            batch_steps: 30,
        }
    }
}

/// How well it is known where the target is on the robot: standard deviations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MountPrior {
    /// Position, forward and to the left [m].
    pub position: f64,
    /// Height [m]: a robot in the plane never learns it, and all heights of cameras share its error. 0 holds it.
    pub height: f64,
    /// Rotation about each axis [rad].
    pub rotation: f64,
}

impl Default for MountPrior {
    /// A tape measure and a spirit level; the height is taken as given.
    fn default() -> Self {
        Self { position: 0.01, height: 0.0, rotation: 1f64.to_radians() }
    }
}

impl MountPrior {
    /// A mount that is known exactly.
    pub const EXACT: Self = Self { position: 0.0, height: 0.0, rotation: 0.0 };

    /// Standard deviations of mu.
    #[must_use]
    pub fn sigmas(&self) -> [f64; 6] {
        [self.position, self.position, self.height, self.rotation, self.rotation, self.rotation]
    }
}

/// What no corner noise explains: standard deviations for each view.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ViewSlack {
    /// Position of the target [m].
    pub position: f64,
    /// Rotation of the target [rad].
    pub rotation: f64,
}

impl Default for ViewSlack {
    /// A stiff panel and a good detector.
    fn default() -> Self {
        Self { position: 0.001, rotation: 0.05f64.to_radians() }
    }
}

impl ViewSlack {
    /// None.
    pub const NONE: Self = Self { position: 0.0, rotation: 0.0 };
}

impl Options {
    /// Refuses what is out of range.
    ///
    /// # Errors
    /// [`Error::Setting`], which names it.
    pub fn check(&self) -> Result<(), Error> {
        let not_negative = [
            ("odometry.along", self.odometry.along),
            ("odometry.across", self.odometry.across),
            ("odometry.heading", self.odometry.heading),
            ("odometry.turning", self.odometry.turning),
            ("floor.height", self.floor.height),
            ("floor.tilt", self.floor.tilt),
            ("mount.position", self.mount.position),
            ("mount.height", self.mount.height),
            ("mount.rotation", self.mount.rotation),
            ("view.position", self.view.position),
            ("view.rotation", self.view.rotation),
        ];
        for (name, value) in not_negative {
            setting(name, value, value >= 0.0, "must be 0 or more")?;
        }
        setting("focal", self.focal, self.focal > 0.0 && self.focal < 1.0, "must be between 0 and 1")?;
        setting("gate", self.gate, self.gate > 0.0 && self.gate < 1.0, "must be between 0 and 1")?;
        let states = self.calibration_states;
        setting("calibration_states", states as f64, states <= 6, "must be at most 6")?;
        setting("corners", self.corners as f64, self.corners >= 4, "must be at least 4")?;
        setting("moved_after", self.moved_after as f64, self.moved_after >= 1, "must be at least 1")
    }
}

fn setting(name: &'static str, value: f64, holds: bool, rule: &'static str) -> Result<(), Error> {
    if holds && value.is_finite() { Ok(()) } else { Err(Error::Setting { name, value, rule }) }
}

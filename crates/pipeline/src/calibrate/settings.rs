//! The settings of a calibration.

use groma_calibration::vehicle::{Model, Options};
use groma_models::{ModelError, WheelKind};
use serde::{Deserialize, Serialize};

/// Shortest and longest window [s].
const WINDOWS: (f64, f64) = (0.01, 3600.0);
/// Longest time that messages are waited for [s].
const LATEST: f64 = 60.0;

/// What tells how the sensor moves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Source {
    /// Scans.
    #[default]
    Scans,
    /// Odometry messages, which are poses of the sensor.
    Poses,
}

/// Settings of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// The kind of vehicle by name; left out, a tricycle or a differential drive, as the wheels are.
    pub model: Option<String>,
    /// Whether the second joint is a steering angle; follows from the model where that is given.
    pub steered: bool,
    /// Wheelbase [m]; estimated where left out.
    pub wheelbase: Option<f64>,
    /// Steering gain, or where to look for it.
    pub gain: f64,
    /// Delay [s], where it is not estimated.
    pub delay: f64,
    /// Of `wheelbase`, `gain`, `delay`, what to estimate too.
    pub free: Vec<String>,
    /// Length of a window [s]; left out: stop and go where the drive is.
    pub window: Option<f64>,
    /// What tells how the sensor moves.
    pub source: Source,
    /// How late messages may come and still be put into order [s].
    pub lateness: f64,
    /// Of the estimate.
    pub estimate: Options,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            model: None,
            steered: false,
            wheelbase: None,
            gain: 1.0,
            delay: 0.0,
            free: Vec::new(),
            window: None,
            source: Source::default(),
            lateness: 0.0,
            estimate: Options::default(),
        }
    }
}

impl Settings {
    /// The model requested.
    ///
    /// # Errors
    /// A name that no model has.
    pub(super) fn asked_model(&self) -> Result<Option<Model>, super::Error> {
        let Some(name) = &self.model else { return Ok(None) };
        let known = Model::ALL.into_iter().find(|m| m.name() == name);
        known.map(Some).ok_or_else(|| super::Error::UnknownModel(name.clone()))
    }

    /// The kind of wheels to read.
    pub(super) fn wheels(&self) -> Result<WheelKind, super::Error> {
        let by_flag = if self.steered { WheelKind::Steered } else { WheelKind::Differential };
        Ok(self.asked_model()?.map_or(by_flag, Model::wheels))
    }

    /// Whether every number is finite and in its range; those of the estimate are checked there.
    pub(super) fn validate(&self) -> Result<(), ModelError> {
        let within = |name, value: f64, (low, high): (f64, f64), rule| {
            if (low..=high).contains(&value) { Ok(()) } else { Err(ModelError::Setting { name, value, rule }) }
        };
        within("window", self.window.unwrap_or(WINDOWS.0), WINDOWS, "must be between 0.01 and 3600 s")?;
        within("lateness", self.lateness, (0.0, LATEST), "must be between 0 and 60 s")
    }
}

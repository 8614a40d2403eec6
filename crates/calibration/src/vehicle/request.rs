//! What is asked of a calibration, and whether the log can answer it.

use super::error::Error;
use super::parameters::Model;
use groma_models::{WheelKind, WheelLog};

/// What to estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request<'a> {
    /// The kind of vehicle; chosen from the data where left out.
    pub model: Option<Model>,
    /// Wheelbase [m]; estimated where left out.
    pub wheelbase: Option<f64>,
    /// Steering gain, or where to look for it.
    pub gain: f64,
    /// Delay [s], where it is not estimated.
    pub delay: f64,
    /// Of `wheelbase`, `gain`, `delay`, what to estimate too.
    pub free: &'a [&'a str],
}

impl Default for Request<'_> {
    fn default() -> Self {
        Self { model: None, wheelbase: None, gain: 1.0, delay: 0.0, free: &[] }
    }
}

/// The model that was requested, or the one of the log's kind of wheels.
pub(super) fn model(log: &WheelLog, request: &Request<'_>) -> Result<Model, Error> {
    let model = match (request.model, log.kind()) {
        (Some(model), _) => model,
        (None, WheelKind::Differential) => Model::Differential,
        (None, WheelKind::Steered) => Model::Tricycle,
    };
    let needs = match model.wheels() {
        WheelKind::Steered => "of one drive wheel and its steering angle",
        WheelKind::Differential => "of two wheels and no steering angle",
    };
    if model.wheels() == log.kind() { Ok(model) } else { Err(Error::Kind { model: model.name(), needs }) }
}

/// What is estimated beside the model's own parameters.
pub(super) fn free<'a>(log: &WheelLog, request: &Request<'a>, notes: &mut Vec<String>) -> Result<Vec<&'a str>, Error> {
    let sense = |fits: bool, what: &str| if fits { Ok(()) } else { Err(Error::Parameter(what.into())) };
    sense(
        request.wheelbase.is_none_or(|l| l.is_finite() && l != 0.0),
        "the wheelbase must be a number other than 0 m",
    )?;
    sense(request.gain.is_finite() && request.gain != 0.0, "the steering gain must be a number other than 0")?;
    sense(request.delay.is_finite(), "the delay must be a number")?;
    let mut free = request.free.to_vec();
    if log.kind() == WheelKind::Steered && request.wheelbase.is_none() && !free.contains(&"wheelbase") {
        free.push("wheelbase");
        notes.push("no wheelbase was given: it is estimated".into());
    }
    Ok(free)
}

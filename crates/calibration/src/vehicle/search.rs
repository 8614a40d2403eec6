//! The best closed form over all that it cannot solve for: gain, delay, the form, and whether to trim.
//!
//! The gain is tried from a tenth to ten times what is expected, then the delay, then the gain again,
//! finer. The steps are a few per cent and 20 ms: well within the reach of the likelihood's own steps. Trimming is tried in
//! the end.

use super::Error;
use super::hand_eye::Form;
use super::motions::Segments;
use super::parameters::{DELAY, GAIN, Layout, Model, Vehicle};
use super::request::Request;
use super::robust::Problem;
use super::start::{self, Known, Weights};
use super::trim::{Trim, trimmed};
use nalgebra::Matrix3;

const NO_TRIM: Trim = Trim { rounds: 0, share: 0.0 };
/// Step of the gain, as a factor.
const GAIN_STEP: f64 = 1.1;
/// Steps of the gain to either side.
const GAIN_STEPS: i32 = 24;
/// Step of the delay [s].
const DELAY_STEP: f64 = 0.02;

/// A start for the likelihood.
///
/// # Errors
/// [`Error::Degenerate`] when nothing moved; [`Error::Cancelled`].
pub fn search(problem: &Problem<'_>, request: &Request<'_>) -> Result<Vehicle, Error> {
    let known = known(problem.layout, request);
    let search = Search::new(problem);
    let mut best = search.candidate(&known, &NO_TRIM)?;
    if problem.layout.is_free(GAIN) {
        let gain = |k: i32| known.gain * GAIN_STEP.powi(k);
        best = search.better(best, (-GAIN_STEPS..=GAIN_STEPS).map(|k| Known { gain: gain(k), ..known }))?;
    }
    if problem.layout.is_free(DELAY) {
        let at = best.as_ref().map_or(known, |(_, at, _)| *at);
        let steps = (problem.options.delay_max / DELAY_STEP) as i32;
        best = search.better(best, (-steps..=steps).map(|k| Known { delay: f64::from(k) * DELAY_STEP, ..at }))?;
    }
    if problem.layout.is_free(GAIN) {
        let at = best.as_ref().map_or(known, |(_, at, _)| *at);
        let finer = (-10..=10).map(|k| Known { gain: at.gain * GAIN_STEP.powf(f64::from(k) / 10.0), ..at });
        best = search.better(best, finer)?;
    }
    let at = best.as_ref().map_or(known, |(_, at, _)| *at);
    best = [best, search.candidate(&at, &Trim::default())?].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
    let found = best.map(|(_, _, vehicle)| vehicle).or_else(|| search.fallback(&known));
    let found = found.ok_or(Error::Degenerate("nothing moved: wheels and laser must both have moved"))?;
    Ok(if problem.layout.is_free(GAIN) { found.facing_forward() } else { found })
}

fn known(layout: &Layout, request: &Request<'_>) -> Known {
    let wheelbase = if layout.position("wheelbase").is_some() { None } else { request.wheelbase };
    Known { model: layout.model, wheelbase, gain: request.gain, delay: request.delay }
}

/// Cost, what was assumed, the vehicle.
type Candidate = (f64, Known, Vehicle);

struct Search<'a> {
    problem: &'a Problem<'a>,
    weights: Vec<Weights>,
    information: Vec<Matrix3<f64>>,
}

impl<'a> Search<'a> {
    fn new(problem: &'a Problem<'a>) -> Self {
        let count = problem.motions.motions.len();
        let stated = problem.motions.covariances.as_ref();
        let weights =
            stated.map_or(vec![Weights::UNIT; count], |all| all.iter().map(Weights::from_covariance).collect());
        let inverse = |c: &Matrix3<f64>| c.try_inverse().unwrap_or_else(Matrix3::identity);
        let information =
            stated.map_or(vec![Matrix3::identity() * 1e6; count], |all| all.iter().map(inverse).collect());
        Self { problem, weights, information }
    }

    fn better(
        &self,
        mut best: Option<Candidate>,
        tries: impl Iterator<Item = Known>,
    ) -> Result<Option<Candidate>, Error> {
        for known in tries {
            let other = self.candidate(&known, &NO_TRIM)?;
            best = other.into_iter().chain(best).min_by(|a, b| a.0.total_cmp(&b.0));
        }
        Ok(best)
    }

    /// The best of both forms, of the model and its symmetric kind.
    fn candidate(&self, known: &Known, trim: &Trim) -> Result<Option<Candidate>, Error> {
        self.problem.token.check()?;
        let motions = &self.problem.motions.motions;
        let segments = Segments::new(self.problem.log, motions, known.delay);
        let all: Vec<usize> = (0..motions.len()).filter(|&k| !segments.steps(k).is_empty()).collect();
        let student = self.problem.options.student();
        let mut best: Option<Candidate> = None;
        for model in kinds(known.model) {
            let assumed = Known { model, ..*known };
            for form in [Form::Wheels, Form::Centres] {
                let solve =
                    |chosen: &[usize]| start::closed_form(&assumed, &segments, motions, &self.weights, chosen, form);
                if let Some(vehicle) = trimmed(trim, &segments, motions, solve).map(|t| t.vehicle) {
                    let cost = start::cost(&vehicle, &segments, motions, &self.information, &all, student);
                    if cost.is_finite() && best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                        best = Some((cost, *known, vehicle));
                    }
                }
            }
        }
        Ok(best)
    }

    fn fallback(&self, known: &Known) -> Option<Vehicle> {
        let motions = &self.problem.motions.motions;
        let segments = Segments::new(self.problem.log, motions, known.delay);
        start::fallback(known, &segments, motions, &self.weights)
    }
}

fn kinds(model: Model) -> Vec<Model> {
    if model == Model::TricycleAsymmetric { vec![model, Model::Tricycle] } else { vec![model] }
}

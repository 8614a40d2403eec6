//! From wheel readings and laser motions to a vehicle with all that is known of its errors.
//!
//! ```text
//! motions within the log -> closed form -> likelihood -> covariance -> tests, weak directions, held-out errors
//! ```
//!
//! A tricycle is estimated with one steering offset and with two; an asymmetry is accepted if its Wald statistic says
//! so and the drive holds it: too little driving backward must not make one up.

use super::error::Error;
use super::groups::{self, Test, f_beyond};
use super::held_out::{HeldOut, held_out};
use super::motions::{Motion, Motions};
use super::observability::{Driven, Observability, Weak, observe};
use super::options::{Options, RESIDUAL};
use super::parameters::{DELAY, Layout, Model, OFFSET_BACKWARD, OFFSET_FORWARD, Vehicle};
use super::request::{Request, free, model};
use super::robust::{Fit, Problem};
use super::sandwich::{Bread, ENOUGH};
use super::search::search;
use groma_estimation::{Student, chi_square, root};
use groma_models::{Drive, Token, WheelKind, WheelLog};
use nalgebra::{DMatrix, DVector, Vector3};
use std::convert::Infallible;

/// Share of a motion around its start in which wheels that move tell continuous driving.
const AROUND: f64 = 0.02;
/// Share of its path that they must move there.
const MOVING: f64 = 0.005;
/// Share of motions that go on from the one before, for the whole to be continuous.
const MOSTLY: f64 = 0.5;

/// A calibrated vehicle.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// What was estimated.
    pub layout: Layout,
    /// The vehicle.
    pub vehicle: Vehicle,
    /// Covariance of the free parameters over the directions that are held.
    pub covariance: DMatrix<f64>,
    /// Squared whitened residuals by the stated noise.
    pub chi_square: f64,
    /// Numbers less held directions.
    pub dof: usize,
    /// Factor on the stated standard deviations.
    pub noise_scale: f64,
    /// Degrees of freedom of intervals; nothing where the noise is taken as known.
    pub interval_dof: Option<usize>,
    /// Whether the estimate came to rest.
    pub converged: bool,
    /// Whether neighbouring motions were taken for correlated.
    pub correlated: bool,
    /// Residuals of all motions; NaN for those left out.
    pub residuals: Vec<Vector3<f64>>,
    /// Weights of all motions, 1 for a full say; NaN for those left out.
    pub weights: Vec<f64>,
    /// Questions to the residuals.
    pub tests: Vec<Test>,
    /// Directions that are not determined.
    pub weak: Vec<Weak>,
    /// Prediction of motions that were not used.
    pub held_out: Option<HeldOut>,
    /// What was assumed, chosen or left out.
    pub notes: Vec<String>,
}

/// Estimates a vehicle.
///
/// # Errors
/// See [`Error`]; [`Error::Cancelled`] soon after the token was. Weak directions are no error but part of the result.
pub fn calibrate(
    log: &WheelLog,
    motions: &Motions,
    request: &Request<'_>,
    options: &Options,
    token: &Token,
) -> Result<Calibration, Error> {
    options.validate()?;
    motions.check()?;
    let mut notes = Vec::new();
    let (model, free) = (model(log, request)?, free(log, request, &mut notes)?);
    let layout = Layout::new(model, &free)?;
    let kept = kept(log, motions, &layout, request, options, &mut notes)?;
    let used = motions.subset(&kept);
    let problem = Problem { log, motions: &used, layout: &layout, options, token };
    let start = search(&problem, request)?;
    let mut judged = judge(&problem, problem.estimate(start)?)?;
    let mut tests = Vec::new();
    let (symmetric, asymmetric) = (Layout::new(Model::Tricycle, &free), Layout::new(Model::TricycleAsymmetric, &free));
    let mut layout = layout.clone();
    if let (Drive::Tricycle(_), Ok(symmetric), Ok(asymmetric)) = (&start.drive, symmetric, asymmetric) {
        let other = Problem { layout: &asymmetric, ..problem };
        let wide = if model == Model::TricycleAsymmetric {
            judged.clone()
        } else {
            judge(&other, other.estimate(judged.fit.vehicle)?)?
        };
        let asymmetry = asymmetry(&asymmetric, &wide);
        let believed = is_believed(&asymmetry, &wide, &symmetric, options);
        if request.model.is_none() && believed {
            (layout, judged) = (asymmetric, wide);
        }
        notes.extend(words_on_asymmetry(&asymmetry, believed, request.model));
        tests.extend(asymmetry.test);
    }
    let problem = Problem { layout: &layout, ..problem };
    tests.extend(fit_test(&problem, &judged));
    tests.extend(groups::lack_of_fit(&layout, &judged.fit, &used.motions, judged.bread.lags));
    let held_out = held_out(&problem, &judged.fit.vehicle, options.folds)?;
    Ok(judged.result(&problem, motions.motions.len(), &kept, tests, held_out, notes))
}

/// The motions within the log, by the largest delay that is looked for.
fn kept(
    log: &WheelLog,
    motions: &Motions,
    layout: &Layout,
    request: &Request<'_>,
    options: &Options,
    notes: &mut Vec<String>,
) -> Result<Vec<usize>, Error> {
    let margin = if layout.is_free(DELAY) { options.delay_max } else { request.delay.abs() };
    let kept = motions.within(log, margin);
    let (all, needs) = (motions.motions.len(), layout.len() / RESIDUAL as usize + 1);
    if kept.len() < needs {
        return Err(Error::TooFew { within: kept.len(), all, needs });
    }
    if kept.len() < all {
        notes.push(format!("{} of {all} motions are left out: they reach beyond the wheel log", all - kept.len()));
    }
    Ok(kept)
}

/// A fit with its covariance.
#[derive(Clone, Debug)]
struct Judged {
    fit: Fit,
    bread: Bread,
    correlated: bool,
    observed: Observability,
    covariance: DMatrix<f64>,
}

fn judge(problem: &Problem<'_>, mut fit: Fit) -> Result<Judged, Error> {
    fit.vehicle = fit.vehicle.upright();
    let correlated = is_continuous(problem) && problem.motions.motions.len() >= ENOUGH * problem.layout.len();
    let bread = Bread::new(problem, &fit, correlated);
    let useless = problem.layout.useless(&fit.vehicle.to_full());
    let driven = Driven::new(&fit.vehicle, &fit.segments, &problem.motions.motions);
    let observed = observe(&bread.bread, &useless, &problem.layout.names(), &driven);
    let mut covariance = &observed.inverse * &bread.middle * &observed.inverse;
    if correlated {
        covariance = at_least(covariance, &observed.inverse);
    }
    Ok(Judged { fit, bread, correlated, observed, covariance })
}

/// A covariance with variances no less than those of another: correlated errors of few motions may seem to cancel.
fn at_least(covariance: DMatrix<f64>, other: &DMatrix<f64>) -> DMatrix<f64> {
    let factor = |k: usize| {
        let ratio = other[(k, k)] / covariance[(k, k)];
        if ratio.is_finite() { ratio.sqrt().max(1.0) } else { 1.0 }
    };
    let stretch = DMatrix::from_diagonal(&DVector::from_fn(other.nrows(), |k, _| factor(k)));
    &stretch * covariance * &stretch
}

/// Whether motions go on from each other while the wheels turn.
fn is_continuous(problem: &Problem<'_>) -> bool {
    let motions = &problem.motions.motions;
    let moves = |w: &[Motion]| {
        let (a, b) = (&w[0], &w[1]);
        let around = AROUND * (b.end - b.start);
        let counts = |from: f64, to: f64| -> f64 {
            let steps = problem.log.steps(from, to).unwrap_or_default();
            steps
                .iter()
                .map(|s| {
                    s.input.x.abs() + if problem.log.kind() == WheelKind::Differential { s.input.y.abs() } else { 0.0 }
                })
                .sum()
        };
        b.start - a.end <= around && counts(b.start - around, b.start + around) > MOVING * counts(b.start, b.end)
    };
    let going_on = motions.windows(2).filter(|w| moves(w)).count();
    going_on as f64 > MOSTLY * motions.len() as f64
}

impl Judged {
    fn dof(&self) -> usize {
        self.fit.numbers().saturating_sub(self.observed.rank)
    }

    /// Squared residuals whitened by the stated noise, without weights.
    fn chi_square(&self) -> f64 {
        self.fit.noise.whitener.columns(&self.fit.residuals).iter().map(Vector3::norm_squared).sum()
    }

    fn result(
        self,
        problem: &Problem<'_>,
        all: usize,
        kept: &[usize],
        tests: Vec<Test>,
        held_out: Option<HeldOut>,
        notes: Vec<String>,
    ) -> Calibration {
        let options = problem.options;
        let full = if options.robust { 1.0 / options.student().weight(0.0) } else { 1.0 };
        let (mut residuals, mut weights) = (vec![Vector3::repeat(f64::NAN); all], vec![f64::NAN; all]);
        for (j, &k) in kept.iter().enumerate() {
            (residuals[k], weights[k]) = (self.fit.residuals[j], self.fit.noise.weights[j] * full);
        }
        let scale = self.fit.noise.scale_sq.sqrt() / if options.robust { normal_scale(options.student()) } else { 1.0 };
        let noise_scale =
            if self.fit.noise.scatter.common || (options.noise_known && !options.robust) { 1.0 } else { scale };
        let (chi_square, dof) = (self.chi_square(), self.dof());
        Calibration {
            layout: problem.layout.clone(),
            vehicle: self.fit.vehicle,
            covariance: self.covariance,
            chi_square,
            dof,
            noise_scale,
            interval_dof: (!options.noise_known || options.robust).then_some(dof),
            converged: self.fit.converged,
            correlated: self.correlated,
            residuals,
            weights,
            tests,
            weak: self.observed.weak,
            held_out,
            notes,
        }
    }
}

/// Scale of Student's distribution that fits normal residuals of unit size: the root of `mean(w d^2) = 3 s^2`.
fn normal_scale(student: Student) -> f64 {
    let excess = |s_sq: f64| {
        let (mut sum, mut mass) = (0.0, 0.0);
        for k in 0..4000 {
            let d_sq = (f64::from(k) + 0.5) * 0.01;
            let density = d_sq.sqrt() * (-d_sq / 2.0).exp();
            sum += density * d_sq * student.weight(d_sq / s_sq);
            mass += density;
        }
        sum / mass - RESIDUAL * s_sq
    };
    let Ok((low, _)) = root::bisect((0.01, 1.0), 60, |s_sq| Ok::<_, Infallible>(excess(s_sq) > 0.0));
    low.sqrt()
}

struct Asymmetry {
    difference: f64,
    sigma: f64,
    test: Option<Test>,
}

/// Offset forward less offset backward, and whether that may be chance.
fn asymmetry(layout: &Layout, wide: &Judged) -> Asymmetry {
    let x = wide.fit.vehicle.to_full();
    let contrast = DVector::from_iterator(
        layout.len(),
        layout.names().iter().map(|name| match *name {
            "steering_offset_forward" => 1.0,
            "steering_offset_backward" => -1.0,
            _ => 0.0,
        }),
    );
    let difference = x[OFFSET_FORWARD] - x[OFFSET_BACKWARD];
    let held = wide.observed.weak.iter().all(|w| w.direction.dot(&contrast).abs() < 1e-6);
    let variance = (&wide.covariance * &contrast).dot(&contrast);
    let sigma = if held { variance.sqrt() } else { f64::INFINITY };
    let statistic = (difference / sigma).powi(2);
    let p_value = f_beyond(statistic, 1, wide.dof().max(1));
    Asymmetry { difference, sigma, test: held.then_some(Test { name: "asymmetry", statistic, dof: 1, p_value }) }
}

fn is_believed(asymmetry: &Asymmetry, wide: &Judged, symmetric: &Layout, options: &Options) -> bool {
    let holds_more = wide.observed.rank > symmetric.len();
    let significant = asymmetry.test.as_ref().is_some_and(|t| t.p_value < options.asymmetry_level);
    holds_more && significant && asymmetry.sigma <= options.asymmetry_sigma_max
}

fn words_on_asymmetry(asymmetry: &Asymmetry, believed: bool, model: Option<Model>) -> Option<String> {
    let (degrees, sigma) = (asymmetry.difference.to_degrees(), asymmetry.sigma.to_degrees());
    let size = format!("the steering offset differs by {degrees:.3} +- {sigma:.3} deg between forward and backward");
    match (asymmetry.test.as_ref(), believed, model) {
        (_, true, None) => Some(format!("{size}: the asymmetric model was chosen")),
        (_, true, Some(Model::Tricycle)) => Some(format!("{size}: the model tricycle-asymmetric would hold that")),
        (None, ..) => {
            Some("whether steering differs between forward and backward is not seen: drive arcs both ways".into())
        }
        (Some(_), false, None) if asymmetry.sigma > 0.01 => {
            Some(format!("{size}: too uncertain, drive more arcs both ways"))
        }
        _ => None,
    }
}

/// Whether the residuals are as large as the stated noise says.
fn fit_test(problem: &Problem<'_>, judged: &Judged) -> Option<Test> {
    let (statistic, dof) = (judged.chi_square(), judged.dof());
    let stated = problem.motions.covariances.is_some() && dof > 0;
    stated.then(|| Test { name: "fit", statistic, dof, p_value: chi_square::beyond(statistic, dof) })
}

//! The estimate: Gauss-Newton steps of the weighted likelihood, or of Student's, by expectation and maximisation.
//!
//! With residuals r of three numbers and Student's distribution of `tail` degrees of freedom, scale `s^2 S`:
//!
//! ```text
//! d^2 = r^T S^-1 r,     w = (tail + 3)/(tail + d^2/s^2)
//! s^2 = sum(w d^2)/(3 sum(w))   or, where one S is estimated,   S = sum(w r r^T)/sum(w)
//! ```
//!
//! and a weighted step, in turn until nothing moves; the noise of the wheels is that of the vehicle so far, so that it is
//! that of the estimate in the end. The likelihood rises in every turn. With couplings r is what a
//! residual has beyond what the one before predicts of it, and S its covariance. The divisor `sum(w)`, which is the number
//! of residuals in the end, makes this a few turns (Kent, Tyler, Vardi, Comm. Statist. Simul. 23 (1994)).
//! Not by `estimation::levenberg_marquardt`: weights, scale and covariances are of another problem after every step, so
//! costs do not compare from turn to turn; within a turn a step is halved until the weighted squares do not rise. Minimising
//! the squares of every turn by it gives the same estimate after as many turns (454 instead of 453 over 20 calibrations), with
//! 1323 linearisations instead of one a turn (`tests/vehicle_common_loop.rs` prints it).
//! Source: Lange, Little, Taylor, "Robust statistical modeling using the t distribution", JASA 84 (1989).

use super::Error;
use super::likelihood::{self, Row};
use super::motions::{Motions, Segments};
use super::noise::Scatter;
use super::options::{Options, RESIDUAL};
use super::parameters::{DELAY, Full, Layout, Vehicle};
use super::whitener::Whitener;
use groma_models::{Token, WheelLog};
use nalgebra::{DVector, Matrix3, Vector3};

/// Turns of the iteration, at most.
const TURNS: usize = 100;
/// Turns, at least.
const LEAST_TURNS: usize = 3;
/// The noise of the wheels follows the vehicle until it moves by less than this share of a standard deviation, squared.
const NOISE_STILL: f64 = 1e-6;
/// The end: a step of this share of a standard deviation, squared.
const STILL: f64 = 1e-10;
/// The end in numbers: a step of this share of what would be of no use.
const ROUNDING: f64 = 1e-13;
/// Halvings of a step that makes the fit worse.
const HALVINGS: usize = 12;
/// A step shorter than this, squared, in standard deviations of the stated noise, is not tried for size.
const SMALL: f64 = 1e-6;
/// The scale is settled when it changes by this share.
const SETTLED: f64 = 1e-6;
/// Least variance of a residual, so that perfect data have one [m^2, rad^2].
const FLOOR: f64 = 1e-22;
/// The same as a share of the largest, so that residuals along a line have a width.
const RELATIVE_FLOOR: f64 = 1e-12;

/// What is to be estimated from what.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// Wheels.
    pub log: &'a WheelLog,
    /// Motions of the laser.
    pub motions: &'a Motions,
    /// Free parameters.
    pub layout: &'a Layout,
    /// Settings.
    pub options: &'a Options,
    /// Asks a long fit to end.
    pub token: &'a Token,
}

/// An estimate and all that its judgement needs.
#[derive(Clone, Debug)]
pub struct Fit {
    /// The vehicle.
    pub vehicle: Vehicle,
    /// The steps of the wheels at its delay.
    pub segments: Segments,
    /// Residuals as they are.
    pub residuals: Vec<Vector3<f64>>,
    /// Rows whitened with the stated covariance and the weights, not with the scale.
    pub white: Vec<Row>,
    /// What the residuals scatter like.
    pub noise: Noise,
    /// Turns taken.
    pub turns: usize,
    /// Whether the end was reached.
    pub converged: bool,
}

/// What the residuals scatter like.
#[derive(Clone, Debug)]
pub struct Noise {
    /// Covariances, up to the factor.
    pub scatter: Scatter,
    /// Their factor.
    pub whitener: Whitener,
    /// Weights; that of a residual of no size is `(tail + 3)/tail` in Student's case.
    pub weights: Vec<f64>,
    /// Squared factor on the covariances.
    pub scale_sq: f64,
}

struct State {
    vehicle: Vehicle,
    segments: Segments,
    rows: Vec<Row>,
}

impl Problem<'_> {
    /// Improves a start until nothing moves.
    ///
    /// # Errors
    /// [`Error::Degenerate`] when the stated covariance of the motions, with its couplings, is none;
    /// [`Error::Cancelled`].
    pub fn estimate(&self, start: Vehicle) -> Result<Fit, Error> {
        let mut state = self.state(start, self.read(&start));
        let mut noise = Noise::new(self.scatter(&state), state.rows.len())?;
        let (mut turns, mut converged, mut moving) = (0, false, false);
        while turns < TURNS && !converged {
            self.token.check()?;
            if moving && !noise.scatter.common {
                let scatter = self.scatter(&state);
                noise = Noise { whitener: whitener(&scatter)?, scatter, ..noise };
            }
            let before = noise.scale_sq;
            self.expect(&state, &mut noise, turns == 0)?;
            let (next, length_sq, moved) = self.improve(state, &noise);
            state = next;
            turns += 1;
            let settled = !self.options.robust || (noise.scale_sq / before - 1.0).abs() < SETTLED;
            let still = length_sq <= STILL * noise.scale_sq && settled;
            moving = length_sq > NOISE_STILL * noise.scale_sq;
            converged = turns >= LEAST_TURNS && (still || moved <= ROUNDING);
        }
        self.finish(state, noise, turns, converged)
    }

    fn state(&self, vehicle: Vehicle, segments: Segments) -> State {
        let rows = likelihood::rows(&vehicle, &segments, self.motions);
        State { vehicle, segments, rows }
    }

    fn scatter(&self, state: &State) -> Scatter {
        Scatter::new(self.motions, &state.vehicle, &state.segments, self.options)
    }

    /// Weights and scale of the residuals as they are.
    fn expect(&self, state: &State, noise: &mut Noise, first: bool) -> Result<(), Error> {
        let residuals: Vec<Vector3<f64>> = state.rows.iter().map(|row| row.residual).collect();
        let d_sq: Vec<f64> = noise.whitener.columns(&residuals).iter().map(Vector3::norm_squared).collect();
        let count = d_sq.len() as f64;
        if first && !noise.scatter.common {
            noise.scale_sq = (d_sq.iter().sum::<f64>() / (RESIDUAL * count)).max(f64::MIN_POSITIVE);
        }
        if self.options.robust {
            let student = self.options.student();
            noise.weights = d_sq.iter().map(|d_sq| student.weight(d_sq / noise.scale_sq)).collect();
        }
        let total: f64 = noise.weights.iter().sum();
        if noise.scatter.common {
            let outer = |(r, w): (&Vector3<f64>, &f64)| r * r.transpose() * (*w / total);
            let mean: Matrix3<f64> = residuals.iter().zip(&noise.weights).map(outer).sum();
            let floor = FLOOR + RELATIVE_FLOOR * mean.trace();
            noise.scatter.blocks.fill(mean + Matrix3::identity() * floor);
            noise.whitener = whitener(&noise.scatter)?;
        } else {
            let squares: f64 = noise.weights.iter().zip(&d_sq).map(|(w, d)| w * d).sum();
            noise.scale_sq = (squares / (RESIDUAL * total)).max(f64::MIN_POSITIVE);
        }
        Ok(())
    }

    /// A step that does not make the weighted fit worse; its squared length in standard deviations, and in numbers.
    fn improve(&self, state: State, noise: &Noise) -> (State, f64, f64) {
        let white = noise.white(&state.rows);
        let (normal, gradient) = likelihood::normal(&white);
        let at = state.vehicle.to_full();
        let mut step = likelihood::step(self.layout, &at, &normal, &gradient);
        let length_sq = (self.layout.reduced(&normal) * &step).dot(&step);
        let before: f64 = white.iter().map(|row| row.residual.norm_squared()).sum();
        for _ in 0..HALVINGS {
            if length_sq < SMALL || self.cost(&state, noise, &self.layout.moved(&at, &step)) <= before {
                break;
            }
            step *= 0.5;
        }
        let vehicle = state.vehicle.with_full(&self.layout.moved(&at, &step));
        let moved = step.component_div(&self.layout.useless(&at)).amax();
        let again = self.layout.is_free(DELAY);
        let segments = if again { self.read(&vehicle) } else { state.segments };
        (self.state(vehicle, segments), length_sq, moved)
    }

    /// Weighted squares at other parameters.
    fn cost(&self, state: &State, noise: &Noise, at: &Full) -> f64 {
        let vehicle = state.vehicle.with_full(at);
        let read = self.layout.is_free(DELAY).then(|| self.read(&vehicle));
        let segments = read.as_ref().unwrap_or(&state.segments);
        let residuals = likelihood::residuals(&vehicle, segments, self.motions);
        let white = noise.whitener.columns(&residuals);
        white.iter().zip(&noise.weights).map(|(y, w)| w * y.norm_squared()).sum()
    }

    /// The steps at a vehicle's delay.
    fn read(&self, vehicle: &Vehicle) -> Segments {
        Segments::new(self.log, &self.motions.motions, vehicle.delay)
    }

    fn finish(&self, state: State, mut noise: Noise, turns: usize, converged: bool) -> Result<Fit, Error> {
        self.expect(&state, &mut noise, false)?;
        let white = noise.white(&state.rows);
        if !self.options.robust {
            let sum: f64 = white.iter().map(|row| row.residual.norm_squared()).sum();
            let dof = RESIDUAL * state.rows.len() as f64 - self.layout.len() as f64;
            let known = self.options.noise_known && !noise.scatter.common;
            noise.scale_sq = if known { 1.0 } else { sum / dof.max(1.0) };
        }
        let residuals = state.rows.iter().map(|row| row.residual).collect();
        let State { vehicle, segments, .. } = state;
        Ok(Fit { vehicle, segments, residuals, white, noise, turns, converged })
    }
}

impl Noise {
    fn new(scatter: Scatter, count: usize) -> Result<Self, Error> {
        Ok(Self { whitener: whitener(&scatter)?, scatter, weights: vec![1.0; count], scale_sq: 1.0 })
    }

    /// White rows with their weights.
    fn white(&self, rows: &[Row]) -> Vec<Row> {
        self.whitener.rows(rows).iter().zip(&self.weights).map(|(row, w)| row.weighted(*w)).collect()
    }
}

fn whitener(scatter: &Scatter) -> Result<Whitener, Error> {
    Whitener::new(scatter).ok_or(Error::Degenerate(
        "the covariance of the motions is not positive definite with its couplings: state larger covariances or leave \
         the couplings out",
    ))
}

impl Fit {
    /// Residuals that say something, as numbers.
    #[must_use]
    pub fn numbers(&self) -> usize {
        let used = (0..self.segments.len()).filter(|&k| !self.segments.steps(k).is_empty());
        RESIDUAL as usize * used.count()
    }

    /// Values of free parameters.
    #[must_use]
    pub fn values(&self, layout: &Layout) -> DVector<f64> {
        layout.values(&self.vehicle.to_full())
    }
}

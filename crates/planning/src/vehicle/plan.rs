//! From wanted accuracies to the arcs to drive.

use super::arcs::{Arc, Limits, Noise, candidates};
use super::design::{Choice, best_mixture};
use super::floor::{Floor, Footprint};
use super::rounding::rounded;
use groma_calibration::vehicle::{Layout, Vehicle as Calibrated};
use groma_geometry::Se2;
use groma_models::{Cancelled, ModelError, Scanner, Token, Vehicle};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Arcs of a plan, at most.
const MOST_ARCS: f64 = 1e3;

/// What is required of which vehicle, where.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The vehicle, about.
    pub vehicle: Calibrated,
    /// What is to be estimated.
    pub layout: &'a Layout,
    /// Standard deviations wanted, of the free parameters in their order; nothing where that of a tape measure will do.
    pub sigmas: &'a [Option<f64>],
    /// Noise of a motion.
    pub noise: Noise,
    /// What may be driven.
    pub limits: Limits,
    /// The floor and the outline on it; nothing where there is room enough.
    pub floor: Option<(Floor, Footprint)>,
}

/// Arcs in the order of driving.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The arcs.
    pub arcs: Vec<Arc>,
    /// Where the base stands at the start of each: on the floor, or at the end of the one before.
    pub starts: Vec<Se2>,
    /// Standard deviations that they give, of the free parameters.
    pub sigmas: DVector<f64>,
    /// Time they take [s].
    pub time: f64,
    /// No plan of these arcs, in parts of arcs either, takes less [s].
    pub bound: f64,
}

/// Why there is no plan.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// No arc is within the limits.
    #[error("no arc is within the limits: allow a longer path, or larger steering angles")]
    NoArcs,
    /// No arc fits on the floor.
    #[error("no arc fits on the floor: allow shorter turns, or a larger floor")]
    NoRoom,
    /// The arcs that fit do not hold the parameters.
    #[error("the arcs within the limits do not hold all parameters: allow more steering angles, or a larger floor")]
    Weak,
    /// What is required takes too many arcs.
    #[error("the wanted standard deviations take more than 1000 arcs: ask for larger ones")]
    TooMany,
    /// A number is out of range.
    #[error(transparent)]
    Number(#[from] ModelError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A required accuracy is invalid.
    #[error("a wanted standard deviation must be above 0 and finite, and one must be given at least")]
    Sigma,
}

/// Finds the arcs that take the least time.
///
/// # Errors
/// See [`Error`].
pub fn plan(request: &Request<'_>, token: &Token) -> Result<Plan, Error> {
    let wanted: Vec<f64> = request.sigmas.iter().flatten().copied().collect();
    if wanted.is_empty() || wanted.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return Err(Error::Sigma);
    }
    check(request)?;
    let all = candidates(&request.vehicle, &request.limits);
    if all.is_empty() {
        return Err(Error::NoArcs);
    }
    let (arcs, starts) = fitting(request, all, token)?;
    if arcs.is_empty() {
        return Err(Error::NoRoom);
    }
    let choice = choice(request, &arcs);
    token.check()?;
    let mixture = best_mixture(&choice, token)?.ok_or(Error::Weak)?;
    if mixture.repetitions.iter().sum::<f64>() > MOST_ARCS {
        return Err(Error::TooMany);
    }
    let counts = rounded(&choice, &mixture, token)?;
    Ok(laid_out(request, &choice, &arcs, &starts, &counts, mixture.bound))
}

fn check(request: &Request<'_>) -> Result<(), Error> {
    request.limits.validate()?;
    request.noise.validate()?;
    let laser = Scanner { name: String::new(), mount: request.vehicle.laser, range_offset: 0.0 };
    Vehicle::new(request.vehicle.drive, vec![laser], request.vehicle.delay)?;
    Ok(request.floor.as_ref().map_or(Ok(()), |(_, footprint)| footprint.validate())?)
}

/// What arcs tell, in units of the wanted standard deviations, and how long they take.
#[must_use]
pub fn choice(request: &Request<'_>, arcs: &[Arc]) -> Choice {
    let units = units(request);
    let scaled = |n: DMatrix<f64>| DMatrix::from_fn(units.len(), units.len(), |r, c| n[(r, c)] * units[r] * units[c]);
    let information = |arc: &Arc| scaled(arc.information(&request.vehicle, request.layout, &request.noise));
    Choice {
        information: arcs.iter().map(information).collect(),
        cost: arcs.iter().map(|arc| arc.time(&request.limits)).collect(),
    }
}

fn units(request: &Request<'_>) -> DVector<f64> {
    let useless = request.layout.useless(&request.vehicle.to_full());
    DVector::from_fn(useless.len(), |k, _| request.sigmas[k].unwrap_or(useless[k]))
}

/// The arcs that fit, with a start pose.
fn fitting(request: &Request<'_>, arcs: Vec<Arc>, token: &Token) -> Result<(Vec<Arc>, Vec<Se2>), Cancelled> {
    let Some((floor, footprint)) = &request.floor else {
        let starts = vec![Se2::IDENTITY; arcs.len()];
        return Ok((arcs, starts));
    };
    let (mut fit, mut starts) = (Vec::new(), Vec::new());
    for arc in arcs {
        token.check()?;
        if let Some(start) = floor.start(&request.vehicle, &arc, footprint) {
            fit.push(arc);
            starts.push(start);
        }
    }
    Ok((fit, starts))
}

/// Arcs one after the other: equal ones there and back where both are driven.
fn laid_out(
    request: &Request<'_>,
    choice: &Choice,
    arcs: &[Arc],
    starts: &[Se2],
    counts: &[usize],
    bound: f64,
) -> Plan {
    let mut order: Vec<usize> = (0..arcs.len()).flat_map(|k| vec![k; counts[k]]).collect();
    order.sort_by(|&a, &b| {
        let shape = |k: usize| (arcs[k].steering, arcs[k].path.abs());
        shape(a).partial_cmp(&shape(b)).unwrap_or(std::cmp::Ordering::Equal)
    });
    let repetitions: Vec<f64> = counts.iter().map(|&n| n as f64).collect();
    let n = request.layout.len();
    let covariance = choice.covariance(&repetitions).unwrap_or_else(|| DMatrix::from_element(n, n, f64::INFINITY));
    Plan {
        arcs: order.iter().map(|&k| arcs[k]).collect(),
        starts: order.iter().map(|&k| starts[k]).collect(),
        sigmas: covariance.diagonal().map(f64::sqrt).component_mul(&units(request)),
        time: choice.total(&repetitions),
        bound,
    }
}

//! Prediction of motions that the estimate has not seen.
//!
//! Motions are dealt out in turn, so that every part has all of the drive; each part is predicted by an estimate from
//! the others. Errors hold the noise of the measured motion as well.

use super::Error;
use super::likelihood;
use super::motions::Segments;
use super::parameters::Vehicle;
use super::robust::Problem;
use groma_estimation::robust::quantile;
use nalgebra::Vector3;

/// Share of the position errors whose root mean square is told.
const TRIMMED: f64 = 0.9;

/// Errors of predicted motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOut {
    /// Number of parts.
    pub folds: usize,
    /// Median error of position [m].
    pub position_median: f64,
    /// Median error of heading [rad].
    pub heading_median: f64,
    /// Root mean square of the smallest nine in ten errors of position [m].
    pub position_rms: f64,
}

/// Holds out every part in turn; nothing when there are fewer motions than parts.
///
/// # Errors
/// Those of the estimates.
pub fn held_out(problem: &Problem<'_>, start: &Vehicle, folds: usize) -> Result<Option<HeldOut>, Error> {
    let count = problem.motions.motions.len();
    if folds < 2 || count / 2 < folds {
        return Ok(None);
    }
    let mut errors: Vec<Vector3<f64>> = Vec::with_capacity(count);
    for fold in 0..folds {
        let (out, others): (Vec<usize>, Vec<usize>) = (0..count).partition(|k| k % folds == fold);
        let [seen, unseen] = [others, out].map(|indices| problem.motions.subset(&indices));
        let fit = Problem { motions: &seen, ..*problem }.estimate(*start)?;
        let segments = Segments::new(problem.log, &unseen.motions, fit.vehicle.delay);
        errors.extend(likelihood::residuals(&fit.vehicle, &segments, &unseen));
    }
    let mut position: Vec<f64> = errors.iter().map(|e| e.xy().norm()).collect();
    let mut heading: Vec<f64> = errors.iter().map(|e| e.z.abs()).collect();
    let medians = quantile(&mut position, 0.5).zip(quantile(&mut heading, 0.5));
    let best = &position[..(TRIMMED * count as f64) as usize];
    let rms = (best.iter().map(|e| e * e).sum::<f64>() / best.len().max(1) as f64).sqrt();
    Ok(medians.map(|(position_median, heading_median)| HeldOut {
        folds,
        position_median,
        heading_median,
        position_rms: rms,
    }))
}

//! Trimming: solve, drop the motions of the largest residuals, solve again.
//!
//! ```text
//! residual of a motion: l (+) s - o (+) l,  its heading and its length in the plane
//! a round drops what is above the (1 - share) quantile in either
//! ```
//!
//! The quantile is the element `round((1 - share) n)` of the sorted residuals, as in the program that accompanies
//! Censi et al., "Simultaneous calibration of odometry and sensor parameters for mobile robots", T-RO 29 (2013).

use super::motions::{Motion, Segments};
use super::parameters::Vehicle;
use super::prediction;
use groma_geometry::wrap;
use nalgebra::Vector2;

/// How much is dropped, and how often.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trim {
    /// Rounds.
    pub rounds: usize,
    /// Share dropped in a round, of heading and of place.
    pub share: f64,
}

impl Default for Trim {
    fn default() -> Self {
        Self { rounds: 4, share: 0.01 }
    }
}

/// A vehicle and the motions that were left to estimate it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trimmed {
    /// The estimate from them.
    pub vehicle: Vehicle,
    /// The motions kept.
    pub kept: Vec<usize>,
}

/// Solves and trims in turn; nothing when a round has no solution.
pub fn trimmed(
    trim: &Trim,
    segments: &Segments,
    motions: &[Motion],
    mut solve: impl FnMut(&[usize]) -> Option<Vehicle>,
) -> Option<Trimmed> {
    let mut kept: Vec<usize> = (0..motions.len()).filter(|&k| !segments.steps(k).is_empty()).collect();
    for _ in 0..trim.rounds {
        let vehicle = solve(&kept)?;
        let residuals: Vec<_> = kept.iter().map(|&k| residual(&vehicle, segments, motions, k)).collect();
        let [heading, place] = [0, 1].map(|axis| threshold(residuals.iter().map(|r| r[axis]), trim.share));
        let stays = |r: &Vector2<f64>| r.x <= heading && r.y <= place;
        kept = kept.iter().zip(&residuals).filter(|(_, r)| stays(r)).map(|(&k, _)| k).collect();
    }
    solve(&kept).map(|vehicle| Trimmed { vehicle, kept })
}

/// Size of the residual in heading [rad] and in the plane [m].
fn residual(vehicle: &Vehicle, segments: &Segments, motions: &[Motion], k: usize) -> Vector2<f64> {
    let (base, m) = (prediction::base_motion(&vehicle.drive, segments.steps(k)), &motions[k]);
    let place = vehicle.laser.act(m.motion.translation) - base.act(vehicle.laser.translation);
    Vector2::new(wrap(m.turn - base.theta()).abs(), place.norm())
}

fn threshold(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let index = ((1.0 - share) * sorted.len() as f64).round() as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::INFINITY)
}

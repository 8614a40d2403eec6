//! Common trajectories, judged before one camera with the panels that are there.
//!
//! A drive is *degenerate* when its views alone leave the focal length uncertain by more than the calibration gives out
//! (`focal_tolerance`), or hold some direction not at all: the calibration would refuse them.

use super::motion::{Drive, Motion};
use super::stage::Stage;
use crate::error::Error;
use crate::exploration::Noise;
use groma_calibration::camera::Options;
use groma_models::Target;

/// A drive and what it gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Judged {
    /// Which.
    pub motion: Motion,
    /// The panels as it shows them.
    pub shown: Target,
    /// Its stops.
    pub drive: Drive,
    /// Panels seen in all.
    pub views: usize,
    /// Worst standard deviation of a pixel after it, from nominal intrinsics on [pixel].
    pub worst: f64,
    /// Standard deviations of the parameters from its views alone; None when they do not determine a direction.
    pub sigmas: Option<Vec<f64>>,
    /// Whether a calibration would be refused.
    pub degenerate: bool,
    /// By how much odometry makes the place of the camera less certain on it [m^2].
    pub variance: f64,
}

/// Judges all drives with their middle at a distance before the camera [m]; the best pixel first, degenerate ones last.
///
/// # Errors
/// When a stage cannot be set.
pub fn ranking(stage: &Stage, distance: f64, noise: &Noise) -> Result<Vec<Judged>, Error> {
    Error::unless(distance > 0.0 && distance.is_finite(), "distance", distance, "must be above 0 and finite")?;
    let all: Result<Vec<_>, _> = Motion::ALL.iter().map(|&motion| judged(stage, motion, distance, noise)).collect();
    let mut all = all?;
    all.sort_by(|a, b| a.degenerate.cmp(&b.degenerate).then(a.worst.total_cmp(&b.worst)));
    Ok(all)
}

fn judged(stage: &Stage, motion: Motion, distance: f64, noise: &Noise) -> Result<Judged, Error> {
    let stage = stage.with_target(motion.shown(&stage.target))?;
    let drive = motion.drive(distance, motion.stops());
    let knowledge = drive.knowledge(&stage);
    let sigmas =
        knowledge.covariance_of_views().map(|c| c.diagonal().map(f64::sqrt).iter().copied().collect::<Vec<_>>());
    let degenerate = sigmas.as_ref().is_none_or(|s| !is_enough(stage.camera.parameters(), s));
    let (worst, views, variance) = (knowledge.worst(), knowledge.views(), drive.variance(noise));
    Ok(Judged { motion, shown: stage.target, drive, views, worst, sigmas, degenerate, variance })
}

/// Whether the focal lengths are certain enough for the calibration.
fn is_enough(parameters: &[f64], sigmas: &[f64]) -> bool {
    let tolerance = Options::default().focal_tolerance;
    (0..2).all(|k| sigmas[k] <= tolerance * parameters[k])
}

#[cfg(test)]
mod tests {
    use super::super::stage::{FAN, SIGMA, mount, nominal_camera, upright_panels};
    use super::*;

    #[test]
    fn drives_that_determine_nothing_are_called_degenerate_and_come_last() {
        let target = upright_panels(&FAN);
        let stage = Stage::new(nominal_camera().unwrap(), mount(2.0, 0.43).unwrap(), target, SIGMA).unwrap();
        let ranked = ranking(&stage, 2.6, &Noise::default()).unwrap();
        let flawed = |m: Motion| ranked.iter().any(|j| j.motion == m && j.degenerate);
        assert!(flawed(Motion::Stationary) && flawed(Motion::OnePanel));
        assert!(!flawed(Motion::Square) && !flawed(Motion::Star) && !flawed(Motion::Rotation));
        assert!(ranked[..4].windows(2).all(|p| p[1].degenerate || p[0].worst <= p[1].worst));
        assert!(ranked[5].degenerate);
    }
}

//! A drive tried out: corners drawn with noise, calibrated from nothing, as often as asked.
//!
//! Compared are the intrinsics that calibration returns over the trials: their mean and their standard deviation as a
//! share of it, the table of the thesis. That is repeatability; what is not told by the views is refused by the
//! calibration, and counted.

use super::motion::Drive;
use super::stage::Stage;
use groma_calibration::camera::{Options, Sighting, View, calibrate};
use groma_geometry::LieGroup;
use groma_simulation::random::{Purpose, Random};

/// What the trials gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Trials {
    /// Mean of every parameter.
    pub mean: Vec<f64>,
    /// Standard deviation of every parameter.
    pub deviation: Vec<f64>,
    /// Trials whose calibration was refused, with the reason of the last.
    pub refused: usize,
    /// Why.
    pub reason: Option<String>,
}

/// Calibrates from the views of a drive, `runs` times.
#[must_use]
pub fn trials(stage: &Stage, drive: &Drive, runs: u64, seed: u64) -> Trials {
    let options = Options { lens: stage.camera.lens(), splits: 0, ..Options::default() };
    let (mut found, mut reason): (Vec<Vec<f64>>, _) = (vec![], None);
    for run in 0..runs {
        let views = drawn(stage, drive, seed.wrapping_add(run));
        match calibrate(stage.camera.width(), stage.camera.height(), &views, &options) {
            Ok(result) => found.push(result.camera.parameters().to_vec()),
            Err(refusal) => reason = Some(refusal.to_string()),
        }
    }
    let (count, n) = (found.len() as f64, stage.camera.count());
    let mean: Vec<f64> = (0..n).map(|k| found.iter().map(|p| p[k]).sum::<f64>() / count).collect();
    let square = |k: usize| found.iter().map(|p| (p[k] - mean[k]).powi(2)).sum::<f64>() / (count - 1.0);
    let deviation = (0..n).map(|k| square(k).sqrt()).collect();
    Trials { mean, deviation, refused: runs as usize - found.len(), reason }
}

fn drawn(stage: &Stage, drive: &Drive, seed: u64) -> Vec<View> {
    let mut random = Random::new(seed, Purpose::Ranges);
    let mut views = vec![];
    for (image, stop) in drive.stops.iter().enumerate() {
        for view in stage.views(stop) {
            let mut corners = vec![];
            for &point in &view.corners {
                if let Some(mut pixel) = stage.camera.project(&view.pose.act(&point)) {
                    pixel.x += stage.sigma * random.normal();
                    pixel.y += stage.sigma * random.normal();
                    corners.push(Sighting { point, pixel, sigma: stage.sigma });
                }
            }
            views.push(View { image, corners });
        }
    }
    views
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Motion;

    #[test]
    #[allow(clippy::print_stdout)]
    #[ignore = "ten calibrations of each drive"]
    fn what_tells_nothing_is_refused_and_the_rest_scatters_as_predicted() {
        for motion in Motion::ALL {
            let stage = Stage::new(Stage::nominal_camera().unwrap(), 2.0, 0.43, motion.yaws()).unwrap();
            let drive = motion.drive(2.6, if motion == Motion::Star { 27 } else { 40 });
            let tried = trials(&stage, &drive, 10, 1);
            let covariance = drive.knowledge(&stage).covariance().unwrap();
            let share = |k: usize| 100.0 * tried.deviation[k] / tried.mean[k].abs();
            let told = |k: usize| 100.0 * covariance[(k, k)].sqrt() / stage.camera.parameters()[k].abs();
            println!("{motion:?}: refused {} of 10 ({})", tried.refused, tried.reason.clone().unwrap_or_default());
            for (k, name) in [(0, "fx"), (2, "cx"), (4, "k1")] {
                println!(
                    "  {name}: mean {:.2}, deviation {:.2} %, predicted {:.2} %",
                    tried.mean[k],
                    share(k),
                    told(k)
                );
            }
            let degenerate = matches!(motion, Motion::Stationary | Motion::OnePanel);
            assert_eq!(tried.refused, if degenerate { 10 } else { 0 }, "{motion:?}");
            // Ten trials tell a deviation to a factor of two, nearly always.
            assert!(degenerate || (0.4..2.0).contains(&(share(0) / told(0))), "{motion:?}");
        }
    }
}

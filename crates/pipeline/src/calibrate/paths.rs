//! What a calibrated vehicle did, by its wheels: distance and turn of every motion, and the path of its laser.
//!
//! ```text
//! T_base(t)    = T_base(k) T_step     k the last reading before t, the step from there to t; nothing across a break
//! told         T_base(t + delay) T_base_laser
//! measured     told at the start of a piece, then one measured motion after the other
//! ```
//!
//! A piece is a run of motions of which each begins where the one before ends. For pictures and tables: nothing is estimated
//! from it.

use super::Outcome;
use super::coupling::is_shared;
use super::standstill::Rates;
use groma_geometry::Se2;
use nalgebra::Vector2;

/// Time between points of a path [s].
const DENSE: f64 = 0.1;

/// The path of the laser over a piece of the drive, seen from where the base was at the first reading [m].
#[derive(Clone, Debug, PartialEq)]
pub struct LaserPath {
    /// At the ends of the motions, as measured from the first on.
    pub measured: Vec<Vector2<f64>>,
    /// As the wheels tell it.
    pub told: Vec<Vector2<f64>>,
}

impl Outcome {
    /// Distance [m], negative backward, and turn [rad] of every motion, by the wheels; zero where they do not cover it.
    #[must_use]
    pub fn driven(&self) -> Vec<Vector2<f64>> {
        let (drive, delay) = (&self.calibration.vehicle.drive, self.calibration.vehicle.delay);
        let of = |start: f64, end: f64| {
            let steps = self.log.steps(start + delay, end + delay).unwrap_or_default();
            steps.iter().map(|step| drive.path_and_turn(step.input)).sum()
        };
        self.motions.motions.iter().map(|m| of(m.start, m.end)).collect()
    }

    /// The path of the laser, piece by piece.
    #[must_use]
    pub fn laser_paths(&self) -> Vec<LaserPath> {
        let (base, laser) = (self.base_at_readings(), self.calibration.vehicle.laser);
        let piece = |motions: &[groma_calibration::vehicle::Motion]| {
            let (start, end) = (motions.first()?.start, motions.last()?.end);
            let count = (((end - start) / DENSE) as usize).max(2);
            let time = |k: usize| start + (end - start) * k as f64 / (count - 1) as f64;
            let at = |time: f64| self.base_at(&base, time) * laser;
            let mut measured = vec![at(start)];
            measured.extend(motions.iter().scan(at(start), |pose, m| {
                *pose = *pose * m.motion;
                Some(*pose)
            }));
            let told = (0..count).map(|k| at(time(k)).translation).collect();
            Some(LaserPath { measured: measured.iter().map(|p| p.translation).collect(), told })
        };
        self.motions.motions.chunk_by(is_shared).filter_map(piece).collect()
    }

    /// The base at every reading, seen from the first.
    fn base_at_readings(&self) -> Vec<Se2> {
        let (log, rates) = (&self.log, Rates::new(&self.log, &self.breaks));
        let mut poses = vec![Se2::IDENTITY];
        for k in 1..log.time().len() {
            let step = log.kind().input(log.reading(k - 1), log.reading(k));
            let moved =
                if rates.is_broken(k - 1) { Se2::IDENTITY } else { self.calibration.vehicle.drive.motion(step) };
            poses.push(poses[k - 1] * moved);
        }
        poses
    }

    /// The base at the time of a scan; beyond the readings, at the nearest.
    fn base_at(&self, readings: &[Se2], scan: f64) -> Se2 {
        let (first, last) = self.log.span();
        let time = (scan + self.calibration.vehicle.delay).clamp(first, last);
        let k = self.log.time().partition_point(|t| *t <= time) - 1;
        let is_broken = self.breaks.iter().any(|(from, to)| *from < time && time < *to);
        let rest = if is_broken { None } else { self.log.steps(self.log.time()[k], time) };
        let drive = &self.calibration.vehicle.drive;
        rest.unwrap_or_default().iter().fold(readings[k], |pose, step| pose * drive.motion(step.input))
    }
}

//! The next pose and its covariance, predicted before the scan is registered.
//!
//! With odometry: the increment it reports, with standard deviations that grow with distance `d` and turn `a`
//!
//! ```text
//! sigma_xy = q (0.014 m + 0.11 d + 0.04 m/rad a),   sigma_theta = q (0.4 deg + 2 deg/m d + 0.11 a)
//! ```
//!
//! Without: the velocity of the last second goes on, within what a wheeled vehicle can change in the time between two
//! scans and half the largest recent step, because loggers stamp late and in bunches: scans that were taken 0.6 s apart come
//! with stamps 4 ms apart.
//!
//! ```text
//! sigma_xy = q (0.02 m + 0.3 m/s dt + 0.5 largest step),   sigma_theta = q (0.6 deg + 0.4 rad/s dt + 0.5 largest turn)
//! ```
//!
//! In both cases the scale `q` is learned: it follows the innovations of the scans that were registered well, slowly, so that
//! good wheels are trusted and bad ones are not, without a setting for either.

use groma_geometry::Se2;
use groma_registration::Prior;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// Share of a new innovation in the running mean.
const LEARNING: f64 = 0.03;
/// Bounds of the learned variance factor, of odometry and of a going-on velocity. Wheels err the same way again and
/// again: odometry is never trusted beyond its first standard deviations, or it would bend the local maps.
const ODOMETRY_FACTOR: (f64, f64) = (1.0, 15.0);
const VELOCITY_FACTOR: (f64, f64) = (0.25, 4.0);
/// Wheels slip and odometry jumps; a vehicle does not.
const ODOMETRY_DOF: f64 = 4.0;
const VELOCITY_DOF: f64 = 20.0;
/// Innovations beyond this squared multiple count as this much: one jump is no bad odometer.
const MOST_SURPRISE: f64 = 9.0;
/// What a velocity may change within a second [m/s, rad/s], and no more than this between scans [m, rad].
const AGILITY: (f64, f64) = (0.3, 0.4);
const MOST_CHANGE: (f64, f64) = (0.8, 0.7);
/// The velocity is taken over at least this long [s] and this many scans.
const SPAN: (f64, usize) = (0.9, 3);
/// Scans whose steps and turns count as recent.
const LOOK_BACK: usize = 8;
/// Longest time for which a velocity goes on [s].
const GOES_ON: f64 = 4.0;
/// Share of a new error in the running means; errors count up to `MOST_ERROR`, turns at `LEVER` [m].
const COMPARING: f64 = 0.05;
const MOST_ERROR: f64 = 0.3;
const LEVER: f64 = 0.5;
/// Odometry fails from this root-mean-square error [m], if it is this many times that of a going-on velocity.
const FAILING: f64 = 0.05;
const WORSE: f64 = 2.5;
/// Scans remembered at most.
const MEMORY: usize = 32;

/// The motion model with its learned scale.
#[derive(Clone, Debug)]
pub struct MotionModel {
    factor: f64,
    /// Running mean squared errors of odometry and of a going-on velocity [m^2].
    errors: (f64, f64),
    recent: VecDeque<(f64, Se2)>,
}

impl Default for MotionModel {
    fn default() -> Self {
        Self { factor: 1.0, errors: (0.0, 0.0), recent: VecDeque::new() }
    }
}

impl MotionModel {
    /// Remembers a pose.
    pub fn observe(&mut self, stamp: f64, pose: &Se2) {
        self.recent.push_back((stamp, *pose));
        if self.recent.len() > MEMORY {
            self.recent.pop_front();
        }
    }

    /// The largest recent step and turn between two scans [m], [rad].
    fn largest(&self) -> (f64, f64) {
        let recent: Vec<&Se2> = self.recent.iter().rev().take(LOOK_BACK).map(|(_, pose)| pose).collect();
        recent.windows(2).fold((0.05, 0.05), |(d, a), w| {
            let step = w[0].between(w[1]);
            (d.max(step.translation.norm()), a.max(step.theta().abs()))
        })
    }

    /// The mean twist of the last second (body frame, per second).
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        let Some((now, pose)) = self.recent.back() else { return Vector3::zeros() };
        let old = |(k, (stamp, _)): &(usize, &(f64, Se2))| *k >= SPAN.1 && now - stamp >= SPAN.0;
        let from = self.recent.iter().rev().enumerate().find(old).map(|(_, past)| past).or(self.recent.front());
        from.filter(|(stamp, _)| now - stamp > 0.1)
            .map_or_else(Vector3::zeros, |(stamp, past)| pose.minus(past) / (now - stamp))
    }

    /// The expected pose after an odometry increment; `excess` are variances of what odometry did not measure.
    #[must_use]
    pub fn from_odometry(&self, pose: &Se2, increment: &Se2, excess: &Vector3<f64>) -> Prior {
        Prior {
            pose: *pose * *increment,
            information: invert(&(increment_variances(increment) * self.factor + excess)),
            dof: ODOMETRY_DOF,
        }
    }

    /// The expected pose when the velocity goes on for `seconds`.
    #[must_use]
    pub fn from_velocity(&self, pose: &Se2, seconds: f64) -> Prior {
        let largest = self.largest();
        let xy = 0.02 + (AGILITY.0 * seconds).min(MOST_CHANGE.0) + 0.5 * largest.0;
        let turn = 0.01 + (AGILITY.1 * seconds).min(MOST_CHANGE.1) + 0.5 * largest.1;
        let variances = Vector3::new(xy * xy, xy * xy, turn * turn) * self.factor;
        Prior {
            pose: pose.plus(self.velocity() * seconds.min(GOES_ON)),
            information: invert(&variances),
            dof: VELOCITY_DOF,
        }
    }

    /// Compares what odometry and a going-on velocity foretold with a pose that a scan confirmed.
    pub fn compare(&mut self, odometry: &Prior, velocity: &Prior, pose: &Se2) {
        let error_sq = |prior: &Prior| {
            let e = prior.pose.between(pose);
            (e.translation.norm_squared() + (LEVER * e.theta()).powi(2)).min(MOST_ERROR * MOST_ERROR)
        };
        self.errors.0 += COMPARING * (error_sq(odometry) - self.errors.0);
        self.errors.1 += COMPARING * (error_sq(velocity) - self.errors.1);
    }

    /// Whether odometry foretells the poses so badly that a going-on velocity does far better: it is dead or worse.
    #[must_use]
    pub fn odometry_fails(&self) -> bool {
        self.errors.0 > FAILING * FAILING && self.errors.0 > WORSE * WORSE * self.errors.1
    }

    /// Learns from a pose that a scan confirmed.
    pub fn learn(&mut self, prior: &Prior, pose: &Se2, information: &Matrix3<f64>) {
        let Some(spread) = (information + Matrix3::identity() * 1e-3).try_inverse() else { return };
        let Some(expected) = prior.information.try_inverse() else { return };
        let e = pose.minus(&prior.pose);
        // Per unit of the present factor: what the prior explains of the innovation.
        let surprise = (0..3).map(|k| e[k] * e[k] / (expected[(k, k)] + spread[(k, k)])).sum::<f64>() / 3.0;
        let bounds = if prior.dof == VELOCITY_DOF { VELOCITY_FACTOR } else { ODOMETRY_FACTOR };
        let target = self.factor * surprise.min(MOST_SURPRISE);
        self.factor = (self.factor + LEARNING * (target - self.factor)).clamp(bounds.0, bounds.1);
    }

    /// The learned factor of the variances.
    #[must_use]
    pub fn factor(&self) -> f64 {
        self.factor
    }
}

/// Variances `(x, y, theta)` of an odometry increment before scaling.
fn increment_variances(increment: &Se2) -> Vector3<f64> {
    let (d, a) = (increment.translation.norm(), increment.theta().abs());
    let xy = 0.014 + 0.11 * d + 0.04 * a;
    let turn = 0.007 + 0.036 * d + 0.11 * a;
    Vector3::new(xy * xy, xy * xy, turn * turn)
}

fn invert(variances: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&variances.map(|v| 1.0 / v))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_odometry_is_trusted_less_and_good_more() {
        let increment = Se2::new(0.2, 0.0, 0.0);
        let sharp = Matrix3::identity() * 1e6;
        for (error, trusted) in [(0.2, false), (0.002, true)] {
            let mut model = MotionModel::default();
            for _ in 0..300 {
                let prior = model.from_odometry(&Se2::IDENTITY, &increment, &Vector3::zeros());
                model.learn(&prior, &prior.pose.plus(Vector3::new(error, error, error)), &sharp);
            }
            assert_eq!(model.factor() == ODOMETRY_FACTOR.0, trusted, "{}", model.factor());
            assert!(trusted || model.factor() > 3.0);
        }
    }

    #[test]
    fn dead_odometry_is_found_out_and_one_jump_is_not_death() {
        let mut model = MotionModel::default();
        let (mut pose, step) = (Se2::IDENTITY, Se2::new(0.12, 0.0, 0.02));
        for k in 0..200 {
            let dead = k >= 60;
            let increment = if dead { Se2::IDENTITY } else { step };
            let jump = if k == 30 { Se2::new(0.9, 0.0, 1.4) } else { increment };
            let priors = (model.from_odometry(&pose, &jump, &Vector3::zeros()), model.from_velocity(&pose, 0.2));
            pose = pose * step;
            model.observe(0.2 * f64::from(k), &pose);
            model.compare(&priors.0, &priors.1, &pose);
            assert!(dead || k < 10 || k == 30 || !model.odometry_fails() || k < 45, "{k}");
        }
        assert!(model.odometry_fails());
    }

    #[test]
    fn one_jump_changes_little() {
        let mut model = MotionModel::default();
        let prior = model.from_odometry(&Se2::IDENTITY, &Se2::IDENTITY, &Vector3::zeros());
        model.learn(&prior, &Se2::new(5.0, 0.0, 2.0), &(Matrix3::identity() * 1e6));
        assert!(model.factor() < 1.3);
    }
}

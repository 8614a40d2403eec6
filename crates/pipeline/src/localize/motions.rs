//! The motions of the vehicle between any two times, from the readings of its odometry or of its wheels.
//!
//! ```text
//! odometry   T_a^-1 T_b,  noise of OdometryNoise
//! wheels     counts (after) - counts (before), steering (before + after) / 2  ->  Motion::of_wheels
//! a cut      readings are interpolated: poses on the path of constant twist, counts and steering evenly;
//!            what the vehicle did between the readings beside that is not known: `ahead::bridging`
//! ```

use super::ahead::{Twist, bridging};
use groma_geometry::Se2;
use groma_localization::Motion;
use groma_models::{Drive, OdometryNoise, WheelNoise};
use nalgebra::{Matrix3, SMatrix, Vector2};
use std::collections::VecDeque;

/// The twist is taken over this time at least: stamps jitter [s].
const BASELINE: f64 = 0.05;
/// Readings kept, at most.
const MOST: usize = 4096;

/// A motion and when it ends [s].
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub stamp: f64,
    pub motion: Motion,
}

/// What a source of motions says at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Reading {
    /// `T_odom_base`.
    Pose(Se2),
    /// Counts and steering [rad], or counts left and right.
    Wheels(Vector2<f64>),
}

/// What turns readings into motions.
#[derive(Clone, Copy, Debug)]
pub(super) enum Source {
    Odometry(OdometryNoise),
    Wheels(Drive, WheelNoise),
}

/// Readings in order of time.
#[derive(Clone, Debug)]
pub(super) struct Motions {
    source: Source,
    readings: VecDeque<(f64, Reading)>,
}

impl Motions {
    pub fn new(source: Source) -> Self {
        Self { source, readings: VecDeque::new() }
    }

    /// Takes a reading; false if its time does not rise.
    pub fn push(&mut self, stamp: f64, reading: Reading) -> bool {
        let rises = self.last().is_none_or(|last| stamp > last);
        if rises {
            if self.readings.len() == MOST {
                self.readings.pop_front();
            }
            self.readings.push_back((stamp, reading));
        }
        rises
    }

    /// Forgets all readings: the next does not hang together with them.
    pub fn restart(&mut self) {
        self.readings.clear();
    }

    /// Time of the first reading that is kept [s].
    pub fn first(&self) -> Option<f64> {
        self.readings.front().map(|(t, _)| *t)
    }

    /// Time of the last reading [s].
    pub fn last(&self) -> Option<f64> {
        self.readings.back().map(|(t, _)| *t)
    }

    /// Forgets what is not needed for motions and twists from `stamp` on.
    pub fn forget_before(&mut self, stamp: f64) {
        while self.readings.get(1).is_some_and(|(t, _)| *t <= stamp) && self.readings.len() > 2 && self.spans(1) {
            self.readings.pop_front();
        }
    }

    /// Whether the readings from the k-th on span the time of a twist.
    fn spans(&self, k: usize) -> bool {
        self.readings.get(k).zip(self.last()).is_some_and(|((first, _), last)| last - first >= BASELINE)
    }

    /// The motions from one time to another, as far as the readings reach.
    pub fn steps(&self, from: f64, to: f64) -> Vec<Step> {
        let mut steps = Vec::new();
        let after = self.readings.partition_point(|(t, _)| *t <= from).max(1);
        for k in after..self.readings.len() {
            let ((a, _), (b, _)) = (self.readings[k - 1], self.readings[k]);
            if a >= to {
                break;
            }
            steps.push(self.cut(k, from.max(a), to.min(b)));
        }
        steps
    }

    /// The part of the motion to reading k that lies between two times.
    fn cut(&self, k: usize, from: f64, to: f64) -> Step {
        let ((a, before), (b, after)) = (self.readings[k - 1], self.readings[k]);
        let at = |stamp: f64| match stamp {
            s if s == a => before,
            s if s == b => after,
            s => interpolate(&before, &after, (s - a) / (b - a)),
        };
        let mut motion = self.motion(&at(from), &at(to), to - from);
        // An error at the begin of a part is the opposite of that at its end.
        motion.covariance += bridging(to - a, b - to) + bridging(from - a, b - from);
        Step { stamp: to, motion }
    }

    /// Variance of the position that interpolation leaves open at a time between two readings [m^2].
    pub fn open_at(&self, stamp: f64) -> f64 {
        let after = self.readings.partition_point(|(t, _)| *t < stamp).max(1);
        let around = self.readings.get(after - 1).zip(self.readings.get(after));
        around.map_or(0.0, |((a, _), (b, _))| position_variance(&bridging(stamp - a, b - stamp)))
    }

    fn motion(&self, before: &Reading, after: &Reading, duration: f64) -> Motion {
        match (self.source, before, after) {
            (Source::Odometry(noise), Reading::Pose(a), Reading::Pose(b)) => {
                let motion = a.between(b);
                let covariance = Matrix3::from_diagonal(&noise.variances(&motion));
                Motion { motion, covariance, by_drive: SMatrix::zeros() }
            }
            (Source::Wheels(drive, noise), Reading::Wheels(a), Reading::Wheels(b)) => {
                let input = match drive {
                    Drive::Tricycle(_) => Vector2::new(b.x - a.x, (a.y + b.y) / 2.0),
                    Drive::Differential(_) => b - a,
                };
                Motion::of_wheels(&drive, input, duration, &noise)
            }
            _ => Motion { motion: Se2::IDENTITY, covariance: Matrix3::zeros(), by_drive: SMatrix::zeros() },
        }
    }

    /// How the vehicle moved at the last reading; none before the second.
    pub fn twist(&self) -> Option<Twist> {
        let last = self.readings.len().checked_sub(1)?;
        let to = self.last()?;
        let first = (0..last).rev().find(|k| to - self.readings[*k].0 >= BASELINE).or(last.checked_sub(1))?;
        let (from, before) = self.readings[first];
        let time = to - from;
        let motion = self.motion(&before, &self.readings[last].1, time);
        Some(Twist {
            at: to,
            rate: motion.motion.log() / time,
            covariance: motion.covariance / (time * time),
            noise: motion.covariance / time,
            by_drive: motion.by_drive / time,
            by_scans: false,
        })
    }
}

fn interpolate(a: &Reading, b: &Reading, share: f64) -> Reading {
    match (a, b) {
        (Reading::Pose(a), Reading::Pose(b)) => Reading::Pose(a.interpolate(b, share)),
        (Reading::Wheels(a), Reading::Wheels(b)) => Reading::Wheels(a + (b - a) * share),
        _ => *b,
    }
}

/// Variance of a position, both axes together [m^2].
pub(super) fn position_variance(covariance: &Matrix3<f64>) -> f64 {
    covariance.m11 + covariance.m22
}

/// The product of motions and the covariance of its error on the right.
pub(super) fn product<'a>(steps: impl IntoIterator<Item = &'a Motion>) -> Motion {
    let none = Motion { motion: Se2::IDENTITY, covariance: Matrix3::zeros(), by_drive: SMatrix::zeros() };
    steps.into_iter().fold(none, |whole, step| {
        let back = step.motion.inverse().adjoint();
        Motion {
            motion: whole.motion * step.motion,
            covariance: back * whole.covariance * back.transpose() + step.covariance,
            by_drive: back * whole.by_drive + step.by_drive,
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::{Differential, Tricycle};
    use nalgebra::Vector3;

    fn odometry(poses: &[(f64, Se2)]) -> Motions {
        let mut motions = Motions::new(Source::Odometry(OdometryNoise::uncalibrated()));
        poses.iter().for_each(|(t, pose)| assert!(motions.push(*t, Reading::Pose(*pose))));
        motions
    }

    /// An even arc from somewhere in the odometry frame, ten readings a second.
    fn arc() -> (Motions, Vector3<f64>) {
        let (start, rate) = (Se2::new(-3.0, 7.0, 2.9), Vector3::new(0.6, 0.0, -0.4));
        (odometry(&(0..30).map(|k| 0.1 * f64::from(k)).map(|t| (t, start.plus(rate * t))).collect::<Vec<_>>()), rate)
    }

    #[test]
    fn motions_are_those_of_the_body_whatever_the_frame_of_the_odometry() {
        let (motions, rate) = arc();
        for (from, to) in [(0.0, 1.0), (0.33, 0.37), (0.05, 2.63), (1.2, 1.3)] {
            let whole = product(motions.steps(from, to).iter().map(|s| &s.motion));
            assert!((whole.motion.log() - rate * (to - from)).norm() < 1e-9, "{from} {to}");
            assert_eq!(motions.steps(from, to).last().unwrap().stamp, to);
        }
    }

    #[test]
    fn noise_does_not_depend_on_where_a_drive_is_cut() {
        let (motions, _) = arc();
        let of = |steps: Vec<Step>| product(steps.iter().map(|s| &s.motion)).covariance;
        let whole = of(motions.steps(0.0, 2.0));
        let parts = of([motions.steps(0.0, 1.04), motions.steps(1.04, 2.0)].concat());
        assert!((parts - whole).norm() < 0.02 * whole.norm(), "{parts} {whole}");
    }

    #[test]
    fn beyond_the_readings_nothing_is_said() {
        let (motions, _) = arc();
        assert!(motions.steps(motions.last().unwrap(), 4.0).is_empty());
        assert_eq!(motions.steps(2.8, 4.0).last().unwrap().stamp, motions.last().unwrap());
        assert!(motions.steps(-2.0, -1.0).is_empty());
    }

    #[test]
    fn the_twist_is_that_of_the_end_and_jitter_of_a_stamp_hardly_shows() {
        let (motions, rate) = arc();
        assert!((motions.twist().unwrap().rate - rate).norm() < 1e-9);
        let even = |k: i32| Se2::new(0.02 * f64::from(k), 0.0, 0.0);
        let mut jittered: Vec<(f64, Se2)> = (0..20).map(|k| (0.02 * f64::from(k), even(k))).collect();
        jittered[18].0 = jittered[19].0 - 0.004;
        let speed = odometry(&jittered).twist().unwrap().rate.x;
        assert!((speed - 1.0).abs() < 0.1, "{speed}");
        assert!(odometry(&jittered[..1]).twist().is_none());
    }

    #[test]
    fn to_go_on_as_long_as_a_twist_was_seen_doubles_the_covariance() {
        let (motions, _) = arc();
        let last = motions.last().unwrap();
        let seen = product(motions.steps(last - 0.1, last).iter().map(|s| &s.motion)).covariance;
        let ahead = motions.twist().unwrap().motion(last, last + 0.1).covariance;
        for k in 0..3 {
            let share = ahead[(k, k)] / seen[(k, k)];
            assert!((1.95..2.4).contains(&share), "{k}: {share}");
        }
    }

    #[test]
    fn in_the_middle_of_a_pause_nobody_knows_how_far_a_vehicle_has_come() {
        let paused =
            odometry(&[(0.0, Se2::IDENTITY), (0.1, Se2::new(0.05, 0.0, 0.0)), (2.1, Se2::new(1.05, 0.0, 0.0))]);
        let sigma = |from, to| product(paused.steps(from, to).iter().map(|s| &s.motion)).covariance.m11.sqrt();
        assert!(sigma(0.1, 1.1) > 0.1 && sigma(1.1, 2.1) > 0.1, "{} {}", sigma(0.1, 1.1), sigma(1.1, 2.1));
        assert!(sigma(0.1, 2.1) < 0.05, "but at its end");
        assert!(paused.open_at(1.1) > 0.01 && paused.open_at(0.05) < 1e-4 && paused.open_at(2.1) < 1e-12);
    }

    #[test]
    fn errors_of_the_drive_move_what_is_ahead_as_they_moved_what_was_seen() {
        let drive = Drive::Tricycle(Tricycle::from_parameters([0.5, 1.0, 1.0, 0.05, 0.05]));
        let mut motions = Motions::new(Source::Wheels(drive, WheelNoise::default()));
        for k in 0..9 {
            assert!(motions.push(0.1 * f64::from(k), Reading::Wheels(Vector2::new(0.1 * f64::from(k), 0.2))));
        }
        let last = motions.last().unwrap();
        let seen = product(motions.steps(last - 0.1, last).iter().map(|s| &s.motion)).by_drive;
        let ahead = motions.twist().unwrap().motion(last, last + 0.1).by_drive;
        assert!(seen.norm() > 0.05 && (ahead - seen).norm() < 0.02 * seen.norm(), "{ahead} {seen}");
    }

    #[test]
    fn forgetting_changes_nothing_from_then_on() {
        let (mut motions, _) = arc();
        let before = (product(motions.steps(2.55, 2.9).iter().map(|s| &s.motion)), motions.twist().unwrap());
        motions.forget_before(2.55);
        let after = (product(motions.steps(2.55, 2.9).iter().map(|s| &s.motion)), motions.twist().unwrap());
        assert_eq!(before.0.motion, after.0.motion);
        assert_eq!(before.1.rate, after.1.rate);
        assert!(motions.readings.len() < 6);
    }

    fn wheels(drive: Drive, rows: &[[f64; 3]]) -> Motion {
        let mut motions = Motions::new(Source::Wheels(drive, WheelNoise::default()));
        rows.iter().for_each(|[t, a, b]| assert!(motions.push(*t, Reading::Wheels(Vector2::new(*a, *b)))));
        product(motions.steps(rows[0][0], rows[rows.len() - 1][0]).iter().map(|s| &s.motion))
    }

    #[test]
    fn a_right_wheel_that_gains_turns_to_the_left() {
        let drive = Drive::Differential(Differential { left: 0.1, right: 0.1, axle: 0.5 });
        let motion = wheels(drive, &[[0.0, 7.0, 3.0], [0.1, 7.5, 3.5], [0.2, 8.0, 4.5]]).motion;
        assert!((motion.theta() - 0.1 * 0.5 / 0.5).abs() < 1e-12 && motion.x() > 0.12 && motion.y() > 0.0);
    }

    #[test]
    fn steering_counts_from_its_offset_and_in_the_middle_of_a_step() {
        let drive = |offset: f64| Drive::Tricycle(Tricycle::from_parameters([0.5, 1.0, 1.0, offset, offset]));
        let straight = wheels(drive(-0.2), &[[0.0, 0.0, 0.2], [0.1, 1.0, 0.2]]).motion;
        assert!(straight.theta().abs() < 1e-12 && (straight.x() - 0.5).abs() < 1e-12);
        let turning = wheels(drive(0.0), &[[0.0, 0.0, 0.1], [0.1, 1.0, 0.3]]).motion;
        assert!((turning.theta() - 0.5 * 0.2_f64.sin()).abs() < 1e-9, "a left turn of the mean angle, in radians");
    }
}

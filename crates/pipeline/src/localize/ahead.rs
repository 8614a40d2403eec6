//! The vehicle beyond its last motion: it goes on with the last twist, and the covariance says how far it may not.
//!
//! ```text
//! motion       exp(v dt),  v the twist at time t0, the mean no farther than `REACH` from t0
//! covariance   N (b - a) + C (b|b| - a|a|) + diag(accelerate / 2)^2 (b^3|b| - a^3|a|),   a, b = begin and end since t0
//! ```
//!
//! N is what the noise of the readings adds in a second: an extrapolation is not better known than the readings that will
//! cover it. C is the covariance of the twist. The last term is a vehicle that accelerates by an unknown constant of the standard
//! deviation `ACCELERATION`: the error after a time b is (accelerate / 2) b^2. Both are the increase of a variance, so that
//! steps add up to one. Between two readings with b to go the same reasoning gives an error of (accelerate / 2) a b at the
//! time a ([`bridging`]): none at either reading.
//!
//! The twist is that of the last readings of the motions. Where they fail for long it is that between the last two scans
//! that constrained the pose, once that is the better known of both.

use groma_geometry::Se2;
use groma_localization::{DRIVE, Motion};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Standard deviation of an acceleration that nobody reported: along, across [m/s^2], turn [rad/s^2]. Trucks and indoor
/// robots accelerate by less than a metre per second squared; small ones turn fast.
const ACCELERATION: [f64; 3] = [0.5, 0.1, 1.0];
/// So long the vehicle is taken to go on; then it is as likely to stand [s].
const REACH: f64 = 1.0;
/// Standard deviation of the twist of a vehicle of which nothing is known yet: along, across [m/s], turn [rad/s].
const UNKNOWN: [f64; 3] = [0.5, 0.05, 0.5];

/// How a vehicle moves at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Twist {
    /// [s].
    pub at: f64,
    /// Of the body [m/s, m/s, rad/s].
    pub rate: Vector3<f64>,
    /// Its covariance.
    pub covariance: Matrix3<f64>,
    /// Covariance that the noise of the readings adds to a motion in a second.
    pub noise: Matrix3<f64>,
    /// The rate by the parameters of the drive.
    pub by_drive: SMatrix<f64, 3, DRIVE>,
    /// Whether scans tell it, and not the readings of the motions.
    pub by_scans: bool,
}

impl Twist {
    /// Of a vehicle that stands, as far as anybody knows.
    pub fn unknown(at: f64) -> Self {
        let covariance = Matrix3::from_diagonal(&Vector3::from(UNKNOWN).map(|s| s * s));
        let noise = Matrix3::zeros();
        Self { at, rate: Vector3::zeros(), covariance, noise, by_drive: SMatrix::zeros(), by_scans: false }
    }

    /// Between two poses that were held independently.
    pub fn between(from: (f64, &Se2, &Matrix3<f64>), to: (f64, &Se2, &Matrix3<f64>)) -> Option<Self> {
        let time = to.0 - from.0;
        let rate = to.1.minus(from.1) / time;
        let covariance = (from.2 + to.2) / (time * time);
        let noise = Matrix3::zeros();
        (time > 0.0).then(|| Self { at: to.0, rate, covariance, noise, by_drive: SMatrix::zeros(), by_scans: true })
    }

    /// Standard deviation of the speed at a time [m/s].
    pub fn sigma(&self, stamp: f64) -> f64 {
        (self.covariance.m11 + (ACCELERATION[0] * (stamp - self.at)).powi(2)).sqrt()
    }

    /// The motion from one time to another.
    pub fn motion(&self, from: f64, to: f64) -> Motion {
        let (a, b) = (from - self.at, to - self.at);
        let time = b.clamp(-REACH, REACH) - a.clamp(-REACH, REACH);
        let known = self.noise * (b - a) + self.covariance * (b * b.abs() - a * a.abs());
        let covariance = known + half_square() * (b.powi(3) * b.abs() - a.powi(3) * a.abs());
        Motion { motion: Se2::exp(self.rate * time), covariance, by_drive: self.by_drive * time }
    }
}

/// What is not known of a motion that was cut at the time `a` after one reading and `b` before the next.
pub(super) fn bridging(a: f64, b: f64) -> Matrix3<f64> {
    half_square() * (a * b).powi(2)
}

fn half_square() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::from(ACCELERATION).map(|s| (s / 2.0).powi(2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn twist(speed: f64, turn: f64) -> Twist {
        Twist { rate: Vector3::new(speed, 0.0, turn), covariance: Matrix3::identity() * 1e-4, ..Twist::unknown(2.0) }
    }

    #[test]
    fn a_vehicle_goes_on_as_it_did() {
        let motion = twist(0.8, 0.3).motion(2.0, 2.5).motion;
        assert!((motion.log() - Vector3::new(0.4, 0.0, 0.15)).norm() < 1e-12);
        let still = Twist::unknown(2.0).motion(2.0, 3.0);
        assert!(still.motion.log().norm() < 1e-15 && still.covariance.m11 > 0.0);
    }

    #[test]
    fn steps_add_up_to_one_and_the_covariance_grows_with_time() {
        let twist = twist(0.5, 0.0);
        let (whole, first, second) = (twist.motion(2.0, 2.8), twist.motion(2.0, 2.3), twist.motion(2.3, 2.8));
        assert!(((first.motion * second.motion).log() - whole.motion.log()).norm() < 1e-12);
        assert!((first.covariance + second.covariance - whole.covariance).norm() < 1e-12);
        let sigma = |time: f64| twist.motion(2.0, 2.0 + time).covariance.m11.sqrt();
        assert!(sigma(0.02) < 1e-3 && sigma(1.0) > 0.1 && sigma(10.0) > 10.0);
        assert_eq!(sigma(0.0), 0.0);
    }

    #[test]
    fn before_its_twist_a_vehicle_came_as_it_went_on() {
        let twist = twist(0.5, 0.2);
        let (before, after) = (twist.motion(1.7, 2.0), twist.motion(2.0, 2.3));
        assert!((before.motion.log() - after.motion.log()).norm() < 1e-12);
        assert!((before.covariance - after.covariance).norm() < 1e-12);
        let across = twist.motion(1.9, 2.2).covariance;
        assert!((across - twist.motion(1.9, 2.0).covariance - twist.motion(2.0, 2.2).covariance).norm() < 1e-12);
    }

    #[test]
    fn nobody_drives_on_for_ever() {
        let motion = twist(1.0, 0.0).motion(2.0, 500.0).motion;
        assert!(motion.x() < 2.0, "{}", motion.x());
    }

    #[test]
    fn readings_on_both_sides_leave_less_open_than_one() {
        let by_one = twist(0.0, 0.0).motion(2.0, 2.1).covariance.m11;
        assert!(bridging(0.1, 0.1).m11 < by_one);
        assert_eq!((bridging(0.0, 0.5), bridging(0.5, 0.0)), (Matrix3::zeros(), Matrix3::zeros()));
        assert!(bridging(5.0, 5.0).m11.sqrt() > 1.0, "in the middle of ten seconds");
    }
}

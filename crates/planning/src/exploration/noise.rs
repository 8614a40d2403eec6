//! What driving and looking add to the covariance of the planar filter.
//!
//! Errors are in the world frame, `T = Exp(xi) T^`, `xi = (x, y, theta)`, so that driving is `xi' = xi + Ad(T) w` and a
//! camera seen from the robot is `y = xi_robot - xi_camera + Ad(T) v`: neither depends on anything but where the robot
//! is. Along a straight line from `p` in the direction `d`, the heading of the robot that of `d`, with
//! `g(u) = (y, -x)` at `p + u d` and `q = diag(along^2, across^2)` a metre,
//!
//! ```text
//! Q = int_0^s [[R q R' + heading^2 g g', heading^2 g], [., heading^2]] du
//! ```
//!
//! in closed form; a turn on the spot by `a` adds `turn^2 |a| (g, 1)(g, 1)'`. Source: D. Meger's thesis as read by
//! Rekleitis, Meger, Dudek (2006); world-frame errors: Barrau, Bonnabel, "The invariant extended Kalman filter as a
//! stable observer", IEEE TAC 2017. Assumes white noise, and a robot that turns on the spot at bends.

use crate::error::Error;
use groma_geometry::wrap;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Standard deviations of which the squares are still numbers to calculate with [m], [rad].
const SMALLEST: f64 = 1e-9;
const LARGEST: f64 = 1e3;

/// Standard deviations of driving and of a look at a camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Noise {
    /// Along the path after one metre [m].
    pub along: f64,
    /// Across the path after one metre [m].
    pub across: f64,
    /// Heading after one metre [rad].
    pub heading: f64,
    /// Heading after a turn by one radian [rad].
    pub turn: f64,
    /// Position of a camera seen from the robot, per axis, after one visit [m].
    pub position: f64,
    /// Heading of a camera seen from the robot after one visit [rad].
    pub bearing: f64,
}

impl Default for Noise {
    fn default() -> Self {
        Self {
            along: 0.02,
            across: 0.01,
            heading: 0.5_f64.to_radians(),
            turn: 1.0_f64.to_radians() / std::f64::consts::FRAC_PI_2.sqrt(),
            position: 0.005,
            bearing: 0.3_f64.to_radians(),
        }
    }
}

impl Noise {
    /// Refuses what is not a standard deviation; heading, position and bearing must not be 0, else nothing is learned.
    pub fn validate(&self) -> Result<(), Error> {
        for (name, value) in [("heading", self.heading), ("position", self.position), ("bearing", self.bearing)] {
            Error::unless((SMALLEST..=LARGEST).contains(&value), name, value, "must be from 1e-9 to 1000")?;
        }
        for (name, value) in [("along", self.along), ("across", self.across), ("turn", self.turn)] {
            Error::unless((0.0..=LARGEST).contains(&value), name, value, "must be from 0 to 1000")?;
        }
        Ok(())
    }

    /// Covariance that a straight line adds.
    #[must_use]
    pub fn straight(&self, from: Vector2<f64>, to: Vector2<f64>) -> Matrix3<f64> {
        let length = (to - from).norm();
        if length == 0.0 {
            return Matrix3::zeros();
        }
        let d = (to - from) / length;
        let across = Vector2::new(-d.y, d.x);
        let slip =
            (d * d.transpose() * self.along.powi(2) + across * across.transpose() * self.across.powi(2)) * length;
        let (g, slope) = (lever(from), lever(d));
        let (s1, s2, s3) = (length, length.powi(2) / 2.0, length.powi(3) / 3.0);
        let cross = g * slope.transpose();
        let square = g * g.transpose() * s1 + (cross + cross.transpose()) * s2 + slope * slope.transpose() * s3;
        let heading_sq = self.heading.powi(2);
        assemble(&(slip + square * heading_sq), (g * s1 + slope * s2) * heading_sq, heading_sq * s1)
    }

    /// Covariance that a turn on the spot adds.
    #[must_use]
    pub fn turning(&self, at: Vector2<f64>, angle: f64) -> Matrix3<f64> {
        let heading = Vector3::new(lever(at).x, lever(at).y, 1.0);
        heading * heading.transpose() * (self.turn.powi(2) * wrap(angle).abs())
    }

    /// Covariance of one look at a camera from below it, in the world frame.
    #[must_use]
    pub fn look(&self, at: Vector2<f64>) -> Matrix3<f64> {
        let (g, heading_sq) = (lever(at), self.bearing.powi(2));
        let square = Matrix2::identity() * self.position.powi(2) + g * g.transpose() * heading_sq;
        assemble(&square, g * heading_sq, heading_sq)
    }
}

/// How an error of heading moves the world's origin as seen from `p`: the last column of `Ad`.
fn lever(p: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(p.y, -p.x)
}

fn assemble(position: &Matrix2<f64>, cross: Vector2<f64>, heading: f64) -> Matrix3<f64> {
    let mut covariance = Matrix3::zeros();
    covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(position);
    covariance.fixed_view_mut::<2, 1>(0, 2).copy_from(&cross);
    covariance.fixed_view_mut::<1, 2>(2, 0).copy_from(&cross.transpose());
    covariance[(2, 2)] = heading;
    covariance
}

/// Trace of the position part, at `p`, of a covariance of world-frame errors.
#[must_use]
pub fn position_trace(covariance: &Matrix3<f64>, p: Vector2<f64>) -> f64 {
    position_covariance(covariance, p).trace()
}

/// Covariance of the position of what stands at `p`: `dp = (xi_x, xi_y) + xi_theta (-p_y, p_x)`.
#[must_use]
pub fn position_covariance(covariance: &Matrix3<f64>, p: Vector2<f64>) -> Matrix2<f64> {
    let turned = -lever(p);
    let cross: Vector2<f64> = covariance.fixed_view::<2, 1>(0, 2).into_owned();
    let mixed = cross * turned.transpose();
    covariance.fixed_view::<2, 2>(0, 0).into_owned()
        + mixed
        + mixed.transpose()
        + turned * turned.transpose() * covariance[(2, 2)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;

    #[test]
    fn the_closed_form_is_the_limit_of_small_steps() {
        let noise = Noise::default();
        let (from, to): (Vector2<f64>, Vector2<f64>) = (Vector2::new(3.0, -2.0), Vector2::new(-4.0, 5.0));
        let (steps, heading) = (20_000, (to - from).y.atan2((to - from).x));
        let step = (to - from).norm() / f64::from(steps);
        let q = Matrix3::from_diagonal(&Vector3::new(noise.along, noise.across, noise.heading).map(|s| s * s * step));
        let sum = (0..steps).fold(Matrix3::zeros(), |sum, i| {
            let p = from + (to - from) * ((f64::from(i) + 0.5) / f64::from(steps));
            let adjoint = Se2::new(p.x, p.y, heading).adjoint();
            sum + adjoint * q * adjoint.transpose()
        });
        assert!((sum - noise.straight(from, to)).amax() < 1e-9);
    }

    #[test]
    fn a_view_is_the_adjoint_of_its_noise_whatever_the_heading() {
        let (noise, at) = (Noise::default(), Vector2::new(7.0, -1.0));
        let v = Matrix3::from_diagonal(&Vector3::new(noise.position, noise.position, noise.bearing).map(|s| s * s));
        for heading in [-2.0, 0.0, 1.3] {
            let adjoint = Se2::new(at.x, at.y, heading).adjoint();
            assert!((adjoint * v * adjoint.transpose() - noise.look(at)).amax() < 1e-15);
        }
    }

    #[test]
    fn a_turn_leaves_the_position_where_it_is() {
        let at = Vector2::new(7.0, -1.0);
        assert!(position_trace(&Noise::default().turning(at, 1.0), at) < 1e-15);
    }

    #[test]
    fn a_straight_drive_of_72_metres_has_the_error_of_the_textbook() {
        let noise = Noise { along: 0.0, across: 0.0, ..Noise::default() };
        let end = Vector2::new(72.0, 0.0);
        let variance = position_trace(&noise.straight(Vector2::zeros(), end), end);
        approx(variance, noise.heading.powi(2) * 72.0_f64.powi(3) / 3.0);
    }

    fn approx(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-9 * b.abs(), "{a} {b}");
    }
}

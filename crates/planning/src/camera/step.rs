//! How a robot that turns on the spot drives from one pose to the next: a turn, a straight line, a turn.
//!
//! The line is driven forwards or backwards, whichever turns less. What the wheels drive is its *effort*, `length + 0.3 m
//! |turns|` with half a track of 0.6 m. What odometry loses on it is the covariance `Q` of the exploration
//! (`exploration/noise.rs`), errors in the world frame with the foot of the camera as its origin; the trace of its
//! position is by how much that drive makes the place of the camera in the map less certain [m^2].

use crate::exploration::Noise;
use crate::exploration::noise::position_trace;
use groma_geometry::{Se2, wrap};
use nalgebra::{Matrix3, Vector2};
use std::f64::consts::PI;

/// Spacing of looks on the way [m], [rad].
pub(super) const STRIDE: (f64, f64) = (0.25, 0.35);
/// Half a track [m].
const HALF_TRACK: f64 = 0.3;

/// From one pose to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Step {
    /// Where it begins.
    pub from: Se2,
    /// Where it ends.
    pub to: Se2,
    /// Heading on the line [rad].
    along: f64,
    /// Of the line [m].
    pub length: f64,
}

impl Step {
    pub(super) fn new(from: Se2, to: Se2) -> Self {
        let d = to.translation - from.translation;
        let length = d.norm();
        if length < 1e-9 {
            return Self { from, to, along: to.theta(), length: 0.0 };
        }
        let turns = |along: f64| wrap(along - from.theta()).abs() + wrap(to.theta() - along).abs();
        let (ahead, back) = (d.y.atan2(d.x), wrap(d.y.atan2(d.x) + PI));
        // Backwards must be shorter by more than rounding.
        let along = if turns(back) < turns(ahead) - 1e-9 { back } else { ahead };
        Self { from, to, along, length }
    }

    fn turns(&self) -> [f64; 2] {
        [wrap(self.along - self.from.theta()), wrap(self.to.theta() - self.along)]
    }

    /// Angle turned, to either side [rad].
    pub(super) fn turned(&self) -> f64 {
        self.turns().iter().map(|a| a.abs()).sum()
    }

    /// What the wheels drive [m].
    pub(super) fn effort(&self) -> f64 {
        self.length + HALF_TRACK * self.turned()
    }

    /// Covariance that odometry adds, errors in the world frame about the origin.
    fn covariance(&self, noise: &Noise) -> Matrix3<f64> {
        let (a, b) = (self.from.translation, self.to.translation);
        let [first, last] = self.turns();
        noise.turning(a, first) + noise.straight(a, b) + noise.turning(b, last)
    }

    /// Poses on the way, one a stride [m, rad] at most, without that where it begins.
    pub(super) fn stops(&self, (metres, radians): (f64, f64)) -> Vec<Se2> {
        let [first, last] = self.turns();
        let mut stops = turning(self.from.translation, self.from.theta(), first, radians);
        let count = (self.length / metres).ceil() as usize;
        stops.extend((1..=count).map(|i| {
            let share = i as f64 / count as f64;
            let p = self.from.translation + (self.to.translation - self.from.translation) * share;
            Se2::new(p.x, p.y, self.along)
        }));
        stops.extend(turning(self.to.translation, self.along, last, radians));
        stops
    }
}

/// Variance of the camera's place that odometry adds along stops [m^2].
pub(super) fn variance(noise: &Noise, stops: &[Se2]) -> f64 {
    let sum: Matrix3<f64> = stops.windows(2).map(|pair| Step::new(pair[0], pair[1]).covariance(noise)).sum();
    position_trace(&sum, Vector2::zeros())
}

fn turning(at: Vector2<f64>, heading: f64, turn: f64, stride: f64) -> Vec<Se2> {
    let count = (turn.abs() / stride - 1e-9).ceil().max(0.0) as usize;
    (1..=count).map(|i| Se2::new(at.x, at.y, heading + turn * i as f64 / count as f64)).collect()
}

/// How far a heading is from that of a line, driven either way [rad].
#[cfg(test)]
fn off_line(heading: f64, line: f64) -> f64 {
    let off = wrap(heading - line).abs();
    off.min((PI - off).abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_driven_backwards_where_that_turns_less() {
        let step = Step::new(Se2::new(2.0, 0.0, PI), Se2::new(4.0, 0.0, PI));
        assert_eq!((step.turned(), step.effort()), (0.0, 2.0));
        let step = Step::new(Se2::new(2.0, 0.0, 0.5), Se2::new(4.0, 0.0, -0.5));
        assert!((step.turned() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn stops_lie_on_the_way_and_end_where_it_ends() {
        let to = Se2::new(1.0, 2.0, -2.0);
        let stops = Step::new(Se2::new(3.0, -1.0, 1.0), to).stops((0.25, 0.35));
        assert!(stops[stops.len() - 1].minus(&to).norm() < 1e-12);
        let strides = stops.windows(2).map(|p| (p[1].translation - p[0].translation).norm());
        assert!(strides.fold(0.0, f64::max) <= 0.25 + 1e-9);
        let line = 3.0_f64.atan2(-2.0);
        let moving = stops.windows(2).filter(|p| (p[1].translation - p[0].translation).norm() > 1e-9);
        assert!(moving.map(|p| off_line(p[1].theta(), line)).fold(0.0, f64::max) < 1e-9);
    }

    #[test]
    fn a_turn_makes_the_camera_uncertain_by_its_lever_and_cuts_do_not_matter() {
        let noise = Noise::default();
        let turn = [Se2::new(3.0, 0.0, 0.0), Se2::new(3.0, 0.0, 1.0)];
        assert!((variance(&noise, &turn) - (3.0 * noise.turn).powi(2)).abs() < 1e-15);
        let whole = [Se2::new(3.0, -1.0, 1.0), Se2::new(1.0, 2.0, -2.0)];
        let mut cut = vec![whole[0]];
        cut.extend(Step::new(whole[0], whole[1]).stops((0.1, 0.1)));
        assert!((variance(&noise, &whole) - variance(&noise, &cut)).abs() < 1e-12);
    }
}

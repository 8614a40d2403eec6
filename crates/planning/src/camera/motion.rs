//! Common trajectories before a camera.
//!
//! All are drives of a robot that turns on the spot and drives straight; the camera takes a view at every stop.
//!
//! | | shows | drive |
//! |---|---|---|
//! | stationary | the panel ahead | stands still |
//! | one-panel translation | the panel ahead, turned to the left side | straight across the view |
//! | three-panel translation | all, turned to the left side | the same |
//! | rotation | all | turns on the spot |
//! | square | all | around a square |
//! | star | all | out and back through one point, in six directions |
//!
//! Source: D. Meger's thesis, chapter 4. It leaves the sizes open: they were chosen such that the drives tell about what
//! was found for them (BENCHMARKS.md, driving before one camera).

use super::knowledge::Knowledge;
use super::stage::{Stage, outwards};
use super::step::{Step, variance};
use crate::exploration::Noise;
use groma_geometry::Se2;
use groma_models::{Panel, Target};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// How far to either side a drive across the view goes [m].
const ACROSS: f64 = 1.3;
/// Half the side of the square [m].
const HALF_SIDE: f64 = 0.6;
/// Length of a ray of the star [m].
const RAY: f64 = 1.2;
/// Rays of the star.
const RAYS: usize = 6;

/// A common trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// Stands still.
    Stationary,
    /// One panel across the view.
    OnePanel,
    /// Three panels across the view.
    ThreePanels,
    /// Turns on the spot.
    Rotation,
    /// Around a square.
    Square,
    /// Out and back through one point.
    Star,
}

/// Stops, one view each.
#[derive(Clone, Debug, PartialEq)]
pub struct Drive {
    /// Poses of the robot.
    pub stops: Vec<Se2>,
}

impl Motion {
    /// All.
    pub const ALL: [Self; 6] =
        [Self::Stationary, Self::OnePanel, Self::ThreePanels, Self::Rotation, Self::Square, Self::Star];

    /// Stops with which three panels, 45 degrees apart, are seen about 40 times; the star, which drives most, 27 times.
    #[must_use]
    pub fn stops(self) -> usize {
        match self {
            Self::ThreePanels => 20,
            Self::Star => 22,
            _ => 40,
        }
    }

    /// The panels of a target as it shows them: all, or the one that looks ahead most; on the left side of the robot
    /// when it drives across the view.
    #[must_use]
    pub fn shown(self, target: &Target) -> Target {
        let ahead = |panel: &&Panel| (panel.t_robot_panel().rotation.matrix() * outwards(panel)).x;
        let first = || target.panels.iter().rev().max_by(|a, b| ahead(a).total_cmp(&ahead(b)));
        match self {
            Self::Stationary => Target { panels: first().cloned().into_iter().collect() },
            Self::OnePanel => Target { panels: first().map(on_the_left).into_iter().collect() },
            Self::ThreePanels => Target { panels: target.panels.iter().map(on_the_left).collect() },
            _ => target.clone(),
        }
    }

    /// The drive, its middle at a distance before the camera [m], with about so many stops.
    #[must_use]
    pub fn drive(self, distance: f64, stops: usize) -> Drive {
        let middle = Vector2::new(distance, 0.0);
        let facing = |p: Vector2<f64>| Se2::new(p.x, p.y, PI);
        let share = |i: usize| i as f64 / (stops.max(2) - 1) as f64;
        let across = |i: usize| Se2::new(middle.x, ACROSS * (2.0 * share(i) - 1.0), FRAC_PI_2);
        let stops = match self {
            Self::Stationary => vec![facing(middle); stops],
            Self::OnePanel | Self::ThreePanels => (0..stops).map(across).collect(),
            Self::Rotation => {
                (0..stops).map(|i| Se2::new(middle.x, middle.y, PI + TAU * i as f64 / stops as f64)).collect()
            }
            Self::Square => around(&square(middle), stops),
            Self::Star => around(&star(middle), stops),
        };
        Drive { stops }
    }
}

impl Drive {
    /// Distance [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.steps().map(|step| step.length).fold(0.0, |sum, length| sum + length)
    }

    /// Angle turned, to either side [rad].
    #[must_use]
    pub fn turned(&self) -> f64 {
        self.steps().map(|step| step.turned()).fold(0.0, |sum, angle| sum + angle)
    }

    /// How far the wheels drive: distance and turns [m].
    #[must_use]
    pub fn effort(&self) -> f64 {
        self.steps().map(|step| step.effort()).fold(0.0, |sum, effort| sum + effort)
    }

    /// By how much odometry makes the place of the camera less certain on it [m^2].
    #[must_use]
    pub fn variance(&self, noise: &Noise) -> f64 {
        variance(noise, &self.stops)
    }

    /// What the views at its stops tell.
    #[must_use]
    pub fn knowledge(&self, stage: &Stage) -> Knowledge {
        let mut knowledge = Knowledge::new(&stage.camera);
        self.stops.iter().for_each(|stop| knowledge.look(stage, &stage.views(stop)));
        knowledge
    }

    fn steps(&self) -> impl Iterator<Item = Step> {
        self.stops.windows(2).map(|pair| Step::new(pair[0], pair[1]))
    }
}

/// A panel turned about the middle of the robot.
fn on_the_left(panel: &Panel) -> Panel {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
    let place = panel.t_robot_panel();
    let q = (turn * place.rotation.quaternion).into_inner();
    Panel { position: (turn * place.translation).into(), quaternion: [q.i, q.j, q.k, q.w], ..panel.clone() }
}

fn square(middle: Vector2<f64>) -> Vec<Vector2<f64>> {
    let corner = |x: f64, y: f64| middle + Vector2::new(x, y) * HALF_SIDE;
    vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)]
}

fn star(middle: Vector2<f64>) -> Vec<Vector2<f64>> {
    let direction = |k: usize| TAU * k as f64 / RAYS as f64;
    let tip = |k: usize| middle + Vector2::new(direction(k).cos(), direction(k).sin()) * RAY;
    (0..RAYS).flat_map(|k| [middle, tip(k)]).chain([middle]).collect()
}

/// Stops evenly along a line of points, heading along it.
fn around(points: &[Vector2<f64>], stops: usize) -> Vec<Se2> {
    let total: f64 = points.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum();
    (0..stops).filter_map(|i| after(points, total * (i as f64 + 0.5) / stops as f64)).collect()
}

/// The pose after some way.
fn after(points: &[Vector2<f64>], mut left: f64) -> Option<Se2> {
    points.windows(2).find_map(|pair| {
        let d = pair[1] - pair[0];
        let whole = d.norm();
        let here = (left <= whole && whole > 0.0).then(|| pair[0] + d * (left / whole));
        left -= whole;
        here.map(|p| Se2::new(p.x, p.y, d.y.atan2(d.x)))
    })
}

#[cfg(test)]
mod tests {
    use super::super::stage::upright_panels;
    use super::*;

    #[test]
    fn one_panel_is_the_one_that_looks_ahead_and_looks_left_across_the_view() {
        let target = upright_panels(&[PI, FRAC_PI_2, 0.0]);
        assert_eq!(Motion::Stationary.shown(&target).panels, target.panels[2..]);
        assert_eq!(Motion::Square.shown(&target), target);
        let place = Motion::OnePanel.shown(&target).panels[0].t_robot_panel();
        let left = target.panels[1].t_robot_panel();
        assert!((place.translation - left.translation).norm() < 1e-12);
        assert!(place.rotation.quaternion.angle_to(&left.rotation.quaternion) < 1e-7);
    }

    #[test]
    fn drives_have_as_many_stops_as_requested_and_the_length_of_their_lines() {
        for motion in Motion::ALL {
            assert_eq!(motion.drive(2.6, 400).stops.len(), 400, "{motion:?}");
        }
        let length = |motion: Motion| motion.drive(2.6, 400).length();
        assert_eq!((length(Motion::Stationary), length(Motion::Rotation)), (0.0, 0.0));
        assert!((length(Motion::ThreePanels) - 2.0 * ACROSS).abs() < 1e-9);
        assert_eq!(Motion::ThreePanels.drive(2.6, 20).turned(), 0.0);
        // Half a spacing is missing at either end, and stops cut corners.
        assert!((length(Motion::Square) - 8.0 * HALF_SIDE).abs() < 0.05);
        assert!((length(Motion::Star) - 2.0 * RAYS as f64 * RAY).abs() < 0.3);
    }
}

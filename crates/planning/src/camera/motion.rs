//! The drives before a camera that people use.
//!
//! All are drives of a robot that turns on the spot and drives straight; the camera takes a view at every stop.
//!
//! | | panels | drive |
//! |---|---|---|
//! | stationary | one | stands still |
//! | one-panel translation | one | across the view, facing the camera |
//! | three-panel translation | three, 45 degrees apart | the same |
//! | rotation | four around | turns on the spot |
//! | square | four around | around a square |
//! | star | four around | out and back through one point, in three directions |
//!
//! Source: D. Meger's thesis, chapter 4.

use super::knowledge::Knowledge;
use super::stage::Stage;
use groma_geometry::{Se2, wrap};
use nalgebra::Vector2;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// How far a turn by one radian drives a wheel, half a track of 0.6 m [m].
const TURNED: f64 = 0.3;
/// Half the width of the drives [m].
const HALF: f64 = 0.7;

/// A drive that people use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

    /// The yaws of the panels that it needs [rad].
    #[must_use]
    pub fn yaws(self) -> &'static [f64] {
        match self {
            Self::Stationary | Self::OnePanel => &[0.0],
            Self::ThreePanels => &[-FRAC_PI_4, 0.0, FRAC_PI_4],
            _ => &[0.0, FRAC_PI_2, PI, -FRAC_PI_2],
        }
    }

    /// The drive, its middle at a distance before the camera [m], with about so many stops.
    #[must_use]
    pub fn drive(self, distance: f64, stops: usize) -> Drive {
        let middle = Vector2::new(distance, 0.0);
        let facing = |p: Vector2<f64>| Se2::new(p.x, p.y, PI);
        let share = |i: usize| i as f64 / (stops.max(2) - 1) as f64;
        let across = |i: usize| facing(middle + Vector2::new(0.0, HALF * (2.0 * share(i) - 1.0)));
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
    /// How far the wheels drive: distance and turns [m].
    #[must_use]
    pub fn length(&self) -> f64 {
        self.stops.windows(2).map(|pair| effort(&pair[0], &pair[1])).sum()
    }

    /// What the views at its stops tell.
    #[must_use]
    pub fn knowledge(&self, stage: &Stage) -> Knowledge {
        let mut knowledge = Knowledge::new(&stage.camera);
        self.stops.iter().for_each(|stop| knowledge.look(stage, &stage.views(stop)));
        knowledge
    }
}

/// How far the wheels drive from one pose to the next: turn, straight line, turn [m].
pub(super) fn effort(from: &Se2, to: &Se2) -> f64 {
    let d = to.translation - from.translation;
    if d.norm() < 1e-9 {
        return TURNED * wrap(to.theta() - from.theta()).abs();
    }
    // Forwards or backwards, whichever turns less.
    let turns = |along: f64| wrap(along - from.theta()).abs() + wrap(to.theta() - along).abs();
    let along = d.y.atan2(d.x);
    d.norm() + TURNED * turns(along).min(turns(along + PI))
}

fn square(middle: Vector2<f64>) -> Vec<Vector2<f64>> {
    let corner = |x: f64, y: f64| middle + Vector2::new(x, y) * HALF;
    vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)]
}

fn star(middle: Vector2<f64>) -> Vec<Vector2<f64>> {
    let tip = |k: usize| middle + Vector2::new((k as f64 * PI / 3.0).cos(), (k as f64 * PI / 3.0).sin()) * HALF;
    (0..6).flat_map(|k| [middle, tip(k)]).chain([middle]).collect()
}

/// Stops evenly along what the wheels drive around a line of points, turning on the spot at each.
fn around(points: &[Vector2<f64>], stops: usize) -> Vec<Se2> {
    let mut poses: Vec<Se2> = vec![];
    for pair in points.windows(2) {
        let d = pair[1] - pair[0];
        let heading = d.y.atan2(d.x);
        poses.push(Se2::new(pair[0].x, pair[0].y, heading));
        poses.push(Se2::new(pair[1].x, pair[1].y, heading));
    }
    let total: f64 = poses.windows(2).map(|pair| effort(&pair[0], &pair[1])).sum();
    (0..stops).filter_map(|i| after(&poses, total * (i as f64 + 0.5) / stops as f64)).collect()
}

/// The pose after some effort.
fn after(poses: &[Se2], mut left: f64) -> Option<Se2> {
    poses.windows(2).find_map(|pair| {
        let whole = effort(&pair[0], &pair[1]);
        let here = (left <= whole && whole > 0.0).then(|| between(&pair[0], &pair[1], left / whole));
        left -= whole;
        here
    })
}

fn between(from: &Se2, to: &Se2, share: f64) -> Se2 {
    let at = from.translation + (to.translation - from.translation) * share;
    Se2::new(at.x, at.y, from.theta() + wrap(to.theta() - from.theta()) * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sigmas(motion: Motion) -> (f64, f64, f64, f64) {
        let stage = Stage::new(Stage::nominal_camera().unwrap(), 2.0, 0.43, motion.yaws()).unwrap();
        let stops = if motion == Motion::Star { 27 } else { 40 };
        let knowledge = motion.drive(2.6, stops).knowledge(&stage);
        let c = knowledge.covariance().unwrap();
        (c[(0, 0)].sqrt() / 6.0, c[(2, 2)].sqrt() / 3.2, c[(4, 4)].sqrt() / 0.0025, knowledge.worst())
    }

    #[test]
    #[allow(clippy::print_stdout)]
    fn standing_still_and_one_panel_across_tell_nothing_and_the_others_do() {
        let all = Motion::ALL.map(sigmas);
        for (motion, s) in Motion::ALL.iter().zip(&all) {
            println!("{motion:?}: fx {:.2} %, cx {:.2} %, k1 {:.1} %, worst pixel {:.2}", s.0, s.1, s.2, s.3);
        }
        assert!(all[..2].iter().all(|s| s.0 > 2.0), "no better than nominal");
        assert!(all[2..].iter().all(|s| s.0 < 0.6));
    }
}

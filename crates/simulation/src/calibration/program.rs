//! What a driver does to calibrate a vehicle: arcs from standstill to standstill, or ordinary driving.
//!
//! **Arcs** (the thesis' path generator): |angle| takes `angles` evenly spaced values; each is driven left and right, forward
//! and backward, over a turn of `turn`. Speed is a trapezoid. Between two arcs the vehicle stops for `pause`, during
//! which it steers.
//!
//! **Continuous**: every 2 to 9 seconds the driver draws another speed and angle; both change at bounded rates. A draw
//! that would leave the floor is drawn again. Nothing is ever repeated, and nothing stops.

use super::drivetrain::{Demand, Drivetrain};
use groma_estimation::streams::Random;
use groma_geometry::Se2;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Change of speed [m/s^2] and of the steering angle [rad/s].
const ACCELERATION: f64 = 0.5;
const STEERING_RATE: f64 = 0.5;
/// How long a demand holds in continuous driving [s].
const HOLDS: (f64, f64) = (2.0, 9.0);
/// Least speed of continuous driving as a share of the speed.
const SLOWEST: f64 = 0.3;
/// Draws before the one that stays longest on the floor is taken.
const DRAWS: usize = 200;
/// Time that a draw must stay on the floor beyond its end: to slow down and turn back [s].
const BEYOND: f64 = 3.5;

/// How a recording is driven.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Program {
    /// From standstill to standstill.
    Arcs {
        /// Number of angles; four arcs each.
        angles: usize,
        /// Smallest and largest angle [rad].
        from: f64,
        /// Largest angle [rad].
        to: f64,
        /// Turn of the vehicle on an arc [rad].
        turn: f64,
        /// Standstill before, between and after [s].
        pause: f64,
    },
    /// Ordinary driving.
    Continuous {
        /// How long [s].
        duration: f64,
        /// Largest angle [rad].
        to: f64,
    },
}

/// The free floor: a rectangle about the origin.
#[derive(Clone, Copy, Debug)]
pub struct Floor {
    /// Half its size [m].
    pub half: Vector2<f64>,
}

impl Floor {
    /// Whether base and front of a vehicle are on it.
    #[must_use]
    pub fn holds(&self, pose: &Se2, front: f64) -> bool {
        let ahead = pose.act(Vector2::new(front, 0.0));
        [pose.translation, ahead].iter().all(|p| p.x.abs() < self.half.x && p.y.abs() < self.half.y)
    }
}

impl Program {
    /// The demands of every `step` seconds.
    #[must_use]
    pub fn demands(
        &self,
        drive: &Drivetrain,
        speed: f64,
        step: f64,
        start: Se2,
        floor: &Floor,
        random: &mut Random,
    ) -> Vec<Demand> {
        match *self {
            Self::Arcs { angles, from, to, turn, pause } => {
                let mut out = Vec::new();
                for (angle, forward) in arcs(angles, from, to) {
                    stand(angle, pause, step, &mut out);
                    trapezoid(drive.travel(angle, turn) * forward, angle, speed, step, &mut out);
                }
                let last = out.last().map_or(0.0, |d| d.angle);
                stand(last, pause, step, &mut out);
                out
            }
            Self::Continuous { duration, to } => {
                let steps = (duration / step) as usize;
                Wander { drive, speed, to, step, floor }.demands(steps, start, random)
            }
        }
    }
}

/// Angle and direction of every arc: left there and back, right there and back.
fn arcs(angles: usize, from: f64, to: f64) -> Vec<(f64, f64)> {
    let value = |k: usize| if angles > 1 { from + (to - from) * k as f64 / (angles - 1) as f64 } else { from };
    (0..angles).flat_map(|k| [(value(k), 1.0), (value(k), -1.0), (-value(k), 1.0), (-value(k), -1.0)]).collect()
}

/// Stands still, steering from the last angle to `angle` after a quarter of the time.
fn stand(angle: f64, pause: f64, step: f64, out: &mut Vec<Demand>) {
    let last = out.last().map_or(angle, |d| d.angle);
    for k in 0..(pause / step).round() as usize {
        let steered = STEERING_RATE * 2.0 * (k as f64 * step - 0.25 * pause).max(0.0);
        let turned = last + (angle - last).clamp(-steered, steered);
        out.push(Demand { speed: 0.0, angle: turned });
    }
}

/// Travels by `way` (signed) with a trapezoid of speed that ends exactly there.
fn trapezoid(way: f64, angle: f64, speed: f64, step: f64, out: &mut Vec<Demand>) {
    let top = speed.min((way.abs() * ACCELERATION).sqrt());
    let ramp = top / ACCELERATION;
    let total = way.abs() / top + ramp;
    let steps = (total / step).ceil().max(1.0);
    let at = |t: f64| match t {
        t if t < ramp => ACCELERATION * t * t / 2.0,
        t if t < total - ramp => top * (t - ramp / 2.0),
        t => way.abs() - ACCELERATION * (total - t).powi(2) / 2.0,
    };
    for k in 0..steps as usize {
        let (a, b) = (at(total * k as f64 / steps), at(total * (k as f64 + 1.0) / steps));
        out.push(Demand { speed: way.signum() * (b - a) / step, angle });
    }
}

struct Wander<'a> {
    drive: &'a Drivetrain,
    speed: f64,
    to: f64,
    step: f64,
    floor: &'a Floor,
}

impl Wander<'_> {
    fn demands(&self, steps: usize, start: Se2, random: &mut Random) -> Vec<Demand> {
        let (mut out, mut pose, mut now) = (Vec::new(), start, Demand::default());
        while out.len() < steps {
            let (goal, holds) = self.draw(&pose, now, random);
            for _ in 0..(holds / self.step) as usize {
                now = self.towards(now, goal);
                pose = self.moved(&pose, now);
                out.push(now);
            }
        }
        out.truncate(steps);
        out
    }

    /// A goal that stays on the floor for the time it holds and a while longer; else the one that stays longest.
    fn draw(&self, pose: &Se2, now: Demand, random: &mut Random) -> (Demand, f64) {
        let mut best = (Demand::default(), 0.0, -1.0);
        for _ in 0..DRAWS {
            let speed = random.sign() * self.speed * random.uniform(SLOWEST, 1.0);
            let goal = Demand { speed, angle: random.uniform(-self.to, self.to) };
            let holds = random.uniform(HOLDS.0, HOLDS.1);
            let stays = self.stays(*pose, now, goal, holds + BEYOND);
            if stays > best.2 {
                best = (goal, holds, stays);
            }
            if stays >= holds + BEYOND {
                return (goal, holds);
            }
        }
        (best.0, best.1.min((best.2 - BEYOND).max(0.5)))
    }

    fn stays(&self, mut pose: Se2, mut now: Demand, goal: Demand, most: f64) -> f64 {
        let steps = (most / self.step) as usize;
        for k in 0..steps {
            now = self.towards(now, goal);
            pose = self.moved(&pose, now);
            if !self.floor.holds(&pose, self.drive.front()) {
                return k as f64 * self.step;
            }
        }
        most
    }

    fn towards(&self, now: Demand, goal: Demand) -> Demand {
        let (up, side) = (ACCELERATION * self.step, STEERING_RATE * self.step);
        Demand {
            speed: now.speed + (goal.speed - now.speed).clamp(-up, up),
            angle: now.angle + (goal.angle - now.angle).clamp(-side, side),
        }
    }

    fn moved(&self, pose: &Se2, demand: Demand) -> Se2 {
        let [v, w] = self.drive.twist(self.drive.readings(demand), [0.0; 2], 0.0);
        pose.plus(Vector3::new(v, 0.0, w) * self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezoid_travels_the_way_and_keeps_the_speed() {
        for way in [9.0, -0.4, 2.0] {
            let mut out = vec![];
            trapezoid(way, 0.3, 1.0, 0.01, &mut out);
            let sum: f64 = out.iter().map(|d| d.speed * 0.01).sum();
            assert!((sum - way).abs() < 1e-9, "{way}: {sum}");
            assert!(out.iter().all(|d| d.speed.abs() < 1.0 + 1e-3 && d.speed * way > -1e-9));
            let jerks = out.windows(2).map(|w| (w[1].speed - w[0].speed).abs());
            assert!(jerks.fold(0.0, f64::max) < 1.1 * ACCELERATION * 0.01);
        }
    }

    #[test]
    fn every_angle_is_driven_on_both_sides_and_both_ways() {
        let all = arcs(4, 0.3, 0.9);
        assert_eq!(all.len(), 16);
        assert!(all.iter().map(|(a, f)| a.signum() * f).sum::<f64>().abs() < 1e-12);
        assert!((all[15].0 + 0.9).abs() < 1e-12 && (all[0].0 - 0.3).abs() < 1e-12);
    }
}

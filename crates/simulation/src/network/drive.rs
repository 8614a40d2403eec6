//! The drive from stop to stop: turn towards the next one, drive straight, turn to its heading, stand.
//!
//! The true stops are those of the scene (the robot is driven there by hand, or finds its way by other means); what drifts
//! is the odometry: of each short true step it knows `Exp(u) = Exp(u_true) Exp(w)^-1`.

use super::NetworkScene;
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::{LieGroup, Se2, Se3};
use nalgebra::{Vector3, Vector6};

/// Length of a step of the odometry [m], and its turn [rad].
const STEP: (f64, f64) = (0.1, 0.1);
/// Time of a step [s].
const STEP_TIME: f64 = 0.2;
/// How long the robot stands at a stop [s].
const STAND: f64 = 2.0;
/// Time of the start [s].
const START: f64 = 100.0;

/// Where the robot stood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Begin [s].
    pub from: f64,
    /// End [s].
    pub to: f64,
    /// True `T_W_R`, uneven floor included.
    pub pose: Se3,
}

/// The odometry and the stops of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkDrive {
    /// Stamps and poses.
    pub odometry: Vec<(f64, Se2)>,
    /// In order.
    pub stops: Vec<Stop>,
}

pub(super) fn drive(scene: &NetworkScene) -> NetworkDrive {
    let (mut wheels, mut floor) = (Random::new(scene.seed, Purpose::Wheels), Random::new(scene.seed, Purpose::Floor));
    let mut time = START;
    let mut drive = NetworkDrive { odometry: vec![(time, Se2::IDENTITY)], stops: vec![] };
    let mut last = Se2::IDENTITY;
    let mut believed = Se2::IDENTITY;
    for &[x, y, heading] in &scene.stops {
        let stop = Se2::new(x, y, heading);
        for u in steps(&last, &stop) {
            time += STEP_TIME;
            believed = believed * measured(&u, scene, &mut wheels);
            drive.odometry.push((time, believed));
        }
        last = stop;
        let from = time;
        time += STAND;
        drive.odometry.push((time, believed));
        drive.stops.push(Stop { from, to: time, pose: standing(&stop, scene, &mut floor) });
    }
    drive
}

/// What the wheels report of a true step: `Exp(u) = Exp(u_true) Exp(w)^-1`.
fn measured(step: &Se2, scene: &NetworkScene, random: &mut Random) -> Se2 {
    let walk = &scene.noise.odometry;
    let (ds, turn) = (step.translation.norm(), step.theta().abs());
    let heading = (walk.heading.powi(2) * ds + walk.turning.powi(2) * turn).sqrt();
    let sigmas = [walk.along * ds.sqrt(), walk.across * ds.sqrt(), heading];
    let w = Vector3::from(sigmas.map(|sigma| sigma * random.normal()));
    *step * Se2::exp(w).inverse()
}

fn standing(stop: &Se2, scene: &NetworkScene, random: &mut Random) -> Se3 {
    let yaw = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, stop.theta()));
    let level = Se3 { translation: [stop.x(), stop.y(), 0.0].into(), ..yaw };
    let (h, t) = (scene.noise.floor_height, scene.noise.floor_tilt);
    let uneven = [0.0, 0.0, h * random.normal(), t * random.normal(), t * random.normal(), 0.0];
    level * Se3::exp(&Vector6::from(uneven))
}

/// Short true motions that lead from one pose to another: a turn, a straight, a turn.
fn steps(from: &Se2, to: &Se2) -> Vec<Se2> {
    let way = to.translation - from.translation;
    let length = way.norm();
    let mut steps = vec![];
    let course = if length > 1e-9 { way.y.atan2(way.x) } else { from.theta() };
    turn(groma_geometry::wrap(course - from.theta()), &mut steps);
    let count = (length / STEP.0).ceil();
    steps.extend((0..count as usize).map(|_| Se2::new(length / count, 0.0, 0.0)));
    turn(groma_geometry::wrap(to.theta() - course), &mut steps);
    steps
}

fn turn(angle: f64, steps: &mut Vec<Se2>) {
    let count = (angle.abs() / STEP.1).ceil();
    steps.extend((0..count as usize).map(|_| Se2::new(0.0, 0.0, angle / count)));
}

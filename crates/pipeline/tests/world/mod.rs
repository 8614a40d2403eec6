//! A hall with strips of tape on its walls, a vehicle that sways through it, and what its sensors say.

use groma_geometry::Se2;
use groma_localization::{Mode, Options as FilterOptions};
use groma_models::{BeamGeometry, Landmark, LandmarkKind, LandmarkMap, LaserScan, Odometry};
use groma_pipeline::Message;
use groma_pipeline::localize::{Begin, Options, Setup};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use std::f64::consts::TAU;

/// Corners of the hall [m].
const HALL: (Vector2<f64>, Vector2<f64>) = (Vector2::new(-6.0, -4.0), Vector2::new(9.0, 5.0));
/// Half the width of a strip [m].
const STRIP: f64 = 0.12;
/// `T_base_laser`.
pub const MOUNT: (f64, f64, f64) = (0.3, -0.1, 0.2);
const BEAMS: usize = 900;
const SWEEP: f64 = 0.025;

/// Middles of the strips.
pub fn strips() -> Vec<Vector2<f64>> {
    let ((low, high), v) = (HALL, Vector2::new);
    let along_x = [-4.7, -1.1, 2.2, 3.1, 7.3]
        .map(|x| v(x, low.y))
        .into_iter()
        .chain([-5.2, -3.0, 0.4, 5.8].map(|x| v(x, high.y)));
    along_x.chain([-2.6, 0.3, 3.9].map(|y| v(low.x, y))).chain([-3.3, -0.8, 2.1].map(|y| v(high.x, y))).collect()
}

/// The twist of the body: it starts, sways, and stands from 8 to 11 s.
fn twist(t: f64) -> Vector3<f64> {
    let ease = |from: f64, to: f64| (((t - from) / (to - from)).clamp(0.0, 1.0) * std::f64::consts::PI).cos();
    let going = 0.25 * (1.0 - ease(0.3, 1.5)) * (1.0 + ease(7.0, 8.0)) + 0.5 * (1.0 - ease(11.0, 12.0));
    Vector3::new(0.5 * going, 0.0, 0.35 * going * (0.7 * t).sin())
}

/// Where the vehicle truly is.
pub struct Truth(Vec<Se2>);

const TICK: f64 = 1e-3;

impl Truth {
    pub fn new() -> Self {
        let mut pose = Se2::new(-2.0, -1.0, 0.4);
        let ticks = (0..20_000).map(|k| {
            let now = pose;
            pose = pose.plus(twist((f64::from(k) + 0.5) * TICK) * TICK);
            now
        });
        Self(ticks.collect())
    }

    pub fn at(&self, t: f64) -> Se2 {
        let k = ((t / TICK).floor().max(0.0) as usize).min(self.0.len() - 2);
        self.0[k].interpolate(&self.0[k + 1], t / TICK - k as f64)
    }
}

fn geometry() -> BeamGeometry {
    BeamGeometry {
        angle_min: -3.0,
        angle_increment: TAU / BEAMS as f64,
        time_increment: SWEEP / BEAMS as f64,
        range_min: 0.1,
        range_max: 30.0,
    }
}

/// A scan that meets nothing.
pub fn blind(stamp: f64) -> Message {
    let (ranges, intensities) = (vec![f64::INFINITY; BEAMS], vec![0.0; BEAMS]);
    Message::Scan { scanner: 0, scan: LaserScan { stamp, geometry: geometry(), ranges, intensities } }
}

/// A scan of the hall, each beam from where the laser is then.
pub fn scan(truth: &Truth, stamp: f64, draw: &mut ChaCha8Rng) -> Message {
    let (geometry, strips) = (geometry(), strips());
    let mount = Se2::new(MOUNT.0, MOUNT.1, MOUNT.2);
    let mut reading = |i: usize| {
        let laser = truth.at(stamp + i as f64 * geometry.time_increment) * mount;
        let bearing = laser.theta() + geometry.bearing(i);
        let direction = Vector2::new(bearing.cos(), bearing.sin());
        let to = |k: usize| {
            let wall = if direction[k] > 0.0 { HALL.1[k] } else { HALL.0[k] };
            (wall - laser.translation[k]) / direction[k]
        };
        let range = to(0).min(to(1));
        let hit = laser.translation + direction * range;
        let bright = strips.iter().any(|s| (s - hit).norm() < STRIP);
        (range + 0.01 * normal(draw), if bright { 3000.0 } else { 150.0 } / range)
    };
    let (ranges, intensities) = (0..BEAMS).map(&mut reading).unzip();
    Message::Scan { scanner: 0, scan: LaserScan { stamp, geometry, ranges, intensities } }
}

pub fn normal(draw: &mut ChaCha8Rng) -> f64 {
    draw.sample(StandardNormal)
}

pub fn draw(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Odometry in a frame of its own, fifty readings a second; its errors are a `share` of what the defaults expect.
pub fn odometry(truth: &Truth, until: f64, share: f64, draw: &mut ChaCha8Rng) -> Vec<Message> {
    let noise = Options::default().odometry;
    let mut pose = Se2::new(30.0, -8.0, 2.0);
    let mut before = truth.at(0.0);
    let mut reading = |k: i32| {
        let stamp = 0.02 * f64::from(k);
        let now = truth.at(stamp);
        let step = before.between(&now);
        let error = noise.variances(&step).map(|v| share * v.sqrt() * normal(draw));
        (before, pose) = (now, pose * step.plus(error));
        Message::Odometry(Odometry { stamp, pose })
    };
    (0..(50.0 * until) as i32).map(&mut reading).collect()
}

/// Ten scans a second.
pub fn scans(truth: &Truth, until: f64, draw: &mut ChaCha8Rng) -> Vec<Message> {
    (0..(10.0 * until) as i32 - 1).map(|k| scan(truth, 0.1 * f64::from(k) + 0.013, draw)).collect()
}

/// Messages in the order in which they arrive, each so late after it was complete.
pub fn arriving(messages: Vec<Message>, mut late: impl FnMut(&Message) -> f64) -> Vec<Message> {
    let mut timed: Vec<(f64, Message)> = messages.into_iter().map(|m| (m.end() + late(&m), m)).collect();
    timed.sort_by(|a, b| a.0.total_cmp(&b.0));
    timed.into_iter().map(|(_, m)| m).collect()
}

/// Strips as a surveyor finds them.
pub fn map() -> LandmarkMap {
    let landmark = |position| Landmark {
        kind: LandmarkKind::Reflector,
        position,
        covariance: Matrix2::identity() * 2.5e-5,
        orientation: None,
        descriptor: None,
        seen: 1,
        visible: 1,
    };
    LandmarkMap { landmarks: strips().into_iter().map(landmark).collect() }
}

/// The drive on the map, its start known roughly.
pub fn setup(truth: &Truth) -> Setup {
    let sigmas = Vector3::new(0.05, 0.05, 0.03);
    Setup {
        map: map(),
        grid: None,
        begin: Begin::At(truth.at(0.0), Matrix3::from_diagonal(&sigmas.map(|s| s * s))),
        mount: Se2::new(MOUNT.0, MOUNT.1, MOUNT.2),
        vehicle: None,
        options: Options {
            localizer: FilterOptions { mode: Mode::Reflectors, ..FilterOptions::default() },
            ..Options::default()
        },
    }
}

/// The drive without a map, in the frame of its start.
pub fn without_map() -> Setup {
    Setup {
        map: LandmarkMap::default(),
        grid: None,
        begin: Begin::Unknown,
        mount: Se2::IDENTITY,
        vehicle: None,
        options: Options::default(),
    }
}

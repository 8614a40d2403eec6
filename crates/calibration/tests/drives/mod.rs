//! Drives with known truth, and the noise of the theory page: stop-and-go arcs, and driving on without stops.
#![allow(dead_code, clippy::unwrap_used)]

use groma_calibration::vehicle::{Motion, Motions, Segments, Vehicle, prediction};
use groma_geometry::Se2;
use groma_models::{Differential, Drive, Tricycle, WheelKind, WheelLog};
use nalgebra::{Matrix3, Vector2, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::PI;

pub const WHEELBASE: f64 = 1.5;

pub fn cdeg(x: f64) -> f64 {
    (x * 0.01).to_radians()
}

/// The vehicle of the thesis' table 5.1; lengths of a count and of the pose in metres.
pub fn tricycle(asymmetric: bool) -> Vehicle {
    let [forward, backward] = if asymmetric { [-72.02, -78.76] } else { [-75.93; 2] };
    let (offset_forward, offset_backward) = (cdeg(forward), cdeg(backward));
    let drive = Tricycle { scale: 0.249_685e-3, wheelbase: WHEELBASE, gain: 1.0, offset_forward, offset_backward };
    Vehicle { drive: Drive::Tricycle(drive), laser: Se2::new(0.390_28, 0.002_14, cdeg(50.34)), delay: 0.0 }
}

pub fn differential() -> Vehicle {
    let drive = Differential { left: 0.0769, right: 0.0772, axle: 0.331 };
    Vehicle { drive: Drive::Differential(drive), laser: Se2::new(0.145, -0.01, 0.02), delay: 0.0 }
}

/// Standard deviations of the noise of a motion.
#[derive(Clone, Copy)]
pub struct Noise {
    pub place: f64,
    pub heading: f64,
    pub slip: f64,
    pub steering: f64,
    pub memory: f64,
}

impl Noise {
    pub fn default_of_notes() -> Self {
        let steering = 0.02_f64.to_radians();
        Self { place: 2e-3, heading: 0.03_f64.to_radians(), slip: 0.5e-3, steering, memory: 3.0 }
    }

    pub fn covariance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(self.place.powi(2), self.place.powi(2), self.heading.powi(2)))
    }
}

pub struct Random(ChaCha8Rng);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    pub fn uniform(&mut self) -> f64 {
        rand::RngExt::random(&mut self.0)
    }

    pub fn tangent(&mut self, noise: &Noise) -> Vector3<f64> {
        Vector3::new(self.normal() * noise.place, self.normal() * noise.place, self.normal() * noise.heading)
    }
}

/// An arc to drive: encoder angle or the share of the path that turns, and the path of the wheel [m].
#[derive(Clone, Copy, Debug)]
pub struct Arc {
    pub steering: f64,
    pub path: f64,
}

/// The path of the wheel that turns the vehicle by `beta`.
pub fn arc(degrees: f64, forward: bool, beta: f64) -> Arc {
    let path = WHEELBASE * beta.to_radians() / degrees.to_radians().sin().abs();
    Arc { steering: degrees.to_radians(), path: if forward { path } else { -path } }
}

pub fn straight(path: f64) -> Arc {
    Arc { steering: 0.0, path }
}

/// The grid of the thesis: so many angles, left and right, forward and backward.
pub fn grid(count: usize, from: f64, to: f64, beta: f64) -> Vec<Arc> {
    let mut arcs = Vec::new();
    for k in 0..count {
        let angle = from + (to - from) * k as f64 / (count - 1) as f64;
        for (sign, forward) in [(1.0, true), (1.0, false), (-1.0, true), (-1.0, false)] {
            arcs.push(arc(sign * angle, forward, beta));
        }
    }
    arcs
}

/// Time between readings on an arc, about [s].
const BETWEEN: f64 = 0.2;

/// Arcs with stops between, at a metre per second, as a log of readings and the times of the arcs.
pub fn stop_and_go(vehicle: &Vehicle, arcs: &[Arc]) -> (WheelLog, Vec<(f64, f64)>) {
    let (mut time, mut readings, mut spans) = (Vec::new(), Vec::new(), Vec::new());
    let (mut now, mut counts) = (0.0, Vector2::zeros());
    let mut push = |now: f64, reading: Vector2<f64>| {
        time.push(now);
        readings.push(reading);
    };
    for a in arcs {
        let reading = |counts: Vector2<f64>| match vehicle.drive {
            Drive::Tricycle(_) => Vector2::new(counts.x, a.steering),
            Drive::Differential(_) => counts,
        };
        push(now + 1.0, reading(counts));
        let steps = (a.path.abs() / BETWEEN).ceil();
        for k in 0..=steps as usize {
            let share = k as f64 / steps;
            push(now + 2.0 + share * a.path.abs(), reading(counts + travel(vehicle, a) * share));
        }
        let end = now + 2.0 + a.path.abs();
        counts += travel(vehicle, a);
        push(end + 1.0, reading(counts));
        spans.push((now + 2.0, end));
        now = end + 1.0;
    }
    let kind = if matches!(vehicle.drive, Drive::Tricycle(_)) { WheelKind::Steered } else { WheelKind::Differential };
    (WheelLog::new(kind, time, readings).unwrap(), spans)
}

/// Counts of the wheels over an arc.
fn travel(vehicle: &Vehicle, a: &Arc) -> Vector2<f64> {
    match vehicle.drive {
        Drive::Tricycle(t) => Vector2::new(a.path / t.scale, 0.0),
        Drive::Differential(d) => {
            let turn = a.path * a.steering.sin() / WHEELBASE;
            let forward = a.path * a.steering.cos();
            Vector2::new((forward - turn * d.axle / 2.0) / d.left, (forward + turn * d.axle / 2.0) / d.right)
        }
    }
}

fn turn_of(vehicle: &Vehicle, segments: &Segments, k: usize) -> f64 {
    segments.steps(k).iter().map(|s| vehicle.drive.path_and_turn(s.input).y).sum()
}

/// The exact motions of the laser between these times.
pub fn exact(vehicle: &Vehicle, log: &WheelLog, spans: &[(f64, f64)]) -> Vec<Motion> {
    let bare = |&(start, end): &(f64, f64)| Motion { start, end, motion: Se2::IDENTITY, turn: 0.0 };
    let mut motions: Vec<Motion> = spans.iter().map(bare).collect();
    let segments = Segments::new(log, &motions, vehicle.delay);
    for (k, m) in motions.iter_mut().enumerate() {
        m.motion = prediction::motion(vehicle, segments.steps(k));
        m.turn = turn_of(vehicle, &segments, k);
    }
    motions
}

pub fn without_covariance(motions: Vec<Motion>) -> Motions {
    Motions { motions, covariances: None, couplings: None }
}

pub fn with_covariance(motions: Vec<Motion>, covariance: Matrix3<f64>) -> Motions {
    let covariances = Some(vec![covariance; motions.len()]);
    Motions { motions, covariances, couplings: None }
}

/// Noisy motions between these times: what the wheels did, then the errors of the measured motion.
pub fn noisy(vehicle: &Vehicle, log: &WheelLog, spans: &[(f64, f64)], noise: &Noise, random: &mut Random) -> Motions {
    let mut motions = exact(vehicle, &done(vehicle, log, noise, random), spans);
    for m in &mut motions {
        let xi = random.tangent(noise);
        m.motion = m.motion.plus(xi);
        m.turn += xi.z;
    }
    with_covariance(motions, noise.covariance())
}

/// What the wheels did while the log was read: slip on every path, a steering error that remembers.
pub fn done(vehicle: &Vehicle, log: &WheelLog, noise: &Noise, random: &mut Random) -> WheelLog {
    let time = log.time();
    let mut error = noise.steering * random.normal();
    let mut slipped: Vector2<f64> = Vector2::zeros();
    let mut readings = Vec::with_capacity(time.len());
    for k in 0..time.len() {
        if k > 0 {
            let keep = (-(time[k] - time[k - 1]) / noise.memory).exp();
            error = keep * error + noise.steering * (1.0 - keep * keep).sqrt() * random.normal();
            let gained = log.reading(k) - log.reading(k - 1);
            let mut slip =
                |scale: f64, counts: f64| noise.slip * (scale * counts).abs().sqrt() * random.normal() / scale;
            slipped += match vehicle.drive {
                Drive::Tricycle(t) => Vector2::new(slip(t.scale, gained.x), 0.0),
                Drive::Differential(d) => Vector2::new(slip(d.left, gained.x), slip(d.right, gained.y)),
            };
        }
        let bent = match vehicle.drive {
            Drive::Tricycle(t) => Vector2::new(0.0, error / t.gain),
            Drive::Differential(_) => Vector2::zeros(),
        };
        readings.push(log.reading(k) + slipped + bent);
    }
    WheelLog::new(log.kind(), time.to_vec(), readings).unwrap()
}

/// The log as encoders give it: counters and steering in steps.
pub fn quantised(log: &WheelLog, counter: f64, steering: f64) -> WheelLog {
    let second = if log.kind() == WheelKind::Steered { steering } else { counter };
    let rounded = |v: f64, step: f64| if step > 0.0 { (v / step).round() * step } else { v };
    let reading = |k: usize| Vector2::new(rounded(log.reading(k).x, counter), rounded(log.reading(k).y, second));
    WheelLog::new(log.kind(), log.time().to_vec(), (0..log.time().len()).map(reading).collect()).unwrap()
}

/// Motions between scan poses whose errors are independent: neighbours share a scan.
pub fn between_scans(
    vehicle: &Vehicle,
    done: &WheelLog,
    spans: &[(f64, f64)],
    noise: &Noise,
    random: &mut Random,
) -> Motions {
    let mut motions = exact(vehicle, done, spans);
    let of_pose = noise.covariance();
    let (mut covariances, mut couplings) = (Vec::new(), Vec::new());
    let mut before: Vector3<f64> = random.tangent(noise);
    for m in &mut motions {
        let after = random.tangent(noise);
        let back = m.motion.inverse().adjoint();
        couplings.push(-of_pose * back.transpose());
        covariances.push(of_pose + back * of_pose * back.transpose());
        m.motion = Se2::exp(before).inverse() * m.motion * Se2::exp(after);
        m.turn += after.z - before.z;
        before = after;
    }
    couplings.remove(0);
    Motions { motions, covariances: Some(covariances), couplings: Some(couplings) }
}

/// Throws a share of motions far off, in place and turn.
pub fn spoil(motions: &mut Motions, share: f64, random: &mut Random) {
    for m in &mut motions.motions {
        if random.uniform() < share {
            let xi = Vector3::new(random.normal() * 0.05, random.normal() * 0.05, random.normal() * 0.01);
            m.motion = m.motion.plus(xi);
            m.turn += xi.z;
        }
    }
}

/// Driving on for some seconds at 50 Hz: speed and steering change every 2 to 9 s, back and forth.
pub fn driving_on(vehicle: &Vehicle, seconds: f64, random: &mut Random) -> WheelLog {
    const STEP: f64 = 0.02;
    let (mut time, mut readings) = (Vec::new(), Vec::new());
    let (mut counts, mut speed, mut steering): (Vector2<f64>, f64, f64) = (Vector2::zeros(), 0.0, 0.0);
    let (mut speed_aim, mut steering_aim, mut until): (f64, f64, f64) = (0.8, 0.2, 0.0);
    for k in 0..(seconds / STEP) as usize {
        let now = k as f64 * STEP;
        if now >= until {
            until = now + 2.0 + 7.0 * random.uniform();
            speed_aim = if random.uniform() < 0.35 { -1.0 } else { 1.0 } * (0.4 + 0.6 * random.uniform());
            steering_aim = (random.uniform() - 0.5) * 1.6;
        }
        speed += (speed_aim - speed).clamp(-0.6 * STEP, 0.6 * STEP);
        steering += (steering_aim - steering).clamp(-0.6 * STEP, 0.6 * STEP);
        time.push(now);
        readings.push(match vehicle.drive {
            Drive::Tricycle(_) => Vector2::new(counts.x, steering),
            Drive::Differential(_) => counts,
        });
        counts += travel(vehicle, &Arc { steering, path: speed * STEP });
    }
    let kind = if matches!(vehicle.drive, Drive::Tricycle(_)) { WheelKind::Steered } else { WheelKind::Differential };
    WheelLog::new(kind, time, readings).unwrap()
}

/// Windows of a length one after the other.
pub fn windows(log: &WheelLog, length: f64, margin: f64) -> Vec<(f64, f64)> {
    let (first, last) = log.span();
    let count = ((last - first - 2.0 * margin) / length) as usize;
    let at = |k: usize| first + margin + length * k as f64;
    (0..count).map(|k| (at(k), at(k + 1))).collect()
}

pub fn wrapped(turn: f64) -> f64 {
    (turn + PI).rem_euclid(2.0 * PI) - PI
}

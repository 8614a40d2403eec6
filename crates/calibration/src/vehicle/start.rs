//! The closed forms together: a vehicle from nothing but wheels and motions.
//!
//! Headings give the drive up to its size ([`super::heading`]), pairs of motions the pose of the laser and the size
//! ([`super::hand_eye`]). Gain and delay enter otherwise and are tried on a grid, one after the other.
//!
//! The best of several candidates is the one of least heavy-tailed cost, that of [`Student`]'s distribution, so that a few
//! outliers do not choose.

use super::hand_eye::{self, Form, HandEye, Pair};
use super::heading::{self, Row};
use super::motions::{Motion, Segments};
use super::parameters::{Model, Vehicle};
use super::prediction;
use groma_estimation::Student;
use groma_geometry::Se2;
use groma_models::{Differential, Drive, Tricycle};
use nalgebra::{Matrix3, Vector2};

/// What is known beforehand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The kind of vehicle.
    pub model: Model,
    /// Wheelbase [m], unless free.
    pub wheelbase: Option<f64>,
    /// Steering gain.
    pub gain: f64,
    /// Delay [s].
    pub delay: f64,
}

/// A motion with its steps and weights, as the closed forms take it.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Inverse variance of the turn.
    pub turn: f64,
    /// Inverse variance of a coordinate.
    pub place: f64,
}

impl Weights {
    /// All alike.
    pub const UNIT: Self = Self { turn: 1.0, place: 1.0 };

    /// From a covariance.
    #[must_use]
    pub fn from_covariance(c: &Matrix3<f64>) -> Self {
        Self { turn: 1.0 / c.m33, place: 2.0 / (c.m11 + c.m22) }
    }
}

/// The closed form; nothing when the motions do not hold it. `chosen` are the motions to use.
#[must_use]
pub fn closed_form(
    known: &Known,
    segments: &Segments,
    motions: &[Motion],
    weights: &[Weights],
    chosen: &[usize],
    form: Form,
) -> Option<Vehicle> {
    let usable = chosen.iter().copied().filter(|&k| !segments.steps(k).is_empty());
    let (unit, free_size) = drive_of_unit_size(known, segments, motions, weights, usable.clone())?;
    let pair = |k: usize| {
        let m = &motions[k];
        Pair::new(&unit, segments.steps(k), &m.motion, m.turn, form, weights[k].place)
    };
    let found = hand_eye::solve(usable.map(pair), free_size)?;
    Some(Vehicle { drive: sized(&unit, found.size), laser: pose(&found), delay: known.delay }.upright())
}

fn pose(found: &HandEye) -> Se2 {
    Se2::new(found.place.re, found.place.im, found.heading.arg())
}

/// The drive from headings, of wheelbase or axle 1 where that is free, and whether it is.
fn drive_of_unit_size(
    known: &Known,
    segments: &Segments,
    motions: &[Motion],
    weights: &[Weights],
    usable: impl Iterator<Item = usize>,
) -> Option<(Drive, bool)> {
    if known.model == Model::Differential {
        let counts = |k: usize| segments.steps(k).iter().map(|s| s.input).sum::<Vector2<f64>>();
        let p = heading::two_unknowns(usable.map(|k| (counts(k), motions[k].turn, weights[k].turn)))?;
        return Some((Drive::Differential(Differential { left: -p.x, right: p.y, axle: 1.0 }), true));
    }
    let row = |k: usize| Row::new(segments.steps(k), known.gain, motions[k].turn, weights[k].turn);
    let rows: Vec<Row> = usable.map(row).collect();
    let [forward, backward] = match known.model {
        Model::TricycleAsymmetric => heading::asymmetric(&rows)?,
        _ => [heading::symmetric(&rows)?; 2],
    };
    let (wheelbase, gain) = (known.wheelbase.unwrap_or(1.0), known.gain);
    let scale = wheelbase * forward.norm();
    let drive = Tricycle { scale, wheelbase, gain, offset_forward: forward.arg(), offset_backward: backward.arg() };
    Some((Drive::Tricycle(drive), known.wheelbase.is_none()))
}

/// The same drive, all lengths multiplied.
fn sized(drive: &Drive, size: f64) -> Drive {
    match *drive {
        Drive::Tricycle(t) => Drive::Tricycle(Tricycle { scale: t.scale * size, wheelbase: t.wheelbase * size, ..t }),
        Drive::Differential(d) => {
            Drive::Differential(Differential { left: d.left * size, right: d.right * size, axle: d.axle * size })
        }
    }
}

/// A start where headings do not hold the drive (one steering angle only, or no turn): no offset, wheels of one size.
#[must_use]
pub fn fallback(known: &Known, segments: &Segments, motions: &[Motion], weights: &[Weights]) -> Option<Vehicle> {
    let usable = || (0..motions.len()).filter(|&k| !segments.steps(k).is_empty());
    let counts = |k: usize| -> f64 {
        let steps = segments.steps(k).iter();
        if known.model == Model::Differential {
            steps.map(|s| (s.input.x.abs() + s.input.y.abs()) / 2.0).sum()
        } else {
            steps.map(|s| s.input.x.abs()).sum()
        }
    };
    let sums = usable().map(|k| Vector2::new(motions[k].motion.translation.norm() * counts(k), counts(k).powi(2)));
    let sums: Vector2<f64> = sums.sum();
    let scale = sums.x / sums.y;
    let drive = match known.model {
        Model::Differential => {
            Drive::Differential(Differential { left: scale, right: scale, axle: axle(segments, motions, scale) })
        }
        _ => Drive::Tricycle(Tricycle {
            scale,
            wheelbase: known.wheelbase.unwrap_or(1.0),
            gain: known.gain,
            offset_forward: 0.0,
            offset_backward: 0.0,
        }),
    };
    let pair = |k: usize| {
        let m = &motions[k];
        Pair::new(&drive, segments.steps(k), &m.motion, m.turn, Form::Wheels, weights[k].place)
    };
    let found = hand_eye::solve(usable().map(pair), false).unwrap_or_else(|| hand_eye::aligned(usable().map(pair)));
    scale.is_finite().then_some(Vehicle { drive, laser: pose(&found), delay: known.delay })
}

/// The axle that makes wheels of this size turn as the laser did; 1 m when nothing turned.
fn axle(segments: &Segments, motions: &[Motion], scale: f64) -> f64 {
    let difference = |k: usize| segments.steps(k).iter().map(|s| s.input.y - s.input.x).sum::<f64>() * scale;
    let (mut across, mut along) = (0.0, 0.0);
    for (k, m) in motions.iter().enumerate() {
        across += difference(k) * m.turn;
        along += m.turn * m.turn;
    }
    if along > 0.0 && across.abs() > 0.01 * along { across / along } else { 1.0 }
}

/// Heavy-tailed cost of a vehicle over some motions, less is better.
#[must_use]
pub fn cost(
    vehicle: &Vehicle,
    segments: &Segments,
    motions: &[Motion],
    information: &[Matrix3<f64>],
    chosen: &[usize],
    student: Student,
) -> f64 {
    let one = |&k: &usize| {
        let r = prediction::residual(&motions[k].motion, &prediction::motion(vehicle, segments.steps(k)));
        student.cost(r.dot(&(information[k] * r)))
    };
    chosen.iter().map(one).sum()
}

//! Where the laser sits, from pairs of motions of base and laser, in closed form.
//!
//! With complex numbers for points and the laser at `l` turned by `z`, base motion `(o, theta)`, laser motion s:
//!
//! ```text
//! z s_k = c o_k + a_k l,   a_k = exp(i theta_k) - 1,   |z| = 1,   c = 1, or free where o is known up to its size
//! minimise sum w_k |c o_k + a_k l - z s_k|^2
//! P v = v - a (a^H W v)/(a^H W a)                        takes the lever arm out
//! h = (P s)^H W (P o),  z = h/|h|,  c = |h|/((P o)^H W (P o))
//! l = a^H W (z s - c o)/(a^H W a)
//! ```
//!
//! The quadratic in z is a multiple of `|z|^2 = 1`, so that no multiplier is to be found; the 5 x 5 Lagrange problem of
//! Censi et al. 2013 has the same solution (tests). Two ways to take o and theta: both from the wheels (`Wheels`), or
//! both along the measured turn (`Centres`): on arcs of constant steering the second says that turning centres, seen
//! from the laser, lie on the axle of the fixed wheels. Nothing here knows outliers or unequal errors of x and y.

use groma_geometry::Se2;
use groma_models::wheel_log::Step;
use groma_models::{Drive, increment};
use nalgebra::Complex;

/// Turns below which measured and predicted turn are not set in proportion [rad].
const LEAST_TURN: f64 = 0.05;
/// Lever arms of less than this mean square say nothing of where the laser sits.
const NO_TURN: f64 = 1e-16;

/// Shares of the motions that are rounding after the lever arm is taken out.
const SINGULAR: f64 = 1e-12;

/// Whose turn the base follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// That of the wheels.
    Wheels,
    /// That of the laser, the base on the circles of its steering.
    Centres,
}

/// A pair of motions.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    /// Translation of the base.
    pub base: Complex<f64>,
    /// `exp(i theta) - 1`.
    pub lever: Complex<f64>,
    /// Translation of the laser.
    pub laser: Complex<f64>,
    /// Weight.
    pub weight: f64,
}

/// The solution.
#[derive(Clone, Copy, Debug)]
pub struct HandEye {
    /// Place of the laser.
    pub place: Complex<f64>,
    /// Its heading, of unit length.
    pub heading: Complex<f64>,
    /// What the base motions have to be multiplied with.
    pub size: f64,
}

impl Pair {
    /// From the steps of the wheels and the measured motion with its whole turn.
    #[must_use]
    pub fn new(drive: &Drive, steps: &[Step], measured: &Se2, turn: f64, form: Form, weight: f64) -> Self {
        let stretch = if form == Form::Wheels { 1.0 } else { stretch(drive, steps, turn) };
        let arc = |step: &Step| increment::arc(drive.path_and_turn(step.input) * stretch);
        let moved = match steps {
            [only] => arc(only),
            _ => steps.iter().fold(Se2::IDENTITY, |pose, step| pose * arc(step)),
        };
        Self {
            base: Complex::new(moved.x(), moved.y()),
            lever: Complex::new(moved.rotation.cos - 1.0, moved.rotation.sin),
            laser: Complex::new(measured.x(), measured.y()),
            weight,
        }
    }
}

/// Measured over predicted turn; 1 where either is too small to say.
fn stretch(drive: &Drive, steps: &[Step], turn: f64) -> f64 {
    let predicted: f64 = steps.iter().map(|s| drive.path_and_turn(s.input).y).sum();
    let ratio = turn / predicted;
    if predicted.abs() > LEAST_TURN && (0.5..2.0).contains(&ratio) { ratio } else { 1.0 }
}

/// A laser at the base whose motions point like those of the base: for motions that do not hold more.
#[must_use]
pub fn aligned(pairs: impl Iterator<Item = Pair>) -> HandEye {
    let sum: Complex<f64> = pairs.map(|p| p.laser.conj() * p.base * p.weight).sum();
    let heading = if sum.norm() > 0.0 { sum / sum.norm() } else { Complex::new(1.0, 0.0) };
    HandEye { place: Complex::new(0.0, 0.0), heading, size: 1.0 }
}

/// The weighted optimum, with c free or 1; nothing when nothing
/// moved, or all about one centre. A laser that never turned is put at 0.
#[must_use]
pub fn solve(pairs: impl Iterator<Item = Pair>, free_size: bool) -> Option<HandEye> {
    let zero = Complex::new(0.0, 0.0);
    let (mut weights, mut aa, mut oo, mut a_s, mut ao, mut so) = (0.0, 0.0, 0.0, zero, zero, zero);
    for Pair { base: o, lever: a, laser: s, weight } in pairs {
        weights += weight;
        aa += a.norm_sqr() * weight;
        oo += o.norm_sqr() * weight;
        a_s += a.conj() * s * weight;
        ao += a.conj() * o * weight;
        so += s.conj() * o * weight;
    }
    let turns = aa > NO_TURN * weights;
    let (h, base) = if turns { (so - a_s.conj() * ao / aa, oo - ao.norm_sqr() / aa) } else { (so, oo) };
    if !(h.norm() > SINGULAR * so.norm() && base > SINGULAR * oo) {
        return None;
    }
    let heading = h / h.norm();
    let size = if free_size { h.norm() / base } else { 1.0 };
    let place = if turns { (heading * a_s - ao * size) / aa } else { zero };
    Some(HandEye { place, heading, size })
}

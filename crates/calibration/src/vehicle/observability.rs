//! Parameters that a drive does not determine, and their names in words.
//!
//! A direction of the parameters is weak when its error is too large to be useful, that of a tape measure: a
//! decimetre, three degrees, a tenth of a radius, a fifth of a second. In
//! these units the information has eigenvalue 1 or less there. The weak directions are reported by their simplest basis
//! (reduced row echelon form), and are left out of the covariance.
//!
//! What to drive is said by rules on which parameters a direction has, and on what was driven. Derivation and the
//! table of degenerate drives: `docs/theory/vehicle_calibration.md`.

use super::likelihood::Axes;
use super::motions::{Motion, Segments};
use super::parameters::Vehicle;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{PI, TAU};

/// Parts below this share of the largest are not named.
const NAMED: f64 = 0.05;
/// Turns closer than this to none, or to whole ones, do not show where the laser sits [rad].
const LEAST_TURN: f64 = 0.1;

/// A direction that the data do not hold.
#[derive(Clone, Debug, PartialEq)]
pub struct Weak {
    /// Parts of the free parameters in units of an error too large to be useful, of unit length.
    pub direction: DVector<f64>,
    /// Which they are, and what to drive.
    pub words: String,
}

/// What is held, and what is not.
#[derive(Clone, Debug, PartialEq)]
pub struct Observability {
    /// Number of directions that are held.
    pub rank: usize,
    /// The others.
    pub weak: Vec<Weak>,
    /// Inverse information over what is held.
    pub inverse: DMatrix<f64>,
}

/// What was driven, as far as advice needs it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Driven {
    /// Some motion turns, other than by whole turns.
    pub turns: bool,
    /// Every turn is a whole one.
    pub whole_turns: bool,
    /// Some motion turns going forward.
    pub forward: bool,
    /// Some motion turns going backward.
    pub backward: bool,
}

impl Driven {
    /// From motions and the wheels during them.
    #[must_use]
    pub fn new(vehicle: &Vehicle, segments: &Segments, motions: &[Motion]) -> Self {
        let mut driven = Self { turns: false, whole_turns: false, forward: false, backward: false };
        for (k, m) in motions.iter().enumerate() {
            let path: f64 = segments.steps(k).iter().map(|s| vehicle.drive.path_and_turn(s.input).x).sum();
            let beyond_whole = (m.turn.abs() + PI).rem_euclid(TAU) - PI;
            driven.turns |= beyond_whole.abs() > LEAST_TURN;
            driven.whole_turns |= m.turn.abs() > PI && beyond_whole.abs() <= LEAST_TURN;
            driven.forward |= m.turn.abs() > LEAST_TURN && path >= 0.0;
            driven.backward |= m.turn.abs() > LEAST_TURN && path < 0.0;
        }
        driven
    }
}

/// Judges an information matrix in units of `useless` errors.
#[must_use]
pub fn observe(information: &DMatrix<f64>, useless: &DVector<f64>, names: &[&str], driven: &Driven) -> Observability {
    let axes = Axes::new(information, useless);
    let open: Vec<usize> = (0..useless.len()).filter(|&k| axes.values[k] <= 1.0).collect();
    let basis = DMatrix::from_fn(open.len(), useless.len(), |r, c| axes.vectors[(c, open[r])]);
    let weak = echelon(basis).row_iter().map(|row| weak(row.transpose().normalize(), names, driven)).collect();
    Observability { rank: useless.len() - open.len(), weak, inverse: axes.pseudo_inverse(|v| v > 1.0) }
}

/// Reduced row echelon form with the largest pivot left.
fn echelon(mut rows: DMatrix<f64>) -> DMatrix<f64> {
    let mut free: Vec<usize> = (0..rows.ncols()).collect();
    for r in 0..rows.nrows() {
        let below = (r..rows.nrows()).flat_map(|i| free.iter().map(move |&j| (i, j)));
        let Some((i, j)) = below.max_by(|a, b| rows[*a].abs().total_cmp(&rows[*b].abs())) else { break };
        rows.swap_rows(r, i);
        let pivot = rows[(r, j)];
        rows.row_mut(r).scale_mut(1.0 / pivot);
        free.retain(|&c| c != j);
        for other in (0..rows.nrows()).filter(|&o| o != r) {
            let (factor, row) = (rows[(other, j)], rows.row(r).clone_owned());
            let mut own = rows.row_mut(other);
            own -= row * factor;
        }
    }
    rows
}

fn weak(direction: DVector<f64>, names: &[&str], driven: &Driven) -> Weak {
    let limit = NAMED * direction.amax();
    let parts: Vec<&str> =
        names.iter().zip(direction.iter()).filter(|(_, v)| v.abs() > limit).map(|(n, _)| *n).collect();
    let what = match parts.as_slice() {
        [one] => format!("{one} is not observed"),
        [first @ .., last] => format!("{} and {last} can change together without effect", first.join(", ")),
        [] => String::new(),
    };
    Weak { words: format!("{what}: {}", advice(&parts, driven)), direction }
}

/// What to drive so that these parameters are seen.
fn advice(parts: &[&str], driven: &Driven) -> &'static str {
    let only = |allowed: &[&str]| parts.iter().all(|p| allowed.contains(p));
    if only(&["delay"]) {
        return "drive on without stops while speed and steering change";
    }
    if !driven.turns && driven.whole_turns {
        return "end a turn before or after the whole circle, at 180 deg best";
    }
    if !driven.turns {
        return "drive arcs, to the left and to the right";
    }
    if only(&["steering_offset_backward"]) && !driven.backward {
        return "drive arcs backward, to the left and to the right";
    }
    if only(&["steering_offset_forward"]) && !driven.forward {
        return "drive arcs forward, to the left and to the right";
    }
    if parts.iter().any(|p| p.starts_with("steering_offset_")) {
        return "drive arcs of two steering angles at least forward and backward, to the left and to the right";
    }
    if parts.contains(&"steering_gain") {
        return "drive arcs of three steering angles at least, to the left and to the right";
    }
    if parts.contains(&"axle") {
        return "drive straight and turn, to the left and to the right";
    }
    "drive arcs of another steering angle, best the same to the other side"
}

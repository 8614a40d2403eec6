//! Does the model hold? Tests for what residuals of one kind of motion have in common.
//!
//! Motions are sorted into groups (direction, speed, steering). If the model holds, no group has a mean residual of its
//! own. With white residuals y, white design W, and E the white indicator of the groups, three columns a group:
//!
//! ```text
//! E~ = E - W N^-1 W^T E                 what the parameters cannot take up
//! T  = (E~^T y)^T V^-1 (E~^T y),        V = Cov(E~^T y)
//! ```
//!
//! T is chi-square with as many degrees of freedom as V has rank (a score test; Rao 1948), or F with the scale's. V is
//! `s^2 E~^T E~`, or, where neighbouring motions are correlated, the lagged sum of the scores themselves.

use super::likelihood::{self, Axes, Row};
use super::motions::{Motion, Segments};
use super::parameters::{FULL, Layout, Vehicle};
use super::robust::Fit;
use nalgebra::{DMatrix, DVector, SMatrix};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Groups at most.
const GROUPS: usize = 3;
const COLUMNS: usize = 3 * GROUPS;
/// A group of fewer motions is not tested.
const LEAST: usize = 3;
/// Turn below which a motion counts as straight [rad].
const STRAIGHT: f64 = 0.05;
/// Speeds that differ less than this share are one.
const SAME_SPEED: f64 = 0.2;

/// A question to the residuals and its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct Test {
    /// `asymmetry`, `fit`, `direction`, `speed`, `steering`.
    pub name: &'static str,
    /// What is compared with its distribution.
    pub statistic: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Probability of as much if the model holds.
    pub p_value: f64,
}

/// Probability that an F variable exceeds `f`.
#[must_use]
pub fn f_beyond(f: f64, dof: usize, dof_of_scale: usize) -> f64 {
    FisherSnedecor::new(dof as f64, dof_of_scale as f64).map_or(f64::NAN, |d| d.sf(f.max(0.0)))
}

/// The tests of a fit by direction, speed and steering, those that the drive allows.
#[must_use]
pub fn lack_of_fit(layout: &Layout, fit: &Fit, motions: &[Motion], lags: usize) -> Vec<Test> {
    let kinds: [(&'static str, Grouping); 3] =
        [("direction", by_direction), ("speed", by_speed), ("steering", by_steering)];
    let test = |(name, grouping): (&'static str, Grouping)| {
        let groups = populated(grouping(&fit.vehicle, &fit.segments, motions))?;
        score_test(name, layout, fit, &groups, lags)
    };
    kinds.into_iter().filter_map(test).collect()
}

type Grouping = fn(&Vehicle, &Segments, &[Motion]) -> Vec<Option<usize>>;

/// Path of the base [m], negative backward.
fn path(vehicle: &Vehicle, segments: &Segments, k: usize) -> f64 {
    segments.steps(k).iter().map(|s| vehicle.drive.path_and_turn(s.input).x).sum()
}

fn by_direction(vehicle: &Vehicle, segments: &Segments, motions: &[Motion]) -> Vec<Option<usize>> {
    (0..motions.len()).map(|k| Some(usize::from(path(vehicle, segments, k) < 0.0))).collect()
}

fn by_steering(_: &Vehicle, _: &Segments, motions: &[Motion]) -> Vec<Option<usize>> {
    let side = |m: &Motion| if m.turn.abs() < STRAIGHT { 1 } else { 2 * usize::from(m.turn > 0.0) };
    motions.iter().map(|m| Some(side(m))).collect()
}

fn by_speed(vehicle: &Vehicle, segments: &Segments, motions: &[Motion]) -> Vec<Option<usize>> {
    let speed = |(k, m): (usize, &Motion)| path(vehicle, segments, k).abs() / (m.end - m.start);
    let speeds: Vec<f64> = motions.iter().enumerate().map(speed).collect();
    let mut sorted = speeds.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share) as usize];
    let (low, high) = (at(1.0 / 3.0), at(2.0 / 3.0));
    if high - low < SAME_SPEED * high {
        return vec![None; motions.len()];
    }
    speeds.iter().map(|&v| Some(if v <= low { 0 } else { 1 + usize::from(v > high) })).collect()
}

/// Groups that have enough motions; nothing for fewer than two.
fn populated(groups: Vec<Option<usize>>) -> Option<Vec<Option<usize>>> {
    let count = |g: usize| groups.iter().filter(|&&own| own == Some(g)).count();
    let large: Vec<usize> = (0..GROUPS).filter(|&g| count(g) >= LEAST).collect();
    let keep = |own: &Option<usize>| own.filter(|g| large.contains(g));
    (large.len() >= 2).then(|| groups.iter().map(keep).collect())
}

type White = SMatrix<f64, 3, COLUMNS>;

fn score_test(name: &'static str, layout: &Layout, fit: &Fit, groups: &[Option<usize>], lags: usize) -> Option<Test> {
    let indicators: Vec<White> = groups.iter().map(|g| indicator(*g)).collect();
    let mut white = fit.noise.whitener.columns(&indicators);
    white.iter_mut().zip(&fit.noise.weights).for_each(|(e, w)| *e *= w.sqrt());
    let scores = projected_scores(layout, fit, &white);
    let dof_of_scale = fit.numbers().saturating_sub(layout.len());
    let total: DVector<f64> = scores.scores.iter().sum();
    let variance = if lags == 0 { scores.model * fit.noise.scale_sq } else { lagged(&scores.scores, lags) };
    let axes = Axes::new(&variance, &DVector::from_element(COLUMNS, 1.0 / variance.diagonal().amax().sqrt()));
    let passes = |v: f64| v > 1e-6;
    let statistic = (axes.pseudo_inverse(passes) * &total).dot(&total);
    let dof = axes.values.iter().filter(|v| passes(**v)).count();
    let p_value = f_beyond(statistic / dof.max(1) as f64, dof.max(1), dof_of_scale.max(1));
    (dof > 0).then_some(Test { name, statistic, dof, p_value })
}

fn indicator(group: Option<usize>) -> White {
    let mut e = White::zeros();
    if let Some(g) = group {
        e.fixed_view_mut::<3, 3>(0, 3 * g).fill_with_identity();
    }
    e
}

struct Scores {
    scores: Vec<DVector<f64>>,
    model: DMatrix<f64>,
}

/// Scores of the indicators after what the parameters take up.
fn projected_scores(layout: &Layout, fit: &Fit, indicators: &[White]) -> Scores {
    let n = layout.reduced(&likelihood::normal(&fit.white).0);
    let axes = Axes::new(&n, &layout.useless(&fit.vehicle.to_full()));
    let inverse = axes.pseudo_inverse(|v| v > 0.0);
    let mut cross = DMatrix::zeros(layout.len(), COLUMNS);
    for (row, e) in fit.white.iter().zip(indicators) {
        let full: SMatrix<f64, FULL, COLUMNS> = row.design.tr_mul(e);
        for (c, column) in full.column_iter().enumerate() {
            let mut own = cross.column_mut(c);
            own += layout.reduced_vector(&column.into_owned());
        }
    }
    let taken = inverse * cross;
    let mut model = DMatrix::zeros(COLUMNS, COLUMNS);
    let mut scores = Vec::with_capacity(indicators.len());
    for (Row { residual, design }, e) in fit.white.iter().zip(indicators) {
        let reduced = reduced_design(layout, design);
        let left = DMatrix::from_fn(3, COLUMNS, |r, c| e[(r, c)]) - reduced * &taken;
        model += left.tr_mul(&left);
        scores.push(left.tr_mul(&DVector::from_column_slice(residual.as_slice())));
    }
    Scores { scores, model }
}

fn reduced_design(layout: &Layout, design: &super::prediction::Matrix3x9) -> DMatrix<f64> {
    let rows: Vec<DVector<f64>> = (0..3).map(|r| layout.reduced_vector(&design.row(r).transpose())).collect();
    DMatrix::from_fn(3, layout.len(), |r, c| rows[r][c])
}

fn lagged(scores: &[DVector<f64>], lags: usize) -> DMatrix<f64> {
    let mut sum = DMatrix::zeros(COLUMNS, COLUMNS);
    for j in 0..=lags {
        let share = if j == 0 { 0.5 } else { 1.0 - j as f64 / (lags as f64 + 1.0) };
        for (a, b) in scores.iter().zip(scores.iter().skip(j)) {
            sum.ger(share, a, b, 1.0);
        }
    }
    &sum + sum.transpose()
}

//! Two scans registered to each other, each to the lines of the other, with a covariance from what is left.
//!
//! With T the pose of b in a, p_i the points of b and (c, n) the line of a nearest to T p_i; and the other way round:
//!
//! ```text
//! r_i = n . (T p_i - c)             dr/dd = (m, x x m),    m = R^T n, x = p_i
//! r_j = n . (T^-1 p_j - c)          dr/dd = -(n, x x n),   x = T^-1 p_j            T <- T exp(d)
//! cost = sum rho(r / s),  rho Cauchy's loss, s = 1.48 median |r|
//! ```
//!
//! **Covariance.** Readings on one piece of wall share errors: the line they are compared with, the texture, what stands
//! before it. Those within a cell of `PATCH` metres are taken as one measurement, cells as independent:
//!
//! ```text
//! B = sum psi'(r) J J^T,   g_c = sum over cell c of psi(r) J,   Sigma = B^-1 (sum g_c g_c^T) B^-1 m / (m - 3)
//! ```
//!
//! (cluster-robust; Liang and Zeger, Biometrika 73, 1986, with the usual factor for m cells). So no noise of the scanner
//! has to be known, and what is not noise counts as well. A direction without walls across it is told as `open`.
//!
//! Not by `estimation::levenberg_marquardt`: pairs, radius and scale change with every step, as in `point_to_line`. Fitting
//! the pairs of each round by it saves few rounds (452 instead of 487 over 60 pairs of scans) and takes 1169 linearisations
//! instead of one a round (`common_loop.rs` prints it).
//!
//! Needs a start within a decimetre or so, and static surroundings.

use crate::contour::Contour;
use crate::point_to_line::NORMAL_AGREEMENT;
use groma_estimation::robust;
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector2, Vector3};
use std::collections::BTreeMap;

/// Radii of the search for lines, one after the other [m]; the last is repeated.
pub(crate) const RADII: [f64; 4] = [0.3, 0.2, 0.15, 0.1];
pub(crate) const MOST_ITERATIONS: usize = 25;
/// Steps smaller than this end the iteration [m], [rad].
const NEGLIGIBLE: (f64, f64) = (2e-6, 2e-7);
/// Cauchy's tuning constant: 95 % efficiency for Gaussian residuals.
const CAUCHY: f64 = 2.385;
/// Bounds of the residual scale [m].
const SCALE: (f64, f64) = (1e-4, 0.05);
/// Width of the pieces of wall whose readings count as one measurement [m].
const PATCH: f64 = 0.5;
/// A direction of the position that holds less than this share of the information of both is open.
const OPEN: f64 = 0.02;

/// The result of a mutual registration.
#[derive(Clone, Debug)]
pub struct Mutual {
    /// Pose of b in a.
    pub pose: Se2,
    /// Covariance of `pose * exp(xi)`.
    pub covariance: Matrix3<f64>,
    /// Share of the points on lines of both scans that lie on one of the other (within three scales).
    pub share: f64,
    /// Robust spread of the residuals [m].
    pub scale: f64,
    /// Pieces of wall that were measured.
    pub patches: usize,
    /// Whether some direction of the position has no walls across it.
    pub open: bool,
    /// Whether the last step was negligible.
    pub converged: bool,
}

/// One residual.
pub(crate) struct Pair {
    pub residual: f64,
    pub row: Vector3<f64>,
    /// Where it lies in a [m].
    place: Vector2<f64>,
}

/// Registers b to a from `start`, the pose of b in a.
#[must_use]
pub fn align_mutually(a: &Contour, b: &Contour, start: Se2) -> Mutual {
    let (mut pose, mut converged) = (start, false);
    for k in 0..MOST_ITERATIONS {
        let pairs = pairs(a, b, &pose, RADII[k.min(RADII.len() - 1)]);
        let step = step(&pairs, spread(&pairs));
        pose = pose.plus(step);
        converged = is_negligible(&step);
        if converged && k + 1 >= RADII.len() {
            break;
        }
    }
    let lined = |c: &Contour| c.lines.iter().flatten().count();
    summary(&pairs(a, b, &pose, RADII[RADII.len() - 1]), lined(a) + lined(b), pose, converged)
}

pub(crate) fn pairs(a: &Contour, b: &Contour, pose: &Se2, radius: f64) -> Vec<Pair> {
    let mut out = Vec::with_capacity(a.points.len() + b.points.len());
    for (p, line) in b.points.iter().zip(&b.lines) {
        let Some(own) = line else { continue };
        let at = pose.act(*p);
        if let Some(l) = a.nearest(at, pose.rotation.act(own.normal), radius, NORMAL_AGREEMENT) {
            let m = pose.rotation.inverse().act(l.normal);
            let row = Vector3::new(m.x, m.y, p.x * m.y - p.y * m.x);
            out.push(Pair { residual: l.normal.dot(&(at - l.through)), row, place: at });
        }
    }
    let back = pose.inverse();
    for (p, line) in a.points.iter().zip(&a.lines) {
        let Some(own) = line else { continue };
        let x = back.act(*p);
        if let Some(l) = b.nearest(x, back.rotation.act(own.normal), radius, NORMAL_AGREEMENT) {
            let n = l.normal;
            let row = -Vector3::new(n.x, n.y, x.x * n.y - x.y * n.x);
            out.push(Pair { residual: n.dot(&(x - l.through)), row, place: *p });
        }
    }
    out
}

/// The Gauss-Newton step.
pub(crate) fn step(pairs: &[Pair], scale: f64) -> Vector3<f64> {
    let (mut hessian, mut gradient) = (Matrix3::identity() * 1e-6, Vector3::zeros());
    for pair in pairs {
        let w = 1.0 / (1.0 + relative_sq(pair.residual, scale));
        hessian += pair.row * pair.row.transpose() * w;
        gradient += pair.row * (w * pair.residual);
    }
    hessian.cholesky().map_or_else(Vector3::zeros, |c| -c.solve(&gradient))
}

/// Whether a step ends the iteration.
pub(crate) fn is_negligible(step: &Vector3<f64>) -> bool {
    step.xy().norm() < NEGLIGIBLE.0 && step.z.abs() < NEGLIGIBLE.1
}

fn relative_sq(residual: f64, scale: f64) -> f64 {
    (residual / (CAUCHY * scale)).powi(2)
}

/// The robust spread of the residuals, within the bounds.
pub(crate) fn spread(pairs: &[Pair]) -> f64 {
    robust::spread(pairs.iter().map(|pair| pair.residual)).map_or(SCALE.1, |spread| spread.clamp(SCALE.0, SCALE.1))
}

fn summary(pairs: &[Pair], points: usize, pose: Se2, converged: bool) -> Mutual {
    let scale = spread(pairs);
    let (mut bread, mut plain) = (Matrix3::identity() * 1e-6, Matrix3::zeros());
    let mut patches: BTreeMap<(i32, i32), Vector3<f64>> = BTreeMap::new();
    for pair in pairs {
        let u = relative_sq(pair.residual, scale);
        bread += pair.row * pair.row.transpose() * ((1.0 - u) / (1.0 + u).powi(2));
        plain += pair.row * pair.row.transpose() / (1.0 + u);
        let key = ((pair.place.x / PATCH).floor() as i32, (pair.place.y / PATCH).floor() as i32);
        *patches.entry(key).or_insert_with(Vector3::zeros) += pair.row * (pair.residual / (1.0 + u));
    }
    let meat = patches.values().fold(Matrix3::zeros(), |sum, g| sum + g * g.transpose());
    let few = patches.len() as f64 / (patches.len() as f64 - 3.0).max(0.5);
    let inverse = bread.try_inverse().unwrap_or_else(Matrix3::identity);
    let matched = pairs.iter().filter(|pair| pair.residual.abs() < 3.0 * scale).count();
    Mutual {
        pose,
        covariance: inverse * meat * inverse * few,
        share: matched as f64 / points.max(1) as f64,
        scale,
        patches: patches.len(),
        open: is_open(&plain),
        converged,
    }
}

/// Whether one direction of the position, the heading being free, is hardly held at all.
fn is_open(information: &Matrix3<f64>) -> bool {
    let turn = information[(2, 2)].max(1e-12);
    let cross = information.fixed_view::<2, 1>(0, 2).into_owned();
    let position = information.fixed_view::<2, 2>(0, 0).into_owned() - cross * cross.transpose() / turn;
    let values = position.symmetric_eigen().eigenvalues;
    values.min() < OPEN * values.sum().max(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::{BeamGeometry, LaserScan};

    /// Ranges in a rectangular room from a pose, with noise.
    fn scan(pose: &Se2, mut noise: impl FnMut() -> f64) -> LaserScan {
        let step = 0.25_f64.to_radians();
        let geometry = BeamGeometry {
            angle_min: -540.0 * step,
            angle_increment: step,
            time_increment: 0.0,
            range_min: 0.05,
            range_max: 40.0,
        };
        let ranges = (0..1081).map(|i| {
            let d = pose.rotation.act(Vector2::new(geometry.bearing(i).cos(), geometry.bearing(i).sin()));
            let to = |x: f64, v: f64, low: f64, high: f64| ((if v > 0.0 { high } else { low }) - x) / v;
            to(pose.x(), d.x, -6.0, 7.0).min(to(pose.y(), d.y, -4.0, 5.0)) + noise()
        });
        LaserScan { stamp: 0.0, geometry, ranges: ranges.collect(), intensities: vec![] }
    }

    fn contour(pose: &Se2, noise: impl FnMut() -> f64) -> Contour {
        Contour::new(&scan(pose, noise), Vector3::zeros())
    }

    /// Standard normal numbers from a linear congruential generator (sum of twelve uniforms).
    fn gaussian(seed: &mut u64) -> f64 {
        let mut uniform = || {
            *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (*seed >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }

    #[test]
    fn half_a_turn_is_recovered_to_microns_without_noise() {
        let (a, b) = (Se2::new(0.4, -0.3, 0.2), Se2::new(1.9, 1.1, 3.2));
        let truth = a.between(&b);
        let start = truth.plus(Vector3::new(0.05, -0.04, 0.02));
        let found = align_mutually(&contour(&a, || 0.0), &contour(&b, || 0.0), start);
        assert!(found.converged && !found.open && found.share > 0.6, "{found:?}");
        // Not to machine precision: the line at a corner may hold a point of the other wall.
        assert!(truth.between(&found.pose).log().norm() < 5e-6, "{:?}", truth.between(&found.pose).log());
    }

    #[test]
    fn the_covariance_holds_without_being_told_the_noise() {
        let mut seed = 11;
        for sigma in [0.003, 0.012] {
            let (runs, mut nees) = (60, 0.0);
            for k in 0..runs {
                let a = Se2::new(0.3 + 0.01 * f64::from(k), -0.2, 0.1);
                let b = a * Se2::new(0.5, 0.03, 0.15);
                let (ca, cb) =
                    (contour(&a, || sigma * gaussian(&mut seed)), contour(&b, || sigma * gaussian(&mut seed)));
                let found = align_mutually(&ca, &cb, a.between(&b));
                let e = found.pose.minus(&a.between(&b));
                nees += found.covariance.try_inverse().map_or(99.0, |i| e.dot(&(i * e))) / (3 * runs) as f64;
            }
            assert!((0.7..1.5).contains(&nees), "mean NEES per degree of freedom {nees} with {sigma} m of noise");
        }
    }

    #[test]
    fn a_corridor_is_open() {
        let wall = |y: f64| (0..400).map(move |i| Vector2::new(0.05 * f64::from(i) - 10.0, y));
        let points: Vec<_> = wall(1.0).chain(wall(-1.0)).collect();
        let rows = points.iter().map(|p| Vector3::new(0.0, -p.y.signum(), -p.x * p.y.signum()));
        let information = rows.fold(Matrix3::zeros(), |sum, row| sum + row * row.transpose());
        assert!(is_open(&information));
    }

    #[test]
    fn nothing_in_common_moves_nothing() {
        let empty = Contour::default();
        let found = align_mutually(&empty, &contour(&Se2::IDENTITY, || 0.0), Se2::new(1.0, 0.0, 0.1));
        assert!(found.share == 0.0 && found.patches == 0 && found.open);
        assert_eq!(found.pose, Se2::new(1.0, 0.0, 0.1));
    }
}

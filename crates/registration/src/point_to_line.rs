//! Point-to-line registration: Gauss-Newton on a scan against surfaces, with a motion prior.
//!
//! With `T` the pose of the scan in the map, `p_i` its points, `(q_i, n_i)` the surface point nearest to `T p_i`:
//!
//! ```text
//! r_i(T)  = n_i . (T p_i - q_i)
//! cost(T) = sum_i rho(r_i / s) + rho_t( || log(T_prior^-1 T) ||_P )
//! T <- T exp(d),   dr_i/dd = n_i^T R [ I | p_i^perp ]
//! ```
//!
//! `rho` is Cauchy's loss, its scale `s` the robust spread of the residuals of the iteration (1.48 times the median of
//! their absolute values, within bounds), so that no scanner has to be described. `rho_t` is Student's loss on the
//! prior: odometry that jumps loses its weight where the scan is decisive. The radius of the search for surfaces shrinks
//! from iteration to iteration.
//!
//! **Covariance.** `information = independence / s^2 * sum w_i J_i^T J_i`, without the prior. Readings of one
//! scan share errors (incidence, surface texture, beam divergence, wrong matches), so only a share of them counts as
//! independent. Directions without surfaces across them have no information: a value, not an error.
//!
//! Not by `estimation::levenberg_marquardt`: pairs, radius and scale change with every step, so there is no one cost by
//! which a step could be refused. Fitting the pairs of each round by it saves no rounds (392 instead of 377 over 60 pairs of
//! scans) and takes 1305 linearisations instead of one a round (`common_loop.rs` prints it).
//!
//! Source: A. Censi, "An ICP variant using a point-to-line metric", ICRA 2008, for the metric.

use crate::surface_scan::SurfaceScan;
use groma_estimation::{Student, robust};
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Cosine of the largest angle between the normals of a point and of the surface it is matched to.
pub const NORMAL_AGREEMENT: f64 = 0.7;
/// Share of the readings that count as independent.
const INDEPENDENCE: f64 = 0.1;
/// Bounds of the residual scale [m].
const SCALE: (f64, f64) = (0.008, 0.08);
/// Residual scale at which alignments are compared [m].
const COMPARED: f64 = 0.03;
/// Cauchy's tuning constant: 95 % efficiency for Gaussian residuals.
pub(crate) const CAUCHY: f64 = 2.385;
/// Radii of the search for surfaces, one after the other [m]; the last is repeated.
pub(crate) const RADII: [f64; 6] = [0.6, 0.6, 0.4, 0.3, 0.2, 0.15];
pub(crate) const MOST_ITERATIONS: usize = 20;
/// Steps smaller than this end the iteration [m], [rad].
const NEGLIGIBLE: (f64, f64) = (2e-4, 2e-5);

/// What can be requested its nearest surface.
pub trait Surfaces {
    /// The nearest surface point and its normal within `radius` of `p`, seen from the side that `normal` tells (any if zero).
    fn nearest(&self, p: Vector2<f64>, normal: Vector2<f64>, radius: f64) -> Option<(Vector2<f64>, Vector2<f64>)>;
}

/// Prior of the pose.
#[derive(Clone, Debug)]
pub struct Prior {
    /// The expected pose.
    pub pose: Se2,
    /// Its information in the body frame.
    pub information: Matrix3<f64>,
    /// Degrees of freedom of its Student loss: few where it may be badly wrong (odometry that slips and jumps), many
    /// where its tails are thin (a mass that cannot leap).
    pub dof: f64,
}

impl Prior {
    /// Squared Mahalanobis distance of a pose.
    #[must_use]
    pub fn distance_sq(&self, pose: &Se2) -> f64 {
        let e = pose.minus(&self.pose);
        e.dot(&(self.information * e))
    }

    /// How the pose scatters about it.
    #[must_use]
    pub fn student(&self) -> Student {
        Student { dof: self.dof, dimension: 3.0 }
    }
}

/// The result of a registration.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// Pose of the scan in the map.
    pub pose: Se2,
    /// Information of the pose in the body frame, from the readings alone; may be rank deficient.
    pub information: Matrix3<f64>,
    /// Share of the scan's points that lie on a surface (within three scales).
    pub share: f64,
    /// Number of such points.
    pub matched: usize,
    /// Robust spread of the residuals [m].
    pub scale: f64,
    /// Negative log posterior up to a constant: to compare alignments of one scan.
    pub cost: f64,
    /// Whether the last step was negligible.
    pub converged: bool,
}

/// One linearisation.
pub(crate) struct Normal {
    hessian: Matrix3<f64>,
    gradient: Vector3<f64>,
    matched: usize,
    cost: f64,
    pub scale: f64,
}

/// The distance of a point from its line.
pub(crate) struct Match {
    pub residual: f64,
    pub row: Vector3<f64>,
}

/// Registers `scan` to `map` from `start`.
#[must_use]
pub fn align(scan: &SurfaceScan, map: &impl Surfaces, start: Se2, prior: Option<&Prior>) -> Alignment {
    let mut pose = start;
    let mut converged = false;
    let mut matches = Vec::with_capacity(scan.points.len());
    for k in 0..MOST_ITERATIONS {
        let radius = RADII[k.min(RADII.len() - 1)];
        let normal = linearize(scan, map, &pose, radius, &mut matches);
        let step = solve(&normal, prior, &pose);
        pose = pose.plus(step);
        converged = is_negligible(&step);
        if converged && k + 1 >= RADII.len() {
            break;
        }
    }
    let last = linearize(scan, map, &pose, RADII[RADII.len() - 1], &mut matches);
    Alignment {
        pose,
        information: last.hessian * INDEPENDENCE,
        share: last.matched as f64 / scan.points.len().max(1) as f64,
        matched: last.matched,
        scale: last.scale,
        cost: last.cost * INDEPENDENCE + prior.map_or(0.0, |p| p.student().cost(p.distance_sq(&pose))),
        converged,
    }
}

pub(crate) fn linearize(
    scan: &SurfaceScan,
    map: &impl Surfaces,
    pose: &Se2,
    radius: f64,
    matches: &mut Vec<Match>,
) -> Normal {
    matches.clear();
    for (p, n) in scan.points.iter().zip(&scan.normals) {
        let at = pose.act(*p);
        if let Some((q, normal)) = map.nearest(at, pose.rotation.act(*n), radius) {
            let body = pose.rotation.inverse().act(normal);
            let row = Vector3::new(body.x, body.y, p.x * body.y - p.y * body.x);
            matches.push(Match { residual: normal.dot(&(at - q)), row });
        }
    }
    accumulate(matches, scan.points.len())
}

fn accumulate(matches: &[Match], points: usize) -> Normal {
    let scale = spread(matches);
    let (mut hessian, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
    let (mut cost, mut matched) = (0.0, 0);
    let per_variance = 1.0 / (scale * scale);
    for m in matches {
        let u = (m.residual / (CAUCHY * scale)).powi(2);
        let w = per_variance / (1.0 + u);
        hessian += m.row * m.row.transpose() * w;
        gradient += m.row * (w * m.residual);
        cost += loss(m.residual);
        matched += usize::from(m.residual.abs() < 3.0 * scale);
    }
    // A point without a surface costs as much as one at the edge of the search: matches are never a burden.
    cost += (points - matches.len()) as f64 * loss(RADII[RADII.len() - 1]);
    Normal { hessian, gradient, matched, cost, scale }
}

/// The loss by which alignments are compared, of one scale for all of them.
fn loss(residual: f64) -> f64 {
    0.5 * CAUCHY * CAUCHY * (residual / (CAUCHY * COMPARED)).powi(2).ln_1p()
}

/// The robust spread of the residuals, within the bounds.
fn spread(matches: &[Match]) -> f64 {
    robust::spread(matches.iter().map(|m| m.residual)).map_or(SCALE.1, |spread| spread.clamp(SCALE.0, SCALE.1))
}

/// The Gauss-Newton step; directions that neither readings nor prior hold do not move.
pub(crate) fn solve(normal: &Normal, prior: Option<&Prior>, pose: &Se2) -> Vector3<f64> {
    let mut hessian = normal.hessian * INDEPENDENCE;
    let mut gradient = normal.gradient * INDEPENDENCE;
    if let Some(prior) = prior {
        let e = pose.minus(&prior.pose);
        let weight = prior.student().weight(prior.distance_sq(pose));
        hessian += prior.information * weight;
        gradient += prior.information * e * weight;
    }
    let damped = hessian + Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.0)) * 1e-6;
    let step = damped.cholesky().map_or_else(Vector3::zeros, |c| -c.solve(&gradient));
    limit(step)
}

/// Whether a step ends the iteration.
pub(crate) fn is_negligible(step: &Vector3<f64>) -> bool {
    step.xy().norm() < NEGLIGIBLE.0 && step.z.abs() < NEGLIGIBLE.1
}

/// Keeps a step within what the linearisation can stand.
fn limit(step: Vector3<f64>) -> Vector3<f64> {
    let factor = (0.5 / step.xy().norm()).min(0.35 / step.z.abs()).min(1.0);
    step * factor
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface_map::SurfaceMap;

    /// Points on the walls of an L-shaped room, each moved along its normal by `noise`.
    fn room(spacing: f64, mut noise: impl FnMut() -> f64) -> SurfaceScan {
        let corners = [(-2.0, -1.5), (4.0, -1.5), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (-2.0, 3.0)];
        let mut scan = SurfaceScan::default();
        for k in 0..corners.len() {
            let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
            let (a, b) = (Vector2::new(a.0, a.1), Vector2::new(b.0, b.1));
            let along = (b - a).normalize();
            let normal = Vector2::new(-along.y, along.x);
            let n = ((b - a).norm() / spacing) as usize;
            for i in 0..n {
                scan.points.push(a + along * (i as f64 * spacing) + normal * noise());
                scan.normals.push(normal);
            }
        }
        scan
    }

    fn seen_from(scan: &SurfaceScan, pose: &Se2) -> SurfaceScan {
        let inverse = pose.inverse();
        SurfaceScan {
            points: scan.points.iter().map(|p| inverse.act(*p)).collect(),
            normals: scan.normals.iter().map(|n| inverse.rotation.act(*n)).collect(),
        }
    }

    fn map_of(scan: &SurfaceScan) -> SurfaceMap {
        let mut map = SurfaceMap::default();
        map.insert(scan, &Se2::IDENTITY);
        map
    }

    /// Standard normal numbers from a linear congruential generator (sum of twelve uniforms).
    fn gaussian(seed: &mut u64) -> f64 {
        (0..12)
            .map(|_| {
                *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (*seed >> 11) as f64 / (1u64 << 53) as f64
            })
            .sum::<f64>()
            - 6.0
    }

    #[test]
    fn recovers_the_pose_exactly_without_noise() {
        let truth = Se2::new(0.3, -0.2, 0.15);
        let walls = room(0.05, || 0.0);
        let found = align(&seen_from(&walls, &truth), &map_of(&walls), Se2::IDENTITY, None);
        let error = truth.between(&found.pose);
        assert!(found.converged && error.log().norm() < 1e-9, "{error:?}");
        assert!(found.share > 0.99);
    }

    #[test]
    fn a_jump_of_the_odometry_is_overruled_by_the_scan() {
        let truth = Se2::new(0.1, 0.0, 0.05);
        let walls = room(0.05, || 0.0);
        let information = Matrix3::from_diagonal(&Vector3::new(1e3, 1e3, 1e4));
        let prior = Prior { pose: Se2::new(0.9, 0.3, 0.5), information, dof: 4.0 };
        let found = align(&seen_from(&walls, &truth), &map_of(&walls), Se2::IDENTITY, Some(&prior));
        assert!(truth.between(&found.pose).log().norm() < 0.02, "{:?}", found.pose);
    }

    #[test]
    fn a_corridor_leaves_its_direction_to_the_prior() {
        let wall = |y: f64, ny: f64| (0..200).map(move |i| (Vector2::new(0.05 * f64::from(i) - 5.0, y), ny));
        let mut corridor = SurfaceScan::default();
        for (p, ny) in wall(1.0, -1.0).chain(wall(-1.0, 1.0)) {
            corridor.points.push(p);
            corridor.normals.push(Vector2::new(0.0, ny));
        }
        let information = Matrix3::from_diagonal(&Vector3::new(1e2, 1e2, 1e3));
        let prior = Prior { pose: Se2::new(0.5, 0.1, 0.02), information, dof: 4.0 };
        let found = align(&corridor, &map_of(&corridor), prior.pose, Some(&prior));
        assert!(found.pose.y().abs() < 0.01 && found.pose.theta().abs() < 0.002 && (found.pose.x() - 0.5).abs() < 0.05);
        assert!(found.information[(0, 0)] < 1e-3 * found.information[(1, 1)]);
    }

    #[test]
    fn nothing_to_match_returns_the_prior() {
        let prior = Prior { pose: Se2::new(1.0, 2.0, 0.3), information: Matrix3::identity(), dof: 4.0 };
        let found = align(&room(0.1, || 0.0), &SurfaceMap::default(), prior.pose, Some(&prior));
        assert_eq!(found.matched, 0);
        assert!(prior.pose.between(&found.pose).log().norm() < 1e-12);
        let empty = align(&SurfaceScan::default(), &map_of(&room(0.1, || 0.0)), prior.pose, None);
        assert!(empty.share == 0.0 && empty.pose == prior.pose);
    }

    #[test]
    fn with_independent_noise_the_covariance_is_safe_by_the_stated_share() {
        // Readings with independent noise: the true spread is `INDEPENDENCE` times what the covariance says, because
        // real readings are not independent. NEES per degree of freedom must be near that share.
        let mut seed = 7;
        let map = map_of(&room(0.05, || 0.0));
        let truth = Se2::new(0.05, -0.05, 0.02);
        let runs = 300;
        let mut nees = 0.0;
        for _ in 0..runs {
            let scan = room(0.05, || 0.02 * gaussian(&mut seed));
            let found = align(&seen_from(&scan, &truth), &map, Se2::IDENTITY, None);
            let e = found.pose.minus(&truth);
            nees += e.dot(&(found.information * e)) / (3 * runs) as f64;
        }
        assert!(nees > 0.6 * INDEPENDENCE && nees < 1.4 * INDEPENDENCE, "{nees}");
    }
}

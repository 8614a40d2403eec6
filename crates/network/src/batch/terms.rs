//! The costs of the batch: residuals, and their shares of the normal equations.

use super::system::System;
use super::{B, Batch, BatchView, Lens, Residuals, State};
use crate::Error;
use crate::floor::{levelled, planar};
use crate::measurement::jacobians;
use crate::view::{Normal, normal};
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Token};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x6, Matrix6, SMatrix, SVector, Vector3, Vector6};
use rayon::prelude::*;

/// What represents a sigma of zero [m, rad].
const EXACT: f64 = 1e-6;
/// x, y and yaw in the tangent of SE(3); z, roll and pitch.
const PLANE: [usize; 3] = [0, 1, 5];
const UPRIGHT: [usize; 3] = [2, 3, 4];

/// Fills the system and returns the cost; nothing where a camera does not see a corner.
pub(crate) fn linearise(
    batch: &Batch,
    state: &State,
    system: &mut System,
    token: &Token,
) -> Result<Option<f64>, Error> {
    token.check()?;
    system.clear();
    let [_, places, lenses, mount] = state.blocks();
    let mut cost = add_origin(&state.stops, system) + add_priors(batch, state, system, lenses, mount);
    for (k, motion) in batch.motions.iter().enumerate() {
        let (r, from, to) = odometry(&state.stops[k], &state.stops[k + 1], &motion.pose);
        let white = whitener(&motion.covariance)?;
        cost += (white * r).norm_squared();
        system.add(&[(k, white * from), (k + 1, white * to)], &(white * r));
    }
    for (k, stop) in state.stops.iter().enumerate() {
        let (r, j) = uneven(stop);
        let white = floor_whitener(batch);
        cost += (white * r).norm_squared();
        system.add(&[(k, white * j)], &(white * r));
    }
    let cameras = calibrated(batch, state);
    let of_view = |view: &BatchView| {
        // The rest of the views is passed over once the work is cancelled.
        token.check().ok()?;
        normal(&cameras[view.lens], &batch.lenses[view.lens].basis, &view.corners, &foretold(state, view))
    };
    let normals: Vec<Option<Normal>> = batch.views.par_iter().map(of_view).collect();
    token.check()?;
    for (view, full) in batch.views.iter().zip(normals) {
        let Some(full) = full else { return Ok(None) };
        let (reduced, eliminated) = slackened(full, batch.slack);
        cost += eliminated;
        add_view(&reduced, state, view, [places, lenses, mount], system);
    }
    Ok(Some(cost))
}

/// What is left at an estimate.
pub(super) fn residuals(batch: &Batch, state: &State) -> Residuals {
    let cameras = calibrated(batch, state);
    let of_view = |view: &BatchView| {
        let basis = DMatrix::zeros(batch.lenses[view.lens].camera.count(), 0);
        let full = normal(&cameras[view.lens], &basis, &view.corners, &foretold(state, view));
        (full.map_or(f64::INFINITY, |n| n.chi_square), 2 * view.corners.len())
    };
    Residuals { views: batch.views.iter().map(of_view).collect(), ..residuals_without_views(batch, state) }
}

fn residuals_without_views(batch: &Batch, state: &State) -> Residuals {
    let mut found = Residuals::default();
    for (k, motion) in batch.motions.iter().enumerate() {
        let (r, ..) = odometry(&state.stops[k], &state.stops[k + 1], &motion.pose);
        let white = whitener(&motion.covariance).unwrap_or_else(|_| Matrix3::zeros());
        found.odometry.0 += (white * r).norm_squared();
    }
    found.odometry.1 = 3 * batch.motions.len();
    let white = floor_whitener(batch);
    found.floor = (state.stops.iter().map(|t| (white * uneven(t).0).norm_squared()).sum(), 3 * state.stops.len());
    let (whitening, held) = mount_prior(batch);
    let mu = whitening * (state.mount * batch.mount.0.inverse()).log();
    let calibration: f64 = state.calibrations.iter().map(DVector::norm_squared).sum();
    let count: usize = state.calibrations.iter().map(DVector::len).sum();
    found.priors = (mu.norm_squared() + calibration, count + B - held);
    found
}

/// `H = T_C^-1 T_R T_R_B`.
fn foretold(state: &State, view: &BatchView) -> Se3 {
    state.places[view.place].between(&(state.stops[view.stop] * state.mount))
}

fn calibrated(batch: &Batch, state: &State) -> Vec<Camera> {
    batch.lenses.iter().zip(&state.calibrations).map(|(lens, b): (&Lens, _)| lens.calibrated(b)).collect()
}

/// The view's normal equations with its slack eliminated, and the robust cost that is left then.
///
/// With `e ~ N(0, F)` beside d: `min_e` of `1/2 (d+e)^T A (d+e) + ... + 1/2 e^T F^-1 e` gives, with `K = (A + F^-1)^-1`:
/// `A - A K A`, `C - A K C`, `D - C^T K C`, `g - A K g`, `q - C^T K g`.
fn slackened(full: Normal, slack: [f64; 2]) -> (Normal, f64) {
    if slack[0] <= 0.0 || slack[1] <= 0.0 {
        let cost = full.cost;
        return (full, cost);
    }
    let information = Vector6::from_fn(|k, _| slack[k / 3].powi(-2));
    let Some(gain) = (full.pose + Matrix6::from_diagonal(&information)).try_inverse() else {
        let cost = full.cost;
        return (full, cost);
    };
    let ak = full.pose * gain;
    let ck = full.coupling.transpose() * gain;
    let coupling = full.coupling - ak * full.coupling;
    let calibration = full.calibration - ck * full.coupling;
    let calibration_gradient = full.calibration_gradient - ck * full.gradient;
    let kg = gain * full.gradient;
    let cost = full.cost - full.gradient.dot(&kg);
    let reduced = Normal {
        pose: full.pose - ak * full.pose,
        coupling,
        calibration,
        gradient: full.gradient - ak * full.gradient,
        calibration_gradient,
        ..full
    };
    (reduced, cost)
}

/// d is `B (xi + Ad(T_R) mu - zeta)`.
fn add_view(n: &Normal, state: &State, view: &BatchView, [places, lenses, mount]: [usize; 3], system: &mut System) {
    let (b, b_mount) = jacobians(&state.stops[view.stop], &state.mount);
    let parts = [(view.stop, b), (places + view.place, -b), (mount, b_mount)];
    for (k, (i, j_i)) in parts.iter().enumerate() {
        system.add_diagonal(*i, &(j_i.transpose() * n.pose * j_i), &(j_i.transpose() * n.gradient));
        for (j, j_j) in &parts[k + 1..] {
            system.couple(*i, *j, &(j_i.transpose() * n.pose * j_j));
        }
        system.couple(*i, lenses + view.lens, &(j_i.transpose() * n.coupling));
    }
    system.add_diagonal(lenses + view.lens, &n.calibration, &n.calibration_gradient);
}

/// Odometry between two stops: residual and derivatives in both world-frame errors.
fn odometry(a: &Se3, b: &Se3, motion: &Se3) -> (Vector3<f64>, Matrix3x6<f64>, Matrix3x6<f64>) {
    let ((pa, fa), (pb, fb)) = (levelled(a), levelled(b));
    let e = motion.between(&pa.between(&pb)).log();
    let j = Se3::right_jacobian_inverse(&e) * pb.inverse().adjoint();
    (rows(&e, PLANE), -rows(&(j * fa), PLANE), rows(&(j * fb), PLANE))
}

/// How unevenly the robot stands, and its derivative.
fn uneven(t: &Se3) -> (Vector3<f64>, Matrix3x6<f64>) {
    let (p, f) = levelled(t);
    let e = p.between(t).log();
    let j = Se3::right_jacobian_inverse(&e) * t.inverse().adjoint() * (Matrix6::identity() - f);
    (rows(&e, UPRIGHT), rows(&j, UPRIGHT))
}

fn rows<const C: usize>(m: &SMatrix<f64, B, C>, chosen: [usize; 3]) -> SMatrix<f64, 3, C> {
    SMatrix::from_fn(|i, j| m[(chosen[i], j)])
}

/// `W` with `W^T W` the information of x, y and yaw.
fn whitener(covariance: &Matrix6<f64>) -> Result<Matrix3<f64>, Error> {
    let plane = Matrix3::from_fn(|i, j| covariance[(PLANE[i], PLANE[j])]) + Matrix3::identity() * EXACT * EXACT;
    let failed = groma_estimation::Error::NotPositiveDefinite { block: 0 };
    let root = plane.cholesky().ok_or(failed.clone())?.l();
    Ok(root.try_inverse().ok_or(failed)?)
}

fn floor_whitener(batch: &Batch) -> Matrix3<f64> {
    let sigmas = [batch.floor.height, batch.floor.tilt, batch.floor.tilt].map(|s| 1.0 / s.max(EXACT));
    Matrix3::from_diagonal(&Vector3::from(sigmas))
}

/// The first stop's x, y and yaw against the origin.
fn origin(stops: &[Se3]) -> Option<(Vector3<f64>, Matrix3x6<f64>)> {
    let (p, f) = levelled(stops.first()?);
    let e = planar(&p).log();
    let j = Se3::left_jacobian_inverse(&e) * f;
    Some((rows(&e, PLANE) / EXACT, rows(&j, PLANE) / EXACT))
}

fn add_origin(stops: &[Se3], system: &mut System) -> f64 {
    let Some((r, j)) = origin(stops) else { return 0.0 };
    system.add(&[(0, j)], &r);
    r.norm_squared()
}

/// The whitening of mu (rows of zeros for what is held), and how many directions are held.
fn mount_prior(batch: &Batch) -> (Matrix6<f64>, usize) {
    let eigen = batch.mount.1.symmetric_eigen();
    let least = 1e-12 * eigen.eigenvalues.amax().max(1e-12);
    let held = eigen.eigenvalues.iter().filter(|&&v| v <= least).count();
    let scale = eigen.eigenvalues.map(|v| if v > least { 1.0 / v.sqrt() } else { 0.0 });
    (Matrix6::from_diagonal(&scale) * eigen.eigenvectors.transpose(), held)
}

fn add_priors(batch: &Batch, state: &State, system: &mut System, lenses: usize, mount: usize) -> f64 {
    let mut cost = 0.0;
    for (k, b) in state.calibrations.iter().enumerate() {
        let mut gradient = SVector::<f64, B>::zeros();
        gradient.rows_mut(0, b.len()).copy_from(b);
        system.add_diagonal(lenses + k, &Matrix6::identity(), &gradient);
        cost += b.norm_squared();
    }
    let mu = (state.mount * batch.mount.0.inverse()).log();
    let (white, _) = mount_prior(batch);
    system.add(&[(mount, white * Se3::left_jacobian_inverse(&mu))], &(white * mu));
    // What is held is held by a number large against all that is known: the step has no share of it.
    let eigen = batch.mount.1.symmetric_eigen();
    let least = 1e-12 * eigen.eigenvalues.amax().max(1e-12);
    let held = eigen.eigenvalues.map(|v| if v > least { 0.0 } else { EXACT.powi(-2) * 1e4 });
    let stiff = eigen.eigenvectors * Matrix6::from_diagonal(&held) * eigen.eigenvectors.transpose();
    system.add_diagonal(mount, &stiff, &Vector6::zeros());
    cost + (white * mu).norm_squared()
}

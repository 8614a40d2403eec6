//! From views to a camera: the steps in their order.
//!
//! 1. Views with too few corners, or whose corners no pose explains, are left out.
//! 2. A start; joint refinement; corners left out by X84, twice; mirrored poses tried again until none is better.
//! 3. Refusal, when the panel never turned, a direction is not determined, or the focal length stays uncertain.
//! 4. `s^2 = |r|^2 / dof`, covariance `s^2 S^-1` of the parameters, `s^2 (W^-1 + W^-1 V^T S^-1 V W^-1)` of the poses.
//! 5. Halves against each other: the covariance times `max(1, factor)^2` is the one to pass on.

use super::adjust::{State, adjust};
use super::honesty::{Honesty, honesty};
use super::information::{Knowledge, knowledge, most_telling, pose_covariances};
use super::options::Options;
use super::panel_pose::{DECIDED, both_poses, mirrored, refined};
use super::refusal::Refusal;
use super::reject::{LEAST_CORNERS, kept, limit, misfit};
use super::start::{Frame, first_camera};
use super::view::View;
use groma_geometry::Se3;
use groma_models::{Camera, Token};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3};

const LEAST_VIEWS: usize = 3;
const STEPS: usize = 100;
/// Rounds of leaving out corners and of trying mirrored poses.
const ROUNDS: usize = 3;
/// Panels that turn by less never tell a focal length [rad].
const LEAST_TURN: f64 = 0.05;
/// Share of a weak direction below which a parameter is not named.
const NAMED_SHARE: f64 = 0.3;

/// A calibrated camera and what is known of it.
#[derive(Clone, Debug)]
pub struct CameraCalibration {
    /// The camera.
    pub camera: Camera,
    /// Covariance of the parameters as the residuals claim it (n, n).
    pub covariance: DMatrix<f64>,
    /// Standard deviation of a residual, relative to what the corners claim.
    pub residual_factor: f64,
    /// Root mean square length of the residuals of the corners kept [pixel].
    pub rms: f64,
    /// The same over all corners of the views used [pixel].
    pub rms_all: f64,
    /// Residuals less unknowns.
    pub dof: usize,
    /// Check of the covariance by split halves of the images.
    pub honesty: Honesty,
    /// One a view given; nothing for those left out.
    pub views: Vec<Option<ViewResult>>,
}

/// What is known of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewResult {
    /// `T_camera_panel`.
    pub pose: Se3,
    /// Covariance of its right perturbation, from the corners alone.
    pub white: Matrix6<f64>,
    /// Covariance with the share of the parameters.
    pub covariance: Matrix6<f64>,
    /// Whether the mirrored pose explains the corners clearly worse.
    pub decided: bool,
    /// Residuals of all its corners (predicted less seen) [pixel].
    pub residuals: Vec<[f64; 2]>,
    /// Which corners were used.
    pub used: Vec<bool>,
    /// Whether it took part in the refinement, or was held out.
    pub taken: bool,
}

impl CameraCalibration {
    /// The covariance to pass on: the claimed one, inflated by what the halves say.
    #[must_use]
    pub fn inflated(&self) -> DMatrix<f64> {
        &self.covariance * self.honesty.factor.unwrap_or(1.0).max(1.0).powi(2)
    }
}

/// Views in work, with their places in the list given.
struct Work {
    places: Vec<usize>,
    views: Vec<View>,
    state: State,
}

/// Calibrates a camera whose images have this size.
///
/// # Errors
/// [`Refusal`] when the views do not allow it: the reason, and what to do; or when the token cancels the work.
pub fn calibrate(
    width: u32,
    height: u32,
    views: &[View],
    options: &Options,
    token: &Token,
) -> Result<CameraCalibration, Refusal> {
    options.validate()?;
    let frame = Frame { width, height, lens: options.lens };
    let mut all = begin(frame, views, token)?;
    settle(&mut all, token)?;
    let work = taken(&all, options.most_views, token);
    token.check()?;
    let mut work = work.ok_or(not_settled(options))?;
    let mut converged = false;
    for _ in 0..ROUNDS {
        clean(&mut work, views, options.rejection);
        enough(work.views.len())?;
        converged = settle(&mut work, token)?;
    }
    turned(&work)?;
    let knowledge = held(&work)?;
    let dof = degrees(&work).ok_or(Refusal::TooFewViews { views: work.views.len(), needed: LEAST_VIEWS })?;
    let variance = knowledge.blocks.iter().map(|b| b.error).sum::<f64>() / dof as f64;
    let covariance = &knowledge.covariance * variance;
    certain(&work.state.camera, &covariance, options.focal_tolerance)?;
    if !converged {
        return Err(not_settled(options));
    }
    let honesty = honesty(&work.state, &work.views, options.splits, options.seed, token);
    token.check()?;
    let results = results(&work, views, &knowledge, (variance, options.rejection));
    let (rms, rms_all) = rms(&results);
    let (camera, residual_factor) = (work.state.camera, variance.sqrt());
    Ok(CameraCalibration { camera, covariance, residual_factor, rms, rms_all, dof, honesty, views: results })
}

fn enough(views: usize) -> Result<(), Refusal> {
    if views < LEAST_VIEWS { Err(Refusal::TooFewViews { views, needed: LEAST_VIEWS }) } else { Ok(()) }
}

fn not_settled(options: &Options) -> Refusal {
    Refusal::NotSettled { lens: options.lens.name() }
}

/// The usable views with a first camera and first poses.
fn begin(frame: Frame, given: &[View], token: &Token) -> Result<Work, Refusal> {
    let usable: Vec<usize> = (0..given.len()).filter(|&k| given[k].corners.len() >= LEAST_CORNERS).collect();
    enough(usable.len())?;
    let views: Vec<View> = usable.iter().map(|&k| given[k].clone()).collect();
    let camera = first_camera(frame, &views, token);
    token.check()?;
    let camera = camera.ok_or(Refusal::NoStart)?;
    let mut work = Work { places: vec![], views: vec![], state: State { camera, poses: vec![] } };
    for (place, view) in usable.into_iter().zip(views) {
        token.check()?;
        let Some(poses) = both_poses(&work.state.camera, &view.corners) else { continue };
        work.places.push(place);
        work.views.push(view);
        work.state.poses.push(poses[0].0);
    }
    enough(work.views.len())?;
    Ok(work)
}

/// Refines all, and again while a mirrored pose is better; whether the last refinement reached its end.
fn settle(work: &mut Work, token: &Token) -> Result<bool, Refusal> {
    let lens = work.state.camera.lens().name();
    let free = vec![true; work.state.camera.count()];
    let mut converged = false;
    for _ in 0..ROUNDS {
        let found = adjust(work.state.clone(), &work.views, &free, STEPS, token);
        token.check()?;
        let found = found.ok_or(Refusal::NotSettled { lens })?;
        (work.state, converged) = (found.state, found.converged);
        if !turn_over(work) {
            break;
        }
    }
    Ok(converged)
}

/// Replaces poses whose mirrored one explains the corners better; whether there were any.
fn turn_over(work: &mut Work) -> bool {
    let mut turned = false;
    for (view, pose) in work.views.iter().zip(&mut work.state.poses) {
        let camera = &work.state.camera;
        let better = || {
            let error = refined(camera, *pose, &view.corners)?.1;
            refined(camera, mirrored(pose, &view.corners), &view.corners).filter(|other| other.1 < 0.99 * error)
        };
        if let Some((other, _)) = better() {
            *pose = other;
            turned = true;
        }
    }
    turned
}

/// The views that tell most.
fn taken(all: &Work, most: usize, token: &Token) -> Option<Work> {
    let chosen = if all.views.len() > most {
        most_telling(&all.state, &all.views, most, token)?
    } else {
        (0..all.views.len()).collect()
    };
    Some(Work {
        places: chosen.iter().map(|&k| all.places[k]).collect(),
        views: chosen.iter().map(|&k| all.views[k].clone()).collect(),
        state: State { camera: all.state.camera.clone(), poses: chosen.iter().map(|&k| all.state.poses[k]).collect() },
    })
}

/// Judges all corners of the views in work anew.
fn clean(work: &mut Work, given: &[View], rejection: f64) {
    let whole: Vec<View> = work.places.iter().map(|&k| given[k].clone()).collect();
    let kept = kept(&work.state, &whole, limit(&work.state, &whole, rejection));
    let places = work.places.iter().zip(&kept).filter(|(_, view)| view.is_some()).map(|(k, _)| *k).collect();
    let poses = work.state.poses.iter().zip(&kept).filter(|(_, view)| view.is_some()).map(|(p, _)| *p).collect();
    (work.places, work.state.poses) = (places, poses);
    work.views = kept.into_iter().flatten().collect();
}

/// Refuses views in which the panels always face the same way.
fn turned(work: &Work) -> Result<(), Refusal> {
    let normals: Vec<Vector3<f64>> = work.state.poses.iter().map(|p| p.rotation.matrix().column(2).into()).collect();
    let angle = |(k, a): (usize, &Vector3<f64>)| normals[..k].iter().map(|b| a.angle(b)).fold(0.0, f64::max);
    let spread = normals.iter().enumerate().map(angle).fold(0.0, f64::max);
    if spread < LEAST_TURN {
        return Err(Refusal::OneAngle { views: normals.len(), spread_deg: spread.to_degrees() });
    }
    Ok(())
}

/// What is known of the parameters, or the direction that is not determined, in words.
fn held(work: &Work) -> Result<Knowledge, Refusal> {
    let lens = work.state.camera.lens();
    let found = knowledge(&work.state, &work.views).ok_or(Refusal::NotSettled { lens: lens.name() })?;
    found.map_err(|direction| Refusal::Weak { direction: named(&direction, lens.names()) })
}

fn named(direction: &DVector<f64>, names: &[&str]) -> String {
    let largest = direction.amax();
    let told = direction.iter().zip(names).filter(|(share, _)| share.abs() >= NAMED_SHARE * largest);
    told.map(|(_, name)| *name).collect::<Vec<_>>().join(" with ")
}

/// Refuses a focal length that is not known well enough to be of use.
fn certain(camera: &Camera, covariance: &DMatrix<f64>, limit: f64) -> Result<(), Refusal> {
    let share = |k: usize| covariance[(k, k)].sqrt() / camera.parameters()[k];
    let worst = share(0).max(share(1));
    if worst <= limit {
        return Ok(());
    }
    let advice = "tilt the panel by 20 to 45 deg in different directions, come closer, take more views";
    Err(Refusal::Uncertain { percent: 100.0 * worst, limit: 100.0 * limit, advice })
}

fn degrees(work: &Work) -> Option<usize> {
    let corners: usize = work.views.iter().map(|view| view.corners.len()).sum();
    (2 * corners).checked_sub(work.state.camera.count() + 6 * work.views.len()).filter(|&dof| dof > 0)
}

/// One result a view given.
fn results(
    work: &Work,
    given: &[View],
    knowledge: &Knowledge,
    (variance, rejection): (f64, f64),
) -> Vec<Option<ViewResult>> {
    let limit = limit(&work.state, &work.views, rejection);
    let one = |(place, view): (usize, &View)| {
        let known = work.places.iter().position(|&k| k == place).and_then(|k| {
            let (white, covariance) = pose_covariances(&knowledge.blocks[k], &knowledge.covariance)?;
            Some((work.state.poses[k], white * variance, covariance * variance, true))
        });
        let (pose, white, covariance, taken) = known.or_else(|| held_out(work, view, knowledge, variance))?;
        let state = State { camera: work.state.camera.clone(), poses: vec![pose] };
        let used = view.corners.iter().map(|c| misfit(&state, 0, c) <= limit).collect();
        let (residuals, decided) = (residuals(&state, view), decided(&state, view));
        Some(ViewResult { pose, white, covariance, decided, residuals, used, taken })
    };
    given.iter().enumerate().map(one).collect()
}

/// The pose of a view that took no part, with its covariances.
fn held_out(
    work: &Work,
    view: &View,
    knowledge: &Knowledge,
    variance: f64,
) -> Option<(Se3, Matrix6<f64>, Matrix6<f64>, bool)> {
    let enough = view.corners.len() >= LEAST_CORNERS;
    let pose = enough.then(|| both_poses(&work.state.camera, &view.corners))??[0].0;
    let block = super::normal::block(&work.state.camera, &pose, &view.corners)?;
    let (white, covariance) = pose_covariances(&block, &knowledge.covariance)?;
    Some((pose, white * variance, covariance * variance, false))
}

fn residuals(state: &State, view: &View) -> Vec<[f64; 2]> {
    let one = |c: &super::view::Sighting| {
        let seen = state.camera.project(&groma_geometry::LieGroup::act(&state.poses[0], &c.point));
        seen.map_or([f64::NAN; 2], |pixel| (pixel - c.pixel).into())
    };
    view.corners.iter().map(one).collect()
}

fn decided(state: &State, view: &View) -> bool {
    let both = || {
        let error = refined(&state.camera, state.poses[0], &view.corners)?;
        let other = refined(&state.camera, mirrored(&state.poses[0], &view.corners), &view.corners)?;
        Some((error, other))
    };
    both().is_none_or(|(best, other)| {
        let apart = groma_geometry::LieGroup::minus(&best.0.rotation, &other.0.rotation).norm();
        apart < 1e-3 || other.1 >= DECIDED * best.1
    })
}

/// Root mean square length of the residuals: of corners used, and of all, in views that took part.
fn rms(results: &[Option<ViewResult>]) -> (f64, f64) {
    let taken = || results.iter().flatten().filter(|view| view.taken);
    let all = || taken().flat_map(|v| v.residuals.iter().zip(&v.used)).map(|(r, used)| (r[0].hypot(r[1]), *used));
    let root = |values: Vec<f64>| (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt();
    let used = all().filter(|(_, used)| *used).map(|(r, _)| r).collect();
    (root(used), root(all().map(|(r, _)| r).filter(|r| r.is_finite()).collect()))
}

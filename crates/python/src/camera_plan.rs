//! `groma.camera_plan`: a stage and settings as JSON in, drives before one camera as JSON out.

use crate::border::{In1, In2};
use crate::camera::{invalid, parse};
use crate::camera_calibration::sightings;
use crate::gate;
use crate::poses::{in_space, numbers};
use crate::token::{Token, cancelled, interruptible};
use groma_calibration::camera::Sighting;
use groma_geometry::Se2;
use groma_models::{Camera, Target};
use groma_planning::Error;
use groma_planning::camera::{
    Drive, FAN, Judged, Knowledge, Known, Motion, Plan, SIGMA, Search, Sitting, Stage, Tries, mount, next_best,
    nominal_camera, ranking, study, trials, upright_panels,
};
use groma_planning::exploration::Noise;
use nalgebra::DMatrix;
use pyo3::prelude::*;
use serde::Deserialize;
use serde_json::{Value, json};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StageSpec {
    camera: Camera,
    mount: [f64; 7],
    target: Target,
    corner: f64,
}

impl StageSpec {
    fn stage(self) -> PyResult<Stage> {
        Stage::new(self.camera, in_space(self.mount), self.target, self.corner).map_err(invalid)
    }
}

/// What is known of a camera before a drive.
#[derive(Deserialize)]
struct KnownSpec {
    covariance: Option<Vec<Vec<f64>>>,
    views: Vec<usize>,
    looked: Vec<(f64, f64, f64)>,
}

/// Search, trials, nominal camera, target, noise of corners.
#[pyfunction]
pub(crate) fn camera_plan_defaults() -> PyResult<String> {
    let camera = nominal_camera().map_err(invalid)?;
    let (search, tries) = (Search::default(), Tries::default());
    let all = json!({"search": search, "tries": tries, "camera": camera, "target": upright_panels(&FAN), "corner": SIGMA, "sitting": Sitting::default()});
    Ok(all.to_string())
}

/// Position, then x, y, z, w of a camera at a height, pitched down.
#[pyfunction]
pub(crate) fn camera_mount(height: f64, pitch: f64) -> PyResult<[f64; 7]> {
    Ok(numbers(&mount(height, pitch).map_err(invalid)?))
}

/// The next best drives, or a drive given as `poses`. `known` has the covariance of the parameters, or null, the
/// number of corners of each panel seen, and from where; points (N, 3), pixels (N, 2) and sigmas (N) are theirs.
#[pyfunction]
#[pyo3(signature = (stage, start, poses, search, known, points, pixels, sigmas, token=None))]
#[expect(clippy::too_many_arguments, reason = "one argument a part of the request: Python names them")]
pub(crate) fn camera_plan(
    py: Python<'_>,
    stage: &str,
    start: (f64, f64, f64),
    poses: Option<Vec<(f64, f64, f64)>>,
    search: &str,
    known: &str,
    points: In2<'_, f64>,
    pixels: In2<'_, f64>,
    sigmas: In1<'_, f64>,
    token: Option<&Token>,
) -> PyResult<String> {
    let (stage, search) = (parse::<StageSpec>(stage)?.stage()?, parse::<Search>(search)?);
    search.validate().map_err(invalid)?;
    let seen = sightings(&points, &pixels, &sigmas);
    let known: KnownSpec = parse(known)?;
    let looked = known.looked.iter().copied().map(gate::pose).collect::<PyResult<_>>()?;
    let start = gate::pose(start)?;
    let poses = poses.map(|all| all.into_iter().map(gate::pose).collect::<PyResult<Vec<Se2>>>()).transpose()?;
    let before = knowledge(&stage.camera, known, &seen)?;
    let known = Known { knowledge: before.clone(), looked };
    let plan = interruptible(py, token, None, |token| match poses {
        None => next_best(&stage, known, start, &search, token),
        Some(poses) => Plan::along(&stage, known, start, &poses, token),
    })?;
    let plan = plan.map_err(raised)?;
    let content = json!({
        "stops": stops(&plan, &search.noise),
        "met": plan.worst() <= search.target,
        "before": rows(before.covariance()),
        "after": rows(plan.knowledge.covariance()),
        "seen": before.views(),
        "worst_before": before.worst(),
    });
    Ok(content.to_string())
}

/// Common trajectories, best first.
#[pyfunction]
pub(crate) fn camera_ranking(py: Python<'_>, stage: &str, distance: f64, noise: &str) -> PyResult<String> {
    let (stage, noise) = (parse::<StageSpec>(stage)?.stage()?, parse::<Noise>(noise)?);
    let ranked = py.detach(|| ranking(&stage, distance, &noise)).map_err(invalid)?;
    Ok(Value::from(ranked.iter().map(judged).collect::<Vec<_>>()).to_string())
}

/// A common trajectory, tried out.
#[pyfunction]
#[pyo3(signature = (stage, motion, distance, tries, token=None))]
pub(crate) fn camera_trials(
    py: Python<'_>,
    stage: &str,
    motion: &str,
    distance: f64,
    tries: &str,
    token: Option<&Token>,
) -> PyResult<String> {
    let (stage, tries) = (parse::<StageSpec>(stage)?.stage()?, parse::<Tries>(tries)?);
    let motion = parse::<Motion>(&json!(motion).to_string())?;
    let stage = stage.with_target(motion.shown(&stage.target)).map_err(invalid)?;
    let drive = motion.drive(distance, motion.stops());
    let found = interruptible(py, token, None, |token| trials(&stage, &drive, &tries, token))?;
    let found = found.map_err(|_| cancelled())?;
    serde_json::to_string(&found).map_err(invalid)
}

/// A panel held before a camera, tried out.
#[pyfunction]
#[pyo3(signature = (sitting, tries, token=None))]
pub(crate) fn camera_study(py: Python<'_>, sitting: &str, tries: &str, token: Option<&Token>) -> PyResult<String> {
    let (sitting, tries) = (parse::<Sitting>(sitting)?, parse::<Tries>(tries)?);
    let found = interruptible(py, token, None, |token| study(&sitting, &tries, token))?.map_err(raised)?;
    serde_json::to_string(&found).map_err(invalid)
}

fn raised(error: Error) -> PyErr {
    if matches!(error, Error::Cancelled(_)) { cancelled() } else { invalid(error) }
}

fn knowledge(camera: &Camera, known: KnownSpec, seen: &[Sighting]) -> PyResult<Knowledge> {
    let n = camera.count();
    let mut knowledge = match known.covariance {
        None => Knowledge::new(camera),
        Some(rows) => {
            let flat: Vec<f64> = rows.into_iter().flatten().collect();
            let shape = if flat.len() == n * n { (n, n) } else { (0, 0) };
            let covariance = DMatrix::from_row_slice(shape.0, shape.1, &flat[..shape.0 * shape.1]);
            Knowledge::calibrated(camera, &covariance).map_err(invalid)?
        }
    };
    let mut rest = seen;
    for count in known.views {
        let (view, after) = rest.split_at(count.min(rest.len()));
        knowledge.sighted(camera, view);
        rest = after;
    }
    Ok(knowledge)
}

/// x, y, theta, drive, panels seen, worst pixel; distance, effort and variance so far.
fn stops(plan: &Plan, noise: &Noise) -> Vec<Value> {
    let poses = plan.drive().stops;
    let so_far = |k: usize| Drive { stops: poses[..=k].to_vec() };
    let one = |(k, stop): (usize, &groma_planning::camera::Stop)| {
        let (drive, p) = (so_far(k), stop.pose);
        json!({
            "pose": [p.x(), p.y(), p.theta()],
            "leg": stop.leg,
            "views": stop.views,
            "worst": stop.worst,
            "length": drive.length(),
            "effort": drive.effort(),
            "variance": drive.variance(noise),
        })
    };
    plan.stops.iter().enumerate().map(one).collect()
}

fn judged(of: &Judged) -> Value {
    json!({
        "motion": of.motion,
        "shown": of.shown,
        "stops": of.drive.stops.iter().map(|p| [p.x(), p.y(), p.theta()]).collect::<Vec<_>>(),
        "length": of.drive.length(),
        "effort": of.drive.effort(),
        "variance": of.variance,
        "views": of.views,
        "worst": of.worst,
        "sigmas": of.sigmas,
        "degenerate": of.degenerate,
    })
}

fn rows(matrix: Option<DMatrix<f64>>) -> Option<Vec<Vec<f64>>> {
    matrix.map(|m| m.row_iter().map(|row| row.iter().copied().collect()).collect())
}

//! The batch after the filter: all views that were taken, and those that the gate rejected, tried again.
//!
//! A rejected view may have been right and the filter wrong at that moment (a linearisation far off, a loop not closed
//! yet). So the batch is solved with the views taken, then with all; a rejected one stays in when its corners fit as
//! well as chance allows, and the batch is solved once more with those.

use super::Halt;
use super::filtering::Filtered;
use super::judged::Verdict;
use crate::Error;
use crate::batch::{Batch, BatchView, Lens, Solution, State};
use crate::odometry::Motion;
use crate::options::Options;
use groma_estimation::chi_square::passes_gate;
use groma_geometry::{LieGroup, Se3};
use groma_models::Token;
use nalgebra::{DVector, Matrix6, Vector6};

/// Share of true views whose corners fit better: a rejected view must be within it to be taken after all.
const BELIEVABLE: f64 = 1.0 - 1e-6;

/// The batch's end, and which views it holds.
pub(super) struct Refined {
    pub solution: Solution,
    /// Number of the halt of each stop of the batch.
    pub halts: Vec<usize>,
    /// Number of the judged view of each view of the batch.
    pub views: Vec<usize>,
}

pub(super) fn run(
    lenses: &[Lens],
    halts: &[Halt],
    filtered: &Filtered,
    options: &Options,
    token: &Token,
) -> Result<Refined, Error> {
    let solve = |views: &[usize]| problem(lenses, halts, filtered, views, options).solve(token);
    let taken: Vec<usize> = chosen(filtered, |v| matches!(v, Verdict::Taken | Verdict::Born));
    let first = solve(&taken)?;
    let all: Vec<usize> = chosen(filtered, |v| matches!(v, Verdict::Taken | Verdict::Born | Verdict::Rejected));
    if all.len() == taken.len() || options.batch_steps == 0 {
        return Ok(first);
    }
    let trial = match solve(&all) {
        Ok(trial) => trial,
        Err(Error::Cancelled(cancelled)) => return Err(cancelled.into()),
        Err(_) => return Ok(first),
    };
    let fits = |k: &usize| {
        let (chi_square, count) = trial.solution.residuals.views[*k];
        passes_gate(chi_square, count, BELIEVABLE)
    };
    let believed = |k: usize, j: usize| filtered.judged[j].verdict != Verdict::Rejected || fits(&k);
    let kept: Vec<usize> = all.iter().enumerate().filter(|&(k, &j)| believed(k, j)).map(|(_, &j)| j).collect();
    if kept.len() == taken.len() { Ok(first) } else { solve(&kept) }
}

/// The batch of the views that the filter took, and its start.
#[cfg(test)]
pub(super) fn taken(lenses: &[Lens], halts: &[Halt], filtered: &Filtered, options: &Options) -> (Batch, State) {
    let views = chosen(filtered, |v| matches!(v, Verdict::Taken | Verdict::Born));
    let problem = problem(lenses, halts, filtered, &views, options);
    (problem.batch, problem.start)
}

fn chosen(filtered: &Filtered, wanted: impl Fn(Verdict) -> bool) -> Vec<usize> {
    let judged = filtered.judged.iter().enumerate();
    judged.filter(|(_, view)| view.place.is_some() && wanted(view.verdict)).map(|(k, _)| k).collect()
}

/// A batch with its start.
struct Problem {
    batch: Batch,
    start: State,
    halts: Vec<usize>,
    views: Vec<usize>,
}

impl Problem {
    fn solve(self, token: &Token) -> Result<Refined, Error> {
        let solution = self.batch.solve(self.start, token)?;
        Ok(Refined { solution, halts: self.halts, views: self.views })
    }
}

fn problem(lenses: &[Lens], halts: &[Halt], filtered: &Filtered, views: &[usize], options: &Options) -> Problem {
    let judged = |k: &usize| &filtered.judged[*k];
    let mut used: Vec<usize> = views.iter().map(|k| judged(k).stop).chain([0]).collect();
    used.sort_unstable();
    used.dedup();
    let place_of = |stop: usize| used.binary_search(&stop).unwrap_or(0);
    let batch_view = |k: &usize| {
        let view = judged(k);
        let seen = halts[view.stop].seen.iter().find(|seen| seen.camera == view.camera);
        let corners = seen.map_or_else(Vec::new, |seen| seen.corners.clone());
        BatchView { stop: place_of(view.stop), place: view.place.unwrap_or(0), lens: view.camera, corners }
    };
    let between = |pair: &[usize]| {
        let steps = halts[pair[0] + 1..=pair[1]].iter().flat_map(|halt| &halt.steps);
        steps.fold(Motion::default(), |motion, step| motion.then(step, &options.odometry))
    };
    let sigmas = Vector6::from(options.mount.sigmas());
    let batch = Batch {
        motions: used.windows(2).map(between).collect(),
        floor: options.floor,
        lenses: lenses.to_vec(),
        views: views.iter().map(batch_view).collect(),
        mount: (Se3::identity(), Matrix6::from_diagonal(&sigmas.component_mul(&sigmas))),
        slack: [options.view.position, options.view.rotation],
        iterations: options.batch_steps,
    };
    let start = start(lenses, filtered, views, &used);
    Problem { batch, start, halts: used, views: views.to_vec() }
}

/// The filter's cameras, and each stop where the camera that saw the target best has it.
fn start(lenses: &[Lens], filtered: &Filtered, views: &[usize], used: &[usize]) -> State {
    let cameras = filtered.filter.cameras();
    let mount = *filtered.filter.mount();
    let mut calibrations: Vec<DVector<f64>> = lenses.iter().map(|lens| DVector::zeros(lens.basis.ncols())).collect();
    for (place, camera) in filtered.places.iter().zip(cameras) {
        calibrations[place.camera] = camera.calibration.clone();
    }
    let mut stops = vec![Se3::identity(); used.len()];
    for &k in views {
        let view = &filtered.judged[k];
        let (Some(place), Ok(stop)) = (view.place, used.binary_search(&view.stop)) else { continue };
        stops[stop] = cameras[place].pose * filtered.poses[k] * mount.inverse();
    }
    State { stops, places: cameras.iter().map(|c| c.pose).collect(), calibrations, mount }
}

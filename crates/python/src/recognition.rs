//! `groma.recognition`: scans pushed in order of time, then one call a step, so that each can be timed.

use crate::border::{self, In1};
use crate::gate;
use crate::token::interruptible;
use groma_features::glarot::Candidate;
use groma_geometry::Se2;
use groma_mapping::recognition::{Loop, Options, Proposal, Recognizer as Core, Verdict, Verified};
use groma_models::Cancelled;
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;

/// The settings of place recognition and their defaults, as JSON.
#[pyfunction]
pub(crate) fn recognition_defaults() -> PyResult<String> {
    border::json(&Options::default())
}

/// Finds places again; the steps are called in the order in which they stand here.
#[pyclass(module = "groma._core")]
pub(crate) struct Recognizer {
    core: Core,
    candidates: Vec<Vec<Candidate>>,
    proposals: Vec<Vec<Proposal>>,
    verified: Vec<Vec<Verified>>,
}

/// x, y, theta.
type Pose = (f64, f64, f64);

/// Earlier map, later map, `T_from_to`, why not accepted, pairs, overlap, share, common.
type Row = (usize, usize, Pose, &'static str, usize, f64, f64, f64);

#[pymethods]
impl Recognizer {
    #[new]
    fn new(options: &str) -> PyResult<Self> {
        let options: Options = serde_json::from_str(options).map_err(|e| PyValueError::new_err(e.to_string()))?;
        options.validate().map_err(|e| PyValueError::new_err(e.to_string()))?;
        Ok(Self { core: Core::new(options), candidates: vec![], proposals: vec![], verified: vec![] })
    }

    /// Whether the scan was used. `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`,
    /// `mount` the pose `(x, y, yaw)` of the laser on the vehicle.
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: In1<'_, f64>,
        beams: gate::Beams,
        mount: Pose,
    ) -> PyResult<bool> {
        let (scan, mount) = (gate::scan(stamp, &ranges, beams)?, gate::pose(mount)?);
        Ok(py.detach(|| self.core.push_scan(&scan, &mount)))
    }

    /// Of every scan used: pose as tracked, keyframe, path driven up to that.
    fn scans(&self) -> Vec<(Pose, usize, f64)> {
        self.core.scans().iter().map(|s| (pose(&s.tracked), s.keyframe, self.core.driven(s))).collect()
    }

    /// Makes the local maps. Of each: its first and last keyframe, its number of corners.
    fn describe(&mut self, py: Python<'_>) -> PyResult<Vec<(usize, usize, usize)>> {
        done(interruptible(py, None, None, |token| self.core.describe(token))?)?;
        let row = |m: &groma_mapping::local_map::LocalMap| (m.keyframes.start, m.keyframes.end - 1, m.corners.len());
        Ok(self.core.maps().iter().map(row).collect())
    }

    /// For every local map, earlier ones that look like it, with their distance.
    fn retrieve(&mut self, py: Python<'_>) -> PyResult<Vec<Vec<(usize, f64)>>> {
        self.candidates = done(interruptible(py, None, None, |token| self.core.retrieve(token))?)?;
        Ok(self.candidates.iter().map(|c| c.iter().map(|c| (c.index, c.distance)).collect()).collect())
    }

    /// For every local map, the motions `(place, T_place_map, pairs)` with most pairs.
    fn associate(&mut self, py: Python<'_>) -> PyResult<Vec<Vec<(usize, Pose, usize)>>> {
        self.proposals = done(interruptible(py, None, None, |token| self.core.associate(&self.candidates, token))?)?;
        Ok(self.proposals.iter().map(|p| p.iter().map(|p| (p.place, pose(&p.motion), p.pairs)).collect()).collect())
    }

    /// Shows the motions to surfaces and views.
    fn verify(&mut self, py: Python<'_>) -> PyResult<()> {
        self.verified = done(interruptible(py, None, None, |token| self.core.verify(&self.proposals, token))?)?;
        Ok(())
    }

    /// The closures considered, one a local map at most.
    fn decide(&mut self, py: Python<'_>) -> Vec<Row> {
        py.detach(|| self.core.decide(&self.verified)).iter().map(row).collect()
    }
}

/// Only Ctrl-C cancels, and raises its own exception before.
fn done<T>(outcome: Result<T, Cancelled>) -> PyResult<T> {
    outcome.map_err(|e| PyKeyboardInterrupt::new_err(e.to_string()))
}

fn pose(p: &Se2) -> Pose {
    (p.x(), p.y(), p.theta())
}

fn row(l: &Loop) -> Row {
    let (check, pairs) = (&l.verified.check, l.verified.proposal.pairs);
    (l.from, l.to, pose(&check.pose), word(l.verdict), pairs, check.overlap, check.share, check.common)
}

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Accepted => "",
        Verdict::Unconfirmed => "no second closure agrees",
        Verdict::NoOverlap => "the views disagree",
        Verdict::TooLittle => "too little in common view",
        Verdict::Ambiguous => "it fits in two places",
        Verdict::Slides => "a direction is unconstrained",
    }
}

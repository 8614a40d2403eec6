//! The result of mapping: values only.

use crate::closure::{Closure, Verdict};
use crate::pose_graph::PoseGraph;
use crate::weak::{Reason, WeakSpot};
use groma_geometry::{Se2, Separation};
use groma_models::{Grid, LandmarkMap};
use groma_tracking::Overruled;
use nalgebra::{Matrix3, Vector3};

/// Views that agree this close to where the graph has them show the same place [m], [rad].
const SAME_PLACE: (f64, f64) = (1.0, 0.2);

/// What an edge of the final graph represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// The step between successive keyframes: registration and odometry.
    Step,
    /// A loop closure.
    Closure,
}

/// A candidate for a loop closure, and the keyframes that anchor its two local maps.
#[derive(Clone, Debug)]
pub struct AnchoredClosure {
    /// What was found of it.
    pub closure: Closure,
    /// Keyframe that anchors the earlier local map.
    pub from: usize,
    /// Keyframe that anchors the later one.
    pub to: usize,
}

/// A map and how it came about.
pub struct MapResult {
    /// Keyframe stamps [s].
    pub stamps: Vec<f64>,
    /// The graph at its optimum.
    pub graph: PoseGraph,
    /// What its edges represent.
    pub kinds: Vec<EdgeKind>,
    /// Their squared Mahalanobis residuals.
    pub chi_squares: Vec<f64>,
    /// Covariance of each node relative to the first, right perturbation.
    pub covariances: Vec<Matrix3<f64>>,
    /// The vehicle at the rate of the odometry: stamp, final pose.
    pub trajectory: Vec<(f64, Se2)>,
    /// The same from registration alone, before any closure.
    pub tracked: Vec<Se2>,
    /// The same from odometry alone; empty without odometry.
    pub odometry: Vec<Se2>,
    /// What became of the candidates for loop closures.
    pub closures: Vec<AnchoredClosure>,
    /// Scans that were registered without odometry though there was some: it failed.
    pub overruled: Option<Overruled>,
    /// Candidates with too little in common view to tell.
    pub undecided: usize,
    /// Occupancy.
    pub grid: Grid,
    /// Corners.
    pub landmarks: LandmarkMap,
    /// Where the map is poorly held.
    pub weak: Vec<WeakSpot>,
    /// Local maps.
    pub local_maps: usize,
    /// The laser's place against the odometry as learned, beyond the mount that was given: pose and its standard deviations.
    pub offset: (Se2, Vector3<f64>),
    /// Whether there was odometry.
    pub has_odometry: bool,
    /// The cell that was requested [m]; that of the grid is larger where the map is too large for it.
    pub wanted_resolution: f64,
    /// The conclusion was cancelled: this is the graph as it stood, not all pairs of local maps were gone over.
    pub is_interrupted: bool,
}

impl MapResult {
    /// Residual of a closure after optimisation, in the directions that it determines.
    #[must_use]
    pub fn residual(&self, closed: &AnchoredClosure) -> Separation {
        closed.closure.residual(&self.between(closed))
    }

    /// The pose of the later anchor of a closure, seen from the earlier one.
    fn between(&self, closed: &AnchoredClosure) -> Se2 {
        self.graph.nodes[closed.from].between(&self.graph.nodes[closed.to])
    }

    /// Accepted closures with the keyframes that anchor their local maps.
    pub fn accepted(&self) -> impl Iterator<Item = &AnchoredClosure> {
        self.closures.iter().filter(|closed| closed.closure.verdict == Verdict::Accepted)
    }

    /// Closures whose views agree and that the graph of all keyframes cannot meet: they were accepted and left out again, or lie
    /// just beyond what the graph allows. What lies far beyond is another place that looks alike.
    pub fn violated(&self) -> impl Iterator<Item = &AnchoredClosure> {
        self.closures.iter().filter(|closed| self.is_violated(closed))
    }

    fn is_violated(&self, closed: &AnchoredClosure) -> bool {
        let closure = &closed.closure;
        let is_unmet = !closure.is_met(&self.between(closed));
        let moved = closure.predicted.between(&closure.check.pose);
        match closure.verdict {
            Verdict::Violated => true,
            Verdict::Contradicted => is_unmet,
            Verdict::Implausible => {
                is_unmet && moved.translation.norm() < SAME_PLACE.0 && moved.theta().abs() < SAME_PLACE.1
            }
            _ => false,
        }
    }

    /// Length of the path through the keyframes [m].
    #[must_use]
    pub fn path_length(&self) -> f64 {
        self.graph.nodes.windows(2).map(|w| (w[1].translation - w[0].translation).norm()).sum()
    }

    /// Numbers of the run under the names that files give them.
    #[must_use]
    pub fn counts(&self) -> Vec<(&'static str, f64)> {
        let accepted = self.accepted().count();
        let (offset, sigmas) = &self.offset;
        let torn = self.weak.iter().filter(|w| w.reason == Reason::Torn).count();
        vec![
            ("keyframes", self.stamps.len() as f64),
            ("local_maps", self.local_maps as f64),
            ("closures_accepted", accepted as f64),
            ("closures_rejected", (self.closures.len() - accepted) as f64),
            ("closure_candidates_with_too_little_in_common_view", self.undecided as f64),
            ("scans_whose_odometry_failed", self.overruled.map_or(0, |o| o.scans) as f64),
            ("torn_stretches", torn as f64),
            ("path_m", self.path_length()),
            ("laser_offset_x_m", offset.x()),
            ("laser_offset_y_m", offset.y()),
            ("laser_offset_yaw_rad", offset.theta()),
            ("laser_offset_x_sigma_m", sigmas.x),
            ("laser_offset_y_sigma_m", sigmas.y),
            ("laser_offset_yaw_sigma_rad", sigmas.z),
        ]
    }
}

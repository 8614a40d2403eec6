//! The result of mapping: values only.

use crate::closure::Closure;
use crate::pose_graph::PoseGraph;
use crate::weak::WeakSpot;
use groma_geometry::Se2;
use groma_models::{Grid, LandmarkMap};
use nalgebra::{Matrix3, Vector3};

/// What an edge of the final graph stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeKind {
    /// The step between successive keyframes: registration and odometry.
    Step,
    /// A loop closure.
    Closure,
}

/// A map and how it came about.
pub struct MapResult {
    /// Keyframe stamps [s].
    pub stamps: Vec<f64>,
    /// The graph at its optimum.
    pub graph: PoseGraph,
    /// What its edges stand for.
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
    /// What became of the candidates for loop closures, and the keyframes that anchor the two local maps.
    pub closures: Vec<(Closure, usize, usize)>,
    /// Scans that were registered without odometry though there was some: it failed.
    pub unaided: usize,
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
}

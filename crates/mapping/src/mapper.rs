//! The whole of mapping: scans and odometry in, a map out.
//!
//! ```text
//! scan -> tracker -> keyframes -> local maps -> closures -> pose graph of all keyframes -> trajectory, grid, landmarks
//! ```
//!
//! Scans and odometry are pushed in order of time, the odometry up to the end of a scan before the scan. Each step looks at the past
//! only; [`Mapper::finish`] may be called at any time and gives a finished map of what was pushed. Offline (the default) it
//! first goes over all pairs of local maps again.

use crate::closer::Closer;
use crate::closure::Verdict;
use crate::finder::Finder;
use crate::keyframe::Keyframe;
use crate::landmarks::landmarks;
use crate::local_map::{LocalMap, link};
use crate::map_result::{EdgeKind, MapResult};
use crate::occupancy::occupancy;
use crate::options::Options;
use crate::pose_graph::{self, Edge, PoseGraph};
use crate::tracker::{Finished, Tracker};
use crate::trajectory::{ahead, at_odometry_rate};
use crate::weak::weak_spots;
use groma_geometry::Se2;
use groma_models::{LaserScan, Odometry, OdometryTrack};
use groma_registration::PolarView;
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;

/// A scan with fewer hits says nothing of where it was taken.
const LEAST_HITS: usize = 10;
/// A closure of which more is left after optimisation is false [m], [rad] (W. Hess et al., ICRA 2016, table IV).
const VIOLATED: (f64, f64) = (0.2, 0.0175);
/// Odometry counts for stamps this far beyond its ends [s].
const SLACK: f64 = 0.3;

/// Why a scan was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Skipped {
    /// Its stamp is not after that of the scan before.
    Late,
    /// It has fewer than ten hits.
    Empty,
}

/// A scan and the keyframe its pose hangs on.
struct Placed {
    stamp: f64,
    keyframe: usize,
    t_keyframe_scan: Se2,
    online: Se2,
    /// The laser's place against the odometry as it was known then.
    offset: Se2,
}

/// Builds a map from scans and odometry.
pub struct Mapper {
    options: Options,
    track: OdometryTrack,
    tracker: Tracker,
    finder: Finder,
    keyframes: Vec<Keyframe>,
    closer: Closer,
    placed: Vec<Placed>,
    /// Scans whose odometry is not complete yet.
    waiting: VecDeque<(LaserScan, Se2)>,
    newest: f64,
}

impl Mapper {
    /// An empty map.
    #[must_use]
    pub fn new(options: Options) -> Self {
        Self {
            finder: Finder::new(&options),
            options,
            track: OdometryTrack::default(),
            tracker: Tracker::default(),
            keyframes: Vec::new(),
            closer: Closer::default(),
            placed: Vec::new(),
            waiting: VecDeque::new(),
            newest: f64::NEG_INFINITY,
        }
    }

    /// Takes an odometry reading; false if its stamp does not rise or it is not finite.
    pub fn push_odometry(&mut self, reading: Odometry) -> bool {
        let taken = self.track.push(reading);
        self.work_off(false);
        taken
    }

    /// Number of keyframes, of local maps and of accepted closures so far.
    #[must_use]
    pub fn progress(&self) -> (usize, usize, usize) {
        let closed = self.closer.closures.iter().filter(|c| c.verdict == Verdict::Accepted).count();
        (self.keyframes.len(), self.closer.maps.len(), closed)
    }

    /// Takes a scan of a laser mounted at `t_base_laser`. It waits until the odometry has reached its last beam.
    ///
    /// # Errors
    /// [`Skipped`] when the scan cannot be used; nothing has changed then.
    pub fn push_scan(&mut self, scan: LaserScan, t_base_laser: Se2) -> Result<(), Skipped> {
        if !scan.stamp.is_finite() || scan.stamp <= self.newest {
            return Err(Skipped::Late);
        }
        if !has_hits(&scan) {
            return Err(Skipped::Empty);
        }
        self.newest = scan.stamp;
        self.waiting.push_back((scan, t_base_laser));
        self.work_off(false);
        Ok(())
    }

    /// Registers the scans whose odometry is complete, or all of them.
    fn work_off(&mut self, all: bool) {
        while let Some((scan, _)) = self.waiting.front() {
            let end = scan.stamp.max(scan.beam_stamp(scan.ranges.len().saturating_sub(1)));
            let still_to_come = |r: &Odometry| r.stamp < end && end < r.stamp + SLACK && self.newest < end + SLACK;
            if !all && self.track.readings().last().is_some_and(still_to_come) {
                break;
            }
            if let Some((scan, mount)) = self.waiting.pop_front() {
                self.register(&scan, &mount);
            }
        }
    }

    fn register(&mut self, scan: &LaserScan, t_base_laser: &Se2) {
        let view = PolarView::new(scan, t_base_laser, self.twist(scan));
        let increment = self.increment(scan.stamp);
        let step = self.tracker.step(scan.stamp, view, increment, &mut self.keyframes);
        if let Some(keyframe) = self.keyframes.last_mut().filter(|_| step.is_keyframe) {
            self.finder.find(scan, keyframe);
        }
        if let Some(finished) = step.finished {
            self.add_local_map(finished);
        }
        self.place(scan.stamp, &step.pose);
    }

    /// The twist of the vehicle during a sweep: from odometry, or as tracked.
    fn twist(&self, scan: &LaserScan) -> Vector3<f64> {
        let sweep = scan.geometry.time_increment * scan.ranges.len().saturating_sub(1) as f64;
        if sweep == 0.0 {
            return Vector3::zeros();
        }
        let covered = |t: f64| self.track.at(t).filter(|_| self.covers(t));
        match (covered(scan.stamp), covered(scan.stamp + sweep)) {
            (Some(a), Some(b)) => self.tracker.offset().apply(&a.between(&b)).log() / sweep,
            _ => self.tracker.velocity(),
        }
    }

    /// The odometry since the last scan, if it covers both ends.
    fn increment(&self, stamp: f64) -> Option<Se2> {
        let last = self.placed.last()?.stamp;
        let covered = self.covers(last) && self.covers(stamp);
        covered.then(|| Some(self.track.at(last)?.between(&self.track.at(stamp)?))).flatten()
    }

    fn covers(&self, stamp: f64) -> bool {
        let readings = self.track.readings();
        match (readings.first(), readings.last()) {
            (Some(a), Some(b)) => stamp > a.stamp - SLACK && stamp < b.stamp + SLACK,
            _ => false,
        }
    }

    fn add_local_map(&mut self, finished: Finished) {
        let map = LocalMap::new(finished, &self.keyframes);
        if let Some(last) = self.closer.maps.last_mut() {
            link(last, &map, &self.keyframes);
        }
        self.closer.add(map);
        self.closer.close(self.closer.maps.len() - 1, &self.keyframes);
    }

    fn place(&mut self, stamp: f64, tracked: &Se2) {
        let keyframe = self.keyframes.len() - 1;
        let t_keyframe_scan = self.keyframes[keyframe].tracked.between(tracked);
        let online = match (self.closer.maps.last(), self.closer.poses.last()) {
            (Some(map), Some(pose)) => *pose * map.anchor.between(tracked),
            _ => *tracked,
        };
        self.placed.push(Placed { stamp, keyframe, t_keyframe_scan, online, offset: self.tracker.offset().pose() });
    }

    /// The map of what was pushed.
    ///
    /// # Errors
    /// When no scan could be used, or the pose graph cannot be solved.
    pub fn finish(mut self) -> Result<MapResult, Error> {
        self.work_off(true);
        if self.keyframes.is_empty() {
            return Err(Error::NoScan);
        }
        if let Some(finished) = self.tracker.finish(self.keyframes.len()) {
            self.add_local_map(finished);
        }
        if !self.options.online {
            self.closer.revisit(&self.keyframes);
        }
        let (graph, kinds, chi_squares) = self.settle()?;
        let covariances = graph.marginals(&vec![1.0; graph.edges.len()])?;
        Ok(self.assemble(graph, kinds, chi_squares, covariances))
    }

    /// Arranges the keyframes, leaving out closures until none is left that the others contradict.
    fn settle(&mut self) -> Result<(PoseGraph, Vec<EdgeKind>, Vec<f64>), Error> {
        loop {
            let (mut graph, kinds) = self.graph();
            let solution = graph.optimize(&pose_graph::Options::default())?;
            graph.nodes = solution.nodes;
            if self.reject(&graph.nodes, &solution.weights) == 0 {
                return Ok((graph, kinds, solution.chi_squares));
            }
        }
    }

    /// Marks the closures that the graph of all keyframes left out or cannot meet, and counts them; closures are its last
    /// edges.
    fn reject(&mut self, nodes: &[Se2], weights: &[f64]) -> usize {
        let steps = self.keyframes.len() - 1;
        let anchors: Vec<usize> = self.closer.maps.iter().map(|m| m.keyframes.start).collect();
        let accepted = self.closer.closures.iter_mut().filter(|c| c.verdict == Verdict::Accepted);
        let mut rejected = 0;
        for (closure, weight) in accepted.zip(&weights[steps..]) {
            let (metres, radians) =
                closure.residual(&nodes[anchors[closure.from]].between(&nodes[anchors[closure.to]]));
            if *weight == 0.0 || metres > VIOLATED.0 || radians > VIOLATED.1 {
                closure.verdict = Verdict::Contradicted;
                rejected += 1;
            }
        }
        rejected
    }

    /// The graph of all keyframes: steps and closures.
    fn graph(&self) -> (PoseGraph, Vec<EdgeKind>) {
        let mut edges = Vec::new();
        for k in 1..self.keyframes.len() {
            let measurement = self.keyframes[k - 1].tracked.between(&self.keyframes[k].tracked);
            let information = self.keyframes[k].step.try_inverse().unwrap_or_else(Matrix3::identity);
            edges.push(Edge { from: k - 1, to: k, measurement, information, robust: false });
        }
        let mut kinds = vec![EdgeKind::Step; edges.len()];
        for c in self.closer.closures.iter().filter(|c| c.verdict == Verdict::Accepted) {
            edges.push(Edge {
                from: self.closer.maps[c.from].keyframes.start,
                to: self.closer.maps[c.to].keyframes.start,
                measurement: c.check.pose,
                information: c.information(),
                robust: true,
            });
            kinds.push(EdgeKind::Closure);
        }
        (PoseGraph { nodes: self.keyframe_poses(), edges }, kinds)
    }

    /// Keyframes as the pose graph of local maps places them.
    fn keyframe_poses(&self) -> Vec<Se2> {
        let mut poses: Vec<Se2> = self.keyframes.iter().map(|k| k.tracked).collect();
        for (map, pose) in self.closer.maps.iter().zip(&self.closer.poses) {
            for k in map.keyframes.clone() {
                poses[k] = *pose * map.anchor.between(&self.keyframes[k].tracked);
            }
        }
        poses
    }

    fn assemble(
        self,
        graph: PoseGraph,
        kinds: Vec<EdgeKind>,
        chi_squares: Vec<f64>,
        covariances: Vec<Matrix3<f64>>,
    ) -> MapResult {
        let offset = self.tracker.offset();
        let shift = |u: &Se2| offset.apply(u);
        let scans = |pose: &dyn Fn(&Placed) -> Se2| self.placed.iter().map(|p| (p.stamp, pose(p))).collect::<Vec<_>>();
        let tracked = scans(&|p| self.keyframes[p.keyframe].tracked * p.t_keyframe_scan);
        let trajectory = if self.options.online {
            let offsets: Vec<Se2> = self.placed.iter().map(|p| p.offset).collect();
            ahead(&scans(&|p| p.online), &offsets, &self.track)
        } else {
            at_odometry_rate(&scans(&|p| graph.nodes[p.keyframe] * p.t_keyframe_scan), &self.track, shift)
        };
        let odometry = odometry_alone(&trajectory, &self.track, shift);
        MapResult {
            stamps: self.keyframes.iter().map(|k| k.stamp).collect(),
            tracked: at_odometry_rate(&tracked, &self.track, shift).into_iter().map(|(_, p)| p).collect(),
            odometry,
            trajectory,
            grid: occupancy(&self.keyframes, &graph.nodes, self.options.resolution),
            landmarks: landmarks(&self.keyframes, &graph.nodes, &covariances),
            weak: weak_spots(&self.keyframes, &graph.nodes),
            local_maps: self.closer.maps.len(),
            offset: (offset.pose(), offset.sigmas()),
            unaided: self.tracker.unaided(),
            undecided: self.closer.closures.iter().filter(|c| c.verdict == Verdict::TooLittle).count(),
            closures: self
                .closer
                .closures
                .iter()
                .filter(|c| c.verdict != Verdict::TooLittle)
                .map(|c| {
                    let anchor = |m: usize| self.closer.maps[m].keyframes.start;
                    (c.clone(), anchor(c.from), anchor(c.to))
                })
                .collect(),
            graph,
            kinds,
            chi_squares,
            covariances,
        }
    }
}

/// Whether a scan says anything of where it was taken.
pub(crate) fn has_hits(scan: &LaserScan) -> bool {
    scan.hits().take(LEAST_HITS).count() == LEAST_HITS
}

/// The path that odometry alone gives, started at the first pose of the trajectory.
fn odometry_alone(trajectory: &[(f64, Se2)], track: &OdometryTrack, shift: impl Fn(&Se2) -> Se2) -> Vec<Se2> {
    let Some((start, first)) = trajectory.first().and_then(|(t, p)| Some((track.at(*t)?, p))) else {
        return Vec::new();
    };
    let at = |t: f64| track.at(t).unwrap_or(start);
    trajectory.iter().map(|(t, _)| *first * shift(&start.between(&at(*t)))).collect()
}

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No scan could be used.
    #[error("no scan could be used: there is nothing to map")]
    NoScan,
    /// The pose graph could not be solved.
    #[error("the pose graph could not be solved: {0}")]
    Graph(#[from] pose_graph::Error),
}

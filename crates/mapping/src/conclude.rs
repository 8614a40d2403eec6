//! From what was pushed to a finished map, at any time.
//!
//! Offline (the default) all pairs of local maps are gone over again first. Then the keyframes are arranged by steps and
//! closures, leaving out closures until none is left that the others contradict. A cancelled conclusion does neither: it is
//! the graph as it stands, with its grid and its landmarks.

use crate::closer::Closer;
use crate::closure::{Closure, Verdict};
use crate::landmarks::landmarks;
use crate::local_map::LocalMap;
use crate::map_result::{EdgeKind, MapResult};
use crate::mapper::{Mapper, Placed};
use crate::occupancy::occupancy;
use crate::pose_graph::{self, Edge, PoseGraph};
use crate::trajectory::{ahead, at_odometry_rate};
use crate::weak::weak_spots;
use groma_geometry::Se2;
use groma_models::{Cancelled, OdometryTrack, Token};
use nalgebra::Matrix3;

/// A closure of which more is left after optimisation is violated [m], [rad] (W. Hess et al., ICRA 2016, table IV).
pub const VIOLATED: (f64, f64) = (0.2, 0.0175);

/// Why there is no map.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// No scan could be used.
    #[error("no scan could be used: there is nothing to map")]
    NoScan,
    /// The pose graph could not be solved.
    #[error("the pose graph could not be solved: {0}")]
    Graph(#[from] pose_graph::Error),
    /// Cancelled where nothing can be kept.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl Mapper {
    /// The map of what was pushed. Cancelled, it is that of the graph as it stands: [`MapResult::is_interrupted`].
    ///
    /// # Errors
    /// When no scan could be used, or the pose graph cannot be solved.
    pub fn finish(&self, token: &Token) -> Result<MapResult, Error> {
        if self.keyframes.is_empty() {
            return Err(Error::NoScan);
        }
        let mut closer = self.closer.clone();
        if let Some(finished) = self.tracker.rest(self.keyframes.len()) {
            closer.add(LocalMap::new(finished, &self.keyframes), &self.keyframes);
        }
        let mut ending = Ending { mapper: self, closer };
        let (graph, kinds, is_interrupted) = match ending.arrange(token) {
            Ok((graph, kinds)) => (graph, kinds, false),
            Err(pose_graph::Error::Cancelled(_)) => {
                let (graph, kinds) = ending.graph();
                (graph, kinds, true)
            }
            Err(error) => return Err(error.into()),
        };
        ending.assemble(graph, kinds, is_interrupted)
    }
}

/// A mapper that is left as it is, and its local maps, which change.
struct Ending<'a> {
    mapper: &'a Mapper,
    closer: Closer,
}

impl Ending<'_> {
    /// Looks for closures and arranges all keyframes.
    fn arrange(&mut self, token: &Token) -> Result<(PoseGraph, Vec<EdgeKind>), pose_graph::Error> {
        let keyframes = &self.mapper.keyframes;
        if let Some(last) = self.closer.maps.len().checked_sub(1) {
            self.closer.close(last, keyframes, token)?;
        }
        if !self.mapper.options.online {
            self.closer.revisit(keyframes, token)?;
        }
        self.settle(token)
    }

    /// Arranges the keyframes, leaving out closures until none is left that the others contradict.
    fn settle(&mut self, token: &Token) -> Result<(PoseGraph, Vec<EdgeKind>), pose_graph::Error> {
        loop {
            let (mut graph, kinds) = self.graph();
            let solution = graph.optimize(&pose_graph::Options::default(), token)?;
            graph.nodes = solution.nodes;
            if self.reject(&graph.nodes, &solution.weights) == 0 {
                return Ok((graph, kinds));
            }
        }
    }

    /// Marks the closures that the graph of all keyframes left out or cannot meet, and counts them; closures are its last
    /// edges.
    fn reject(&mut self, nodes: &[Se2], weights: &[f64]) -> usize {
        let steps = self.mapper.keyframes.len() - 1;
        let anchors: Vec<usize> = self.closer.maps.iter().map(|m| m.keyframes.start).collect();
        let accepted = self.closer.closures.iter_mut().filter(|c| c.verdict == Verdict::Accepted);
        let mut rejected = 0;
        for (closure, weight) in accepted.zip(&weights[steps..]) {
            let (metres, radians) =
                closure.residual(&nodes[anchors[closure.from]].between(&nodes[anchors[closure.to]]));
            if *weight == 0.0 || metres > VIOLATED.0 || radians > VIOLATED.1 {
                closure.verdict = Verdict::Violated;
                rejected += 1;
            }
        }
        rejected
    }

    /// The graph of all keyframes: steps and closures.
    fn graph(&self) -> (PoseGraph, Vec<EdgeKind>) {
        let keyframes = &self.mapper.keyframes;
        let step = |k: usize| Edge {
            from: k - 1,
            to: k,
            measurement: keyframes[k - 1].tracked.between(&keyframes[k].tracked),
            information: keyframes[k].step.try_inverse().unwrap_or_else(Matrix3::identity),
            robust: false,
        };
        let mut edges: Vec<Edge> = (1..keyframes.len()).map(step).collect();
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
        let keyframes = &self.mapper.keyframes;
        let mut poses: Vec<Se2> = keyframes.iter().map(|k| k.tracked).collect();
        for (map, pose) in self.closer.maps.iter().zip(&self.closer.poses) {
            for k in map.keyframes.clone() {
                poses[k] = *pose * map.anchor.between(&keyframes[k].tracked);
            }
        }
        poses
    }

    /// What became of the candidates for loop closures, and the keyframes that anchor the two local maps.
    fn closures(&self) -> Vec<(Closure, usize, usize)> {
        let anchor = |m: usize| self.closer.maps[m].keyframes.start;
        let told = self.closer.closures.iter().filter(|c| c.verdict != Verdict::TooLittle);
        told.map(|c| (c.clone(), anchor(c.from), anchor(c.to))).collect()
    }

    /// The values of the result. The graph is drawn into grid and landmarks whether anybody waits or not: they are what is
    /// kept of an interrupted run.
    fn assemble(&self, graph: PoseGraph, kinds: Vec<EdgeKind>, is_interrupted: bool) -> Result<MapResult, Error> {
        let (mapper, keyframes) = (self.mapper, &self.mapper.keyframes);
        let covariances = graph.marginals(&vec![1.0; graph.edges.len()])?;
        let offset = mapper.tracker.offset();
        let shift = |u: &Se2| offset.apply(u);
        let scans =
            |pose: &dyn Fn(&Placed) -> Se2| mapper.placed.iter().map(|p| (p.stamp, pose(p))).collect::<Vec<_>>();
        let tracked = scans(&|p| keyframes[p.keyframe].tracked * p.t_keyframe_scan);
        let trajectory = if mapper.options.online {
            let offsets: Vec<Se2> = mapper.placed.iter().map(|p| p.offset).collect();
            ahead(&scans(&|p| p.online), &offsets, &mapper.track)
        } else {
            at_odometry_rate(&scans(&|p| graph.nodes[p.keyframe] * p.t_keyframe_scan), &mapper.track, shift)
        };
        let drawing = Token::new();
        Ok(MapResult {
            stamps: keyframes.iter().map(|k| k.stamp).collect(),
            tracked: at_odometry_rate(&tracked, &mapper.track, shift).into_iter().map(|(_, p)| p).collect(),
            odometry: odometry_alone(&trajectory, &mapper.track, shift),
            trajectory,
            grid: occupancy(keyframes, &graph.nodes, mapper.options.resolution, &drawing)?,
            landmarks: landmarks(keyframes, &graph.nodes, &covariances, &drawing)?,
            weak: weak_spots(keyframes, &graph.nodes),
            chi_squares: graph.chi_squares(),
            graph,
            kinds,
            covariances,
            local_maps: self.closer.maps.len(),
            offset: (offset.pose(), offset.sigmas()),
            overruled: mapper.tracker.overruled(),
            undecided: self.closer.closures.iter().filter(|c| c.verdict == Verdict::TooLittle).count(),
            closures: self.closures(),
            has_odometry: mapper.track.readings().len() > 1,
            wanted_resolution: mapper.options.resolution,
            is_interrupted,
        })
    }
}

/// The path that odometry alone gives, started at the first pose of the trajectory.
fn odometry_alone(trajectory: &[(f64, Se2)], track: &OdometryTrack, shift: impl Fn(&Se2) -> Se2) -> Vec<Se2> {
    let Some((start, first)) = trajectory.first().and_then(|(t, p)| Some((track.at(*t)?, p))) else {
        return Vec::new();
    };
    let at = |t: f64| track.at(t).unwrap_or(start);
    trajectory.iter().map(|(t, _)| *first * shift(&start.between(&at(*t)))).collect()
}

//! From what was pushed to a finished map, at any time.
//!
//! Offline (the default) all pairs of local maps are gone over again first. Then the keyframes are arranged by steps and
//! closures, leaving out closures until none is left that the others contradict. A cancelled conclusion does neither: it is
//! the current graph, with its grid and its landmarks.

use crate::closer::Closer;
use crate::closure::Verdict;
use crate::landmarks::landmarks;
use crate::local_map::LocalMap;
use crate::map_result::{AnchoredClosure, EdgeKind, MapResult};
use crate::mapper::{Mapper, Placed};
use crate::occupancy::occupancy;
use crate::pose_graph::{self, Edge, PoseGraph};
use crate::trajectory::{ahead, at_odometry_rate};
use crate::weak::weak_spots;
use groma_geometry::Se2;
use groma_models::{Cancelled, OdometryTrack, Token};
use nalgebra::Matrix3;

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
    /// The map of what was pushed. Cancelled, it is that of the current graph: [`MapResult::is_interrupted`].
    ///
    /// # Errors
    /// When no scan could be used, or the pose graph cannot be solved.
    pub fn finish(&self, token: &Token) -> Result<MapResult, Error> {
        if self.keyframes.is_empty() {
            return Err(Error::NoScan);
        }
        let mut closer = self.closer.clone();
        if let Some(finished) = self.tracker.rest() {
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
            let pose = nodes[anchors[closure.from]].between(&nodes[anchors[closure.to]]);
            if *weight == 0.0 || !closure.is_met(&pose) {
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
            measurement: keyframes[k - 1].tracked.pose.between(&keyframes[k].tracked.pose),
            information: keyframes[k].tracked.step.try_inverse().unwrap_or_else(Matrix3::identity),
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
        let mut poses: Vec<Se2> = keyframes.iter().map(|k| k.tracked.pose).collect();
        for (map, pose) in self.closer.maps.iter().zip(&self.closer.poses) {
            for k in map.keyframes.clone() {
                poses[k] = *pose * map.anchor.between(&keyframes[k].tracked.pose);
            }
        }
        poses
    }

    /// What became of the candidates for loop closures.
    fn closures(&self) -> Vec<AnchoredClosure> {
        let anchor = |m: usize| self.closer.maps[m].keyframes.start;
        let told = self.closer.closures.iter().filter(|c| c.verdict != Verdict::TooLittle);
        told.map(|c| AnchoredClosure { closure: c.clone(), from: anchor(c.from), to: anchor(c.to) }).collect()
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
        let tracked = scans(&|p| keyframes[p.keyframe].tracked.pose * p.t_keyframe_scan);
        let trajectory = if mapper.options.online {
            let offsets: Vec<Se2> = mapper.placed.iter().map(|p| p.offset).collect();
            ahead(&scans(&|p| p.online), &offsets, &mapper.track)
        } else {
            at_odometry_rate(&scans(&|p| graph.nodes[p.keyframe] * p.t_keyframe_scan), &mapper.track, shift)
        };
        let drawing = Token::new();
        Ok(MapResult {
            stamps: keyframes.iter().map(|k| k.tracked.stamp).collect(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closure::Closure;
    use crate::options::Options;
    use crate::test_keyframe::room;
    use crate::verify::Check;
    use groma_models::{LaserScan, Odometry};
    use nalgebra::Vector2;

    /// A scan in a room of 26 by 6 m, `x` metres from its western wall.
    fn hall(stamp: f64, x: f64) -> LaserScan {
        room(stamp, [26.0 - x, x, 4.0, 2.0])
    }

    /// Twenty-two metres straight ahead: several local maps.
    fn driven() -> Mapper {
        let mut mapper = Mapper::new(Options::default());
        for k in 0..150 {
            let (stamp, x) = (0.3 * f64::from(k), 0.15 * f64::from(k));
            mapper.push_odometry(Odometry { stamp, pose: Se2::new(x, 0.0, 0.0) });
            mapper.push_scan(&hall(stamp, 2.0 + x), &Se2::IDENTITY).unwrap();
        }
        assert!(mapper.closer.maps.len() > 2);
        mapper
    }

    fn ending(mapper: &Mapper) -> Ending<'_> {
        let mut closer = mapper.closer.clone();
        closer.closures.clear();
        Ending { mapper, closer }
    }

    /// A closure from the first local map to a later one that measures `off` beside what the tracker saw.
    fn closure(ending: &Ending, to: usize, off: Se2) -> Closure {
        let (a, b) = (&ending.closer.maps[0], &ending.closer.maps[to]);
        let predicted = a.anchor.between(&b.anchor);
        let information = Matrix3::identity() * 1e5;
        let check = Check { pose: predicted * off, information, overlap: 1.0, share: 1.0, common: 1.0, scale: 0.01 };
        Closure { from: 0, to, check, predicted, verdict: Verdict::Accepted }
    }

    #[test]
    fn closures_that_the_graph_misses_by_far_or_left_out_are_rejected() {
        let mapper = driven();
        let nodes: Vec<Se2> = mapper.keyframes.iter().map(|k| k.tracked.pose).collect();
        let steps = vec![0.0; nodes.len() - 1];
        let rejected = |off: Se2, weight: f64| {
            let mut ending = ending(&mapper);
            ending.closer.closures = vec![closure(&ending, 1, Se2::IDENTITY), closure(&ending, 2, off)];
            let count = ending.reject(&nodes, &[steps.clone(), vec![1.0, weight]].concat());
            assert_eq!(ending.closer.closures[0].verdict, Verdict::Accepted);
            assert_eq!(count == 1, ending.closer.closures[1].verdict == Verdict::Violated);
            count
        };
        for (off, count) in [(0.0, 0), (0.1, 0), (0.3, 1), (1.5, 1)] {
            assert_eq!(
                (rejected(Se2::new(off, 0.0, 0.0), 1.0), rejected(Se2::new(0.0, -off, 0.0), 1.0)),
                (count, count)
            );
        }
        for (turn, count) in [(0.01, 0), (-0.01, 0), (0.05, 1), (-0.05, 1)] {
            assert_eq!(rejected(Se2::new(0.0, 0.0, turn), 1.0), count, "{turn}");
        }
        assert_eq!(rejected(Se2::IDENTITY, 0.0), 1);
    }

    #[test]
    fn a_closure_that_the_others_contradict_is_no_part_of_the_graph() {
        let mapper = driven();
        let mut ending = ending(&mapper);
        let off = |x: f64, turn: f64| Se2::new(x, 0.0, turn);
        let all = [(1, off(0.0, 0.0)), (2, off(0.001, 0.0)), (2, off(0.6, 0.1)), (2, off(0.0, 0.001))];
        ending.closer.closures = all.iter().map(|(to, off)| closure(&ending, *to, *off)).collect();
        let (graph, kinds) = ending.settle(&Token::new()).unwrap();
        let verdicts: Vec<_> = ending.closer.closures.iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::Accepted, Verdict::Accepted, Verdict::Violated, Verdict::Accepted]);
        assert_eq!(kinds.iter().filter(|kind| **kind == EdgeKind::Closure).count(), 3);
        assert_eq!(graph.edges.len(), mapper.keyframes.len() - 1 + 3);
    }

    #[test]
    fn the_graph_is_that_of_the_steps_and_of_closures_between_anchors() {
        let mapper = driven();
        let mut ending = ending(&mapper);
        ending.closer.closures = vec![closure(&ending, 1, Se2::IDENTITY), closure(&ending, 2, Se2::new(0.1, 0.2, 0.3))];
        ending.closer.closures[0].verdict = Verdict::Violated;
        let last = ending.closer.maps.len() - 1;
        ending.closer.poses[last] = Se2::new(1.0, -2.0, 0.7);
        let (graph, kinds) = ending.graph();
        let keyframes = &mapper.keyframes;
        for (k, edge) in graph.edges[..keyframes.len() - 1].iter().enumerate() {
            assert_eq!((edge.from, edge.to, edge.robust, kinds[k]), (k, k + 1, false, EdgeKind::Step));
            assert_eq!(edge.measurement, keyframes[k].tracked.pose.between(&keyframes[k + 1].tracked.pose));
            assert!((edge.information * keyframes[k + 1].tracked.step - Matrix3::identity()).amax() < 1e-6);
        }
        let [edge] = &graph.edges[keyframes.len() - 1..] else { panic!("one closure") };
        let anchors = [0, 2].map(|m| ending.closer.maps[m].keyframes.start);
        assert_eq!(([edge.from, edge.to], edge.robust, kinds[kinds.len() - 1]), (anchors, true, EdgeKind::Closure));
        assert_eq!(edge.measurement, ending.closer.closures[1].check.pose);
        let map = &ending.closer.maps[last];
        for k in map.keyframes.clone() {
            let moved = ending.closer.poses[last] * map.anchor.between(&keyframes[k].tracked.pose);
            assert!(graph.nodes[k].minus(&moved).norm() < 1e-12, "{k}");
        }
    }

    #[test]
    fn poses_are_told_at_the_rate_of_the_odometry_and_candidates_without_information_are_only_counted() {
        let mapper = driven();
        let mut ending = ending(&mapper);
        let verdicts =
            [Verdict::TooLittle, Verdict::Accepted, Verdict::TooLittle, Verdict::TooLittle, Verdict::Violated];
        ending.closer.closures =
            verdicts.map(|verdict| Closure { verdict, ..closure(&ending, 2, Se2::IDENTITY) }).to_vec();
        let (graph, kinds) = ending.graph();
        let result = ending.assemble(graph, kinds, false).unwrap();
        assert_eq!((result.closures.len(), result.undecided, result.closures[0].from), (2, 3, 0));
        assert!(result.stamps.len() < 100 && result.trajectory.len() == 150, "not each scan is a keyframe");
        for (k, (stamp, pose)) in result.trajectory.iter().enumerate() {
            for seen in [pose, &result.tracked[k], &result.odometry[k]] {
                assert!((seen.translation - Vector2::new(0.5 * stamp, 0.0)).norm() < 0.02, "{stamp} {seen:?}");
            }
        }
    }

    #[test]
    fn without_closures_a_keyframe_is_as_uncertain_as_the_step_to_it() {
        let mapper = driven();
        let ending = ending(&mapper);
        let (graph, kinds) = ending.graph();
        let covariance = ending.assemble(graph, kinds, false).unwrap().covariances[1];
        let step = mapper.keyframes[1].tracked.step;
        assert!((covariance - step).amax() < 1e-6 * step.amax(), "{covariance} {step}");
    }

    #[test]
    fn what_was_reported_during_the_drive_is_not_corrected_afterwards() {
        let mut mapper = driven();
        for online in [true, false] {
            mapper.options.online = online;
            let mut ending = ending(&mapper);
            ending.closer.poses.iter_mut().for_each(|pose| *pose = Se2::new(0.0, 1.0, 0.0) * *pose);
            let (graph, kinds) = ending.graph();
            let pose = ending.assemble(graph, kinds, false).unwrap().trajectory[60].1;
            assert!((pose.y() - if online { 0.0 } else { 1.0 }).abs() < 0.05, "{online} {pose:?}");
        }
    }

    #[test]
    fn a_single_reading_is_no_odometry() {
        for readings in [1, 2] {
            let mut mapper = Mapper::new(Options::default());
            for k in 0..2 {
                let stamp = f64::from(k);
                if k < readings {
                    mapper.push_odometry(Odometry { stamp, pose: Se2::IDENTITY });
                }
                mapper.push_scan(&hall(stamp, 3.0), &Se2::IDENTITY).unwrap();
            }
            assert_eq!(mapper.finish(&Token::new()).unwrap().has_odometry, readings == 2);
        }
    }
}

//! Pairs of landmarks of the map, found by their length; and the poses that put pairs of seen landmarks on them.
//!
//! A pair has a length and, where its landmarks are corners, the angles that they open at against its direction. All are
//! the same in the map and in the frame of the vehicle.

use super::{RelocalizeOptions, Seen};
use crate::point_index::PointIndex;
use groma_geometry::{Se2, So2, wrap};
use groma_models::{Landmark, LandmarkKind};
use nalgebra::Vector2;

/// Shortest pair: below, the direction says little [m].
const SHORTEST: f64 = 1.0;
/// Pairs kept, at most; beyond, the longest length is halved until they fit.
const MOST_PAIRS: usize = 2_000_000;

/// A pair of landmarks, from the one of lower place to the other.
#[derive(Clone, Copy, Debug)]
struct Pair {
    length: f32,
    from: u32,
    to: u32,
}

/// All pairs of a map, shortest first.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairIndex {
    pairs: Vec<Pair>,
    length_max: f64,
}

/// One end of a pair: what it is and at what angle it opens against the direction of the pair.
#[derive(Clone, Copy)]
struct End {
    kind: LandmarkKind,
    opening: Option<f64>,
}

impl PairIndex {
    pub fn new(landmarks: &[Landmark], options: &RelocalizeOptions) -> Self {
        let points: Vec<Vector2<f64>> = landmarks.iter().map(|l| l.position).collect();
        let index = PointIndex::new(&points);
        let mut length_max = options.length_max;
        loop {
            let pairs = pairs_of(&points, &index, length_max);
            if let Some(mut pairs) = pairs {
                pairs.sort_unstable_by(|a, b| a.length.total_cmp(&b.length).then((a.from, a.to).cmp(&(b.from, b.to))));
                return Self { pairs, length_max };
            }
            length_max /= 2.0;
        }
    }

    /// Poses of the vehicle that put a pair of seen landmarks on a pair of the map; seen pairs in an even order until the
    /// budget is spent.
    pub fn poses(&self, landmarks: &[Landmark], seen: &[Seen], options: &RelocalizeOptions) -> Vec<Se2> {
        let mut poses = Vec::new();
        for (i, j) in spread(seen.len()) {
            let length = (seen[j].point - seen[i].point).norm();
            if length < SHORTEST || length > self.length_max {
                continue;
            }
            let start = self.pairs.partition_point(|p| f64::from(p.length) < length - options.tolerance);
            let near = self.pairs[start..].iter().take_while(|p| f64::from(p.length) <= length + options.tolerance);
            for pair in near {
                let (a, b) = (pair.from as usize, pair.to as usize);
                for (a, b) in [(a, b), (b, a)] {
                    if fits(&landmarks[a], &landmarks[b], &seen[i], &seen[j], options) {
                        poses.push(pose(landmarks[a].position, landmarks[b].position, seen[i].point, seen[j].point));
                    }
                }
            }
            if poses.len() >= options.poses_max {
                break;
            }
        }
        poses
    }
}

/// All pairs up to a length; none if they are too many.
fn pairs_of(points: &[Vector2<f64>], index: &PointIndex, length_max: f64) -> Option<Vec<Pair>> {
    let mut pairs = Vec::new();
    for (to, p) in points.iter().enumerate() {
        index.within(*p, length_max, |from, sq| {
            if from < to && sq >= SHORTEST * SHORTEST {
                pairs.push(Pair { length: sq.sqrt() as f32, from: from as u32, to: to as u32 });
            }
        });
        if pairs.len() > MOST_PAIRS {
            return None;
        }
    }
    Some(pairs)
}

/// All pairs of `n`, ordered so that every beginning is spread over all.
fn spread(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (1..n).flat_map(move |gap| (0..n - gap).map(move |i| (i, i + gap)))
}

fn fits(a: &Landmark, b: &Landmark, s: &Seen, t: &Seen, options: &RelocalizeOptions) -> bool {
    if a.kind != s.kind || b.kind != t.kind {
        return false;
    }
    let (on_map, in_view) = (b.position - a.position, t.point - s.point);
    let (on_map, in_view) = (on_map.y.atan2(on_map.x), in_view.y.atan2(in_view.x));
    let end =
        |kind, orientation: Option<f64>, direction: f64| End { kind, opening: orientation.map(|o| o - direction) };
    end(a.kind, a.orientation, on_map).is_like(&end(s.kind, s.orientation, in_view), options)
        && end(b.kind, b.orientation, on_map).is_like(&end(t.kind, t.orientation, in_view), options)
}

impl End {
    fn is_like(&self, other: &Self, options: &RelocalizeOptions) -> bool {
        let turned = match (self.opening, other.opening) {
            (Some(a), Some(b)) => wrap(a - b).abs() <= options.orientation_max,
            _ => true,
        };
        self.kind == other.kind && turned
    }
}

/// The pose that puts `s` and `t` on `a` and `b`, middle on middle.
fn pose(a: Vector2<f64>, b: Vector2<f64>, s: Vector2<f64>, t: Vector2<f64>) -> Se2 {
    let (u, v) = (b - a, t - s);
    let rotation = So2 { cos: v.dot(&u), sin: v.perp(&u) }.normalized();
    Se2 { rotation, translation: 0.5 * (a + b) - rotation.act(0.5 * (s + t)) }
}

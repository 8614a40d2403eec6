//! The search for the motions between two sets of landmarks.

use super::Options;
use super::segments::{Equal, equal_segments};
use super::verify::{Neighbourhood, Refined, Sets};
use super::votes::elect;
use groma_geometry::{Se2, So2};
use nalgebra::{Matrix3, Vector2};

/// Refinements tried for each requested hypothesis.
const TRIES: usize = 6;

/// A motion between two sets of landmarks, and what it pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// `T_a_b`.
    pub transform: Se2,
    /// Paired landmarks `(of a, of b)`, each at most once, sorted.
    pub pairs: Vec<(usize, usize)>,
    /// Covariance of the perturbation `T_a_b * exp(xi)`.
    pub covariance: Matrix3<f64>,
    /// Root mean square distance of the pairs [m].
    pub rms: f64,
}

/// The motions that put most landmarks of b onto landmarks of a, most pairs first; positions in metres.
///
/// Empty where no motion pairs `min_pairs`, and where a position is not finite. The options are assumed valid (see
/// [`Options::validate`]).
#[must_use]
pub fn associate(a: &[Vector2<f64>], b: &[Vector2<f64>], options: &Options) -> Vec<Hypothesis> {
    associate_compatible(a, b, options, |_, _| true)
}

/// The same, where landmark i of a and j of b may be paired only if `compatible(i, j)`: of like descriptors, say.
#[must_use]
pub fn associate_compatible(
    a: &[Vector2<f64>],
    b: &[Vector2<f64>],
    options: &Options,
    compatible: impl Fn(usize, usize) -> bool,
) -> Vec<Hypothesis> {
    let Some(middle) = middle(a, b) else { return Vec::new() };
    let motions = equal_segments(a, b, options, |e| e.is_allowed(&compatible).then(|| motion(e, a, b)));
    let ranked = rank(&motions, middle, a, b, options);
    let search = Search { options, middle, sets: Sets::new(a, b, |i, j, _: &Se2| compatible(i, j)) };
    search.refine(&ranked)
}

/// The same for landmarks that face a direction (unit vectors `face_a`, `face_b`, one a landmark): two are paired only by motions
/// that turn the one to within `most_turn` [rad] of the other.
///
/// Empty where there are not as many directions as landmarks.
#[must_use]
pub fn associate_facing(
    (a, face_a): (&[Vector2<f64>], &[Vector2<f64>]),
    (b, face_b): (&[Vector2<f64>], &[Vector2<f64>]),
    options: &Options,
    most_turn: f64,
) -> Vec<Hypothesis> {
    let Some(middle) = middle(a, b).filter(|_| a.len() == face_a.len() && b.len() == face_b.len()) else {
        return Vec::new();
    };
    let least = most_turn.cos();
    let alike = |i: usize, j: usize, t: &Se2| t.rotation.act(face_b[j]).dot(&face_a[i]) >= least;
    let motions = equal_segments(a, b, options, |e| {
        let motion = motion(e, a, b);
        e.pairs().into_iter().all(|(i, j)| alike(i, j, &motion)).then_some(motion)
    });
    let ranked = rank(&motions, middle, a, b, options);
    Search { options, middle, sets: Sets::new(a, b, alike) }.refine(&ranked)
}

/// The middle of b; none where either set is empty or not finite.
pub(super) fn middle(a: &[Vector2<f64>], b: &[Vector2<f64>]) -> Option<Vector2<f64>> {
    let finite = |points: &[Vector2<f64>]| points.iter().all(|p| p.x.is_finite() && p.y.is_finite());
    let usable = !a.is_empty() && !b.is_empty() && finite(a) && finite(b);
    usable.then(|| b.iter().sum::<Vector2<f64>>() / b.len() as f64)
}

/// The motion that puts a segment of b onto one of a, middle on middle.
pub(super) fn motion(equal: &Equal, a: &[Vector2<f64>], b: &[Vector2<f64>]) -> Se2 {
    let [(a0, b0), (a1, b1)] = equal.pairs();
    let (u, v) = (a[a1] - a[a0], b[b1] - b[b0]);
    let scale = 1.0 / (equal.a.length * equal.b.length);
    let rotation = So2 { cos: v.dot(&u) * scale, sin: v.perp(&u) * scale };
    Se2 { rotation, translation: 0.5 * (a[a0] + a[a1]) - rotation.act(0.5 * (b[b0] + b[b1])) }
}

/// Motions with the number of inliers they may have, most first.
fn rank(
    motions: &[Se2],
    middle: Vector2<f64>,
    a: &[Vector2<f64>],
    b: &[Vector2<f64>],
    options: &Options,
) -> Vec<(usize, Se2)> {
    let elected = if motions.len() > options.max_verified {
        elect(motions, middle, options.max_verified)
    } else {
        (0..motions.len()).collect()
    };
    let grid = Neighbourhood::new(a, options.tolerance);
    let counted = elected.into_iter().map(|k| (grid.count(&motions[k], b), motions[k]));
    let mut ranked: Vec<_> = counted.filter(|(count, _)| *count >= options.min_pairs).collect();
    ranked.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    ranked
}

/// Refines motions and tells them apart.
pub(super) struct Search<'a, F> {
    pub options: &'a Options,
    /// Middle of b, where motions are compared.
    pub middle: Vector2<f64>,
    pub sets: Sets<'a, F>,
}

impl<F: Fn(usize, usize, &Se2) -> bool> Search<'_, F> {
    /// Refine the ranked motions, each once, and keep the best that differ.
    pub fn refine(&self, ranked: &[(usize, Se2)]) -> Vec<Hypothesis> {
        let (mut tried, mut found): (Vec<Se2>, Vec<Hypothesis>) = (Vec::new(), Vec::new());
        for (_, motion) in ranked {
            if tried.len() >= TRIES * self.options.max_hypotheses {
                break;
            }
            if tried.iter().any(|t| self.is_same(t, motion, 0.5)) {
                continue;
            }
            tried.push(*motion);
            found.extend(self.sets.refine(motion, self.options).map(Hypothesis::from));
        }
        found.sort_by(|s, t| t.pairs.len().cmp(&s.pairs.len()).then(s.rms.total_cmp(&t.rms)));
        self.distinct(found)
    }

    /// The first of every group of like hypotheses, as many as requested.
    fn distinct(&self, found: Vec<Hypothesis>) -> Vec<Hypothesis> {
        let mut kept: Vec<Hypothesis> = Vec::new();
        for hypothesis in found {
            let known = kept.iter().any(|k| self.is_same(&k.transform, &hypothesis.transform, 1.0));
            if !known && kept.len() < self.options.max_hypotheses {
                kept.push(hypothesis);
            }
        }
        kept
    }

    /// Whether two motions are closer than `share` of the distance from which they count as different.
    fn is_same(&self, s: &Se2, t: &Se2, share: f64) -> bool {
        let apart = (s.act(self.middle) - t.act(self.middle)).norm();
        let turned = (s.rotation.inverse() * t.rotation).log().abs();
        apart <= share * self.options.distinct_translation && turned <= share * self.options.distinct_rotation
    }
}

impl From<Refined> for Hypothesis {
    fn from((pairs, fit): Refined) -> Self {
        Self { transform: fit.transform, pairs, covariance: fit.covariance, rms: fit.rms }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_estimation::random::SplitMix64;

    /// A set of `shared + of_a` points seen from two places, `shared + of_b` in the other, with noise.
    fn maps(seed: u64, shared: usize, only: usize, noise: f64) -> (Vec<Vector2<f64>>, Vec<Vector2<f64>>, Se2) {
        let mut draw = SplitMix64::new(seed);
        let extent = 30.0;
        let mut point = |_| Vector2::new(extent * draw.uniform(), extent * draw.uniform());
        let common: Vec<_> = (0..shared).map(&mut point).collect();
        let (only_a, only_b): (Vec<_>, Vec<_>) =
            ((0..only).map(&mut point).collect(), (0..only).map(&mut point).collect());
        let truth = Se2::new(40.0 * draw.uniform() - 20.0, 10.0 * draw.uniform(), 6.3 * draw.uniform());
        let mut noisy = |p: Vector2<f64>| p + Vector2::new(draw.normal(), draw.normal()) * noise;
        let a = only_a.iter().chain(&common).map(|&p| noisy(p)).collect();
        let b = common.iter().chain(&only_b).map(|&p| truth.inverse().act(noisy(p))).collect();
        (a, b, truth)
    }

    #[test]
    fn finds_the_motion_among_strangers() {
        for (shared, only) in [(6, 3), (12, 20), (30, 60), (60, 140)] {
            for seed in 0..10 {
                let (a, b, truth) = maps(seed, shared, only, 0.03);
                let found = associate(&a, &b, &Options::default());
                let error = found[0].transform.minus(&truth);
                let sigma = found[0].covariance.diagonal().map(f64::sqrt);
                assert!(error.component_div(&sigma).amax() < 5.0, "{shared} {only} {seed}: {error}");
                let right = found[0].pairs.iter().filter(|(i, j)| *i == only + j).count();
                // Strangers may pair by chance.
                assert!(right + 1 >= shared && 10 * right >= 8 * found[0].pairs.len(), "{:?}", found[0].pairs);
            }
        }
    }

    #[test]
    fn hypotheses_are_one_to_one_and_distinct() {
        let options = Options { min_pairs: 3, ..Options::default() };
        for seed in 0..10 {
            let (a, b, _) = maps(seed, 0, 25, 0.0);
            let found = associate(&a, &b, &options);
            let middle = b.iter().sum::<Vector2<f64>>() / b.len() as f64;
            for (k, h) in found.iter().enumerate() {
                let mut of_b: Vec<_> = h.pairs.iter().map(|p| p.1).collect();
                of_b.sort_unstable();
                assert!(of_b.windows(2).all(|w| w[0] < w[1]) && h.pairs.windows(2).all(|w| w[0].0 < w[1].0));
                assert!(k == 0 || found[k - 1].pairs.len() >= h.pairs.len());
                let apart = |g: &Hypothesis| (g.transform.act(middle) - h.transform.act(middle)).norm();
                let turned = |g: &Hypothesis| (g.transform.theta() - h.transform.theta()).sin().abs();
                assert!(found[..k].iter().all(|g| apart(g) > 0.5 || turned(g) > 0.17));
            }
        }
    }

    #[test]
    fn never_mirrors() {
        let (a, _, _) = maps(3, 12, 0, 0.0);
        let mirrored: Vec<_> = a.iter().map(|p| Vector2::new(-p.x, p.y)).collect();
        for hypothesis in associate(&a, &mirrored, &Options::default()) {
            assert!(hypothesis.pairs.len() < 8);
            assert!((hypothesis.transform.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn heeds_what_is_incompatible() {
        let (a, b, truth) = maps(5, 20, 0, 0.02);
        let found = associate_compatible(&a, &b, &Options::default(), |i, j| i % 2 == j % 2 && i != 4);
        assert!(found[0].transform.minus(&truth).norm() < 0.1);
        assert_eq!(found[0].pairs.len(), 19);
        assert!(found[0].pairs.iter().all(|&(i, j)| i == j && i != 4));
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let (a, b, _) = maps(1, 8, 0, 0.0);
        let mut broken = b.clone();
        broken[2].x = f64::NAN;
        for (a, b) in [(&a[..0], &b[..]), (&a, &b[..0]), (&a[..3], &b[..3]), (&a, &broken)] {
            assert_eq!(associate(a, b, &Options::default()), []);
        }
    }
}

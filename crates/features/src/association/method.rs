//! The ways to associate two sets of landmarks, behind one interface.
//!
//! A method proposes motions; all are then refined by one-to-one pairing and least squares in turns, and distinguished, by
//! the same code, so that what comes back means the same whatever the method: `T_a_b` with its covariance, and pairs
//! within the tolerance.

use super::problem::Problem;
use super::search::{Hypothesis, Search, associate_compatible, middle};
use super::verify::Sets;
use super::{Options, clique, hough, nearest, ransac};
use groma_geometry::Se2;
use nalgebra::Vector2;
use serde::{Deserialize, Serialize};

/// A way to associate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)]
pub enum Method {
    /// Motions from all pairs of equal length: see [`super`].
    #[default]
    Exhaustive,
    /// Mutual nearest neighbours at a motion known beforehand.
    Nearest {
        /// `T_a_b` as x, y [m], theta [rad].
        prior: [f64; 3],
    },
    /// Votes of all pairs of landmarks for motions on a grid.
    Hough,
    /// The most correspondences that agree with each other in their distances.
    Clique {
        /// Most steps of the search: correspondences compared, and branches.
        max_steps: usize,
    },
    /// Motions from pairs of equal length drawn at random.
    Ransac {
        /// Seed of the draws: the same seed, the same outcome.
        seed: u64,
        /// Motions drawn.
        draws: usize,
    },
}

/// What a method found.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Motions that differ, most pairs first.
    pub hypotheses: Vec<Hypothesis>,
    /// Whether the search ran to its end; false where its cap cut it short, so that a better motion may exist.
    pub complete: bool,
}

/// The motions that a method finds between landmarks a and b, of which i and j may be paired only if `compatible(i, j)`.
///
/// Empty where no motion pairs `min_pairs`, and where a position is not finite. The options are assumed valid (see
/// [`Options::validate`]).
#[must_use]
pub fn associate_by(
    method: &Method,
    a: &[Vector2<f64>],
    b: &[Vector2<f64>],
    options: &Options,
    compatible: impl Fn(usize, usize) -> bool,
) -> Found {
    let Some(middle) = middle(a, b) else { return Found { hypotheses: Vec::new(), complete: true } };
    let problem = Problem { a, b, middle, options, compatible: &compatible };
    let (proposed, complete) = match *method {
        Method::Exhaustive => {
            return Found { hypotheses: associate_compatible(a, b, options, &compatible), complete: true };
        }
        Method::Nearest { prior } => return Found { hypotheses: nearest::pair(&problem, prior), complete: true },
        Method::Hough => (hough::propose(&problem), true),
        Method::Clique { max_steps } => clique::propose(&problem, max_steps),
        Method::Ransac { seed, draws } => (ransac::propose(&problem, seed, draws), true),
    };
    let search = Search { options, middle, sets: Sets::new(a, b, |i, j, _: &Se2| compatible(i, j)) };
    Found { hypotheses: search.refine(&proposed), complete }
}

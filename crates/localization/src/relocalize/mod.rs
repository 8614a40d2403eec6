//! Where on the map the vehicle is, without any first guess.
//!
//! ```text
//! 1. what was seen of late, brought together by the odometry                          `local_view`
//! 2. pairs of seen landmarks -> pairs of the map of equal length, turned alike -> poses `pairs`
//! 3. poses that put most seen landmarks on the map; refined by weighted least squares   `refine`
//! 4. log-likelihood ratio of each against chance, from landmarks and from beams         `evidence`, `beams`
//! 5. probability among all poses found, those not found, and places not on the map      `posterior`
//! ```
//!
//! Geometric hashing of pairs (Lamdan, Wolfson 1988), searched exhaustively within a budget: no seed. The probability is
//! what makes the answer usable: in a hall of equal racks two places look alike, and then neither is certain.

mod beams;
mod evidence;
mod local_view;
mod pairs;
mod posterior;
mod refine;

pub use local_view::{Beam, LocalView, Seen};

use crate::error::Error;
use crate::map::StaticMap;
use crate::options::{InvalidOption, require};
use groma_geometry::Se2;
use groma_models::{Grid, LandmarkMap};
use nalgebra::Matrix3;
use pairs::PairIndex;
use serde::{Deserialize, Serialize};

/// Settings of the search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RelocalizeOptions {
    /// Seen and mapped landmarks belong together within this distance [m].
    pub tolerance: f64,
    /// Corners are paired when their orientations differ by less than this [rad].
    pub orientation_max: f64,
    /// Pairs of landmarks count up to this length [m].
    pub length_max: f64,
    /// Poses looked at, at most.
    pub poses_max: usize,
    /// Share of what is seen that the map knows, on average.
    pub known_share: f64,
    /// Probability from which the answer is taken for right.
    pub confident: f64,
}

impl Default for RelocalizeOptions {
    fn default() -> Self {
        Self {
            tolerance: 0.25,
            orientation_max: 0.7,
            length_max: 15.0,
            poses_max: 200_000,
            known_share: 0.5,
            confident: 0.99,
        }
    }
}

impl RelocalizeOptions {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let positive = |name, v: f64| require(v > 0.0 && v.is_finite(), name, v, "above 0");
        let share = |name, v: f64| require(v > 0.0 && v < 1.0, name, v, "above 0 and below 1");
        positive("tolerance", self.tolerance)?;
        positive("orientation_max", self.orientation_max)?;
        require(self.length_max > 1.0 && self.length_max.is_finite(), "length_max", self.length_max, "above 1 m")?;
        require(self.poses_max >= 1, "poses_max", self.poses_max as f64, "1 or more")?;
        share("known_share", self.known_share)?;
        share("confident", self.confident)
    }
}

/// A place where the vehicle may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Located {
    /// `T_map_base`, at the end of the view.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
    /// Seen landmarks paired with landmarks of the map.
    pub pairs: Vec<(usize, usize)>,
    /// Logarithm of the likelihood ratio against chance.
    pub evidence: f64,
    /// Probability that it is right.
    pub probability: f64,
}

/// A map that places are looked for on.
#[derive(Clone, Debug)]
pub struct Relocalizer {
    map: StaticMap,
    grid: Option<Grid>,
    pairs: PairIndex,
    options: RelocalizeOptions,
    /// Area on which the vehicle may be [m^2].
    area: f64,
}

/// Poses refined and judged, at most.
const MOST_JUDGED: usize = 60;

impl Relocalizer {
    /// Gets a map ready; the occupancy grid, if there is one, lets the beams speak.
    ///
    /// # Errors
    /// A setting out of range, or a map that cannot be used.
    pub fn new(map: LandmarkMap, grid: Option<Grid>, options: RelocalizeOptions) -> Result<Self, Error> {
        options.validate()?;
        let map = StaticMap::new(map)?;
        let pairs = PairIndex::new(map.landmarks(), &options);
        let area = grid.as_ref().map_or_else(|| extent(&map), beams::free_area).max(1.0);
        Ok(Self { map, grid, pairs, options, area })
    }

    /// The settings.
    #[must_use]
    pub fn options(&self) -> &RelocalizeOptions {
        &self.options
    }

    /// The place, if it is certain enough.
    #[must_use]
    pub fn certain(&self, view: &LocalView) -> Option<Located> {
        self.locate(view).into_iter().next().filter(|best| best.probability >= self.options.confident)
    }

    /// Where the vehicle may be, most probable first.
    #[must_use]
    pub fn locate(&self, view: &LocalView) -> Vec<Located> {
        let seen = view.landmarks();
        let guesses = self.pairs.poses(self.map.landmarks(), seen, &self.options);
        let ranked = refine::rank(&guesses, seen, &self.map, &self.options);
        let refined =
            ranked.iter().take(MOST_JUDGED).filter_map(|pose| refine::refine(pose, seen, &self.map, &self.options));
        let judged = refined.map(|(pose, covariance, pairs)| {
            let by_landmarks = evidence::landmarks(&pose, seen, &pairs, &self.map, &self.options);
            let by_beams = self.grid.as_ref().map_or(0.0, |grid| beams::evidence(&pose, view.beams(), grid));
            Located { pose, covariance, pairs, evidence: by_landmarks + by_beams, probability: 0.0 }
        });
        posterior::normalize(refine::distinct(judged.collect()), self.area)
    }
}

/// The area of the box around all landmarks [m^2].
fn extent(map: &StaticMap) -> f64 {
    let points = || map.landmarks().iter().map(|l| l.position);
    let Some(first) = points().next() else { return 0.0 };
    let (low, high) = points().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    (high - low).product()
}

//! Where on the map the vehicle is, without any first guess.
//!
//! ```text
//! 1. what was seen recently, brought together: landmarks and scans                        `local_view`
//! 2. pairs of seen landmarks -> pairs of the map of equal length, turned alike -> poses `pairs`
//!    poses that put most seen landmarks on the map; refined by weighted least squares   `refine`
//! 3. poses that put the scans on the walls of the occupancy grid, all places and headings (branch and bound);
//!    refined by registration to its surfaces                                            `walls`
//! 4. log-likelihood ratio of each against chance, from landmarks and from beams         `evidence`, [`crate::beams`]
//! 5. probability among all poses found, those not found, and places not on the map      `posterior`
//! ```
//!
//! Either way finds what the other misses: few corners stand in offices, and the walls of racks are all alike.
//!
//! Geometric hashing of pairs (Lamdan, Wolfson 1988), searched exhaustively within a budget: no seed. The probability is
//! what makes the answer usable: in a hall of equal racks two places look alike, and then neither is certain.

mod evidence;
mod local_view;
mod pairs;
mod posterior;
mod refine;

pub use local_view::{LocalView, Look, Seen};

use crate::beams;
use crate::error::Error;
use crate::map::StaticMap;
use crate::options::{InvalidOption, require};
use crate::walls::{Walls, thinned};
use groma_geometry::Se2;
use groma_models::{Grid, LandmarkMap};
use nalgebra::Matrix3;
use pairs::PairIndex;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

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
    /// `T_map_base` at the end of the view.
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

impl Located {
    /// The place of the vehicle, at `T_view_base`, of that of the view.
    fn seen_from(self, base: &Se2) -> Self {
        let adjoint = base.inverse().adjoint();
        Self { pose: self.pose * *base, covariance: adjoint * self.covariance * adjoint.transpose(), ..self }
    }
}

/// A map that places are looked for on.
#[derive(Clone, Debug)]
pub struct Relocalizer {
    map: StaticMap,
    walls: Option<Arc<Walls>>,
    pairs: PairIndex,
    options: RelocalizeOptions,
    /// Area on which the vehicle may be [m^2].
    area: f64,
}

/// The covariance of a grid, times this, is that of a view on it: the scans of a view do not lie on each other perfectly.
const BENT: f64 = 4.0;
/// What the weaker of two sorts of evidence adds to the stronger.
const SECOND: f64 = 0.3;
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
        Ok(Self { map, walls: grid.and_then(Walls::new).map(Arc::new), pairs, options, area })
    }

    /// The settings.
    #[must_use]
    pub fn options(&self) -> &RelocalizeOptions {
        &self.options
    }

    /// The walls of the map, if it has a grid.
    pub(crate) fn walls(&self) -> Option<Arc<Walls>> {
        self.walls.clone()
    }

    /// The place, if it is certain enough.
    #[must_use]
    pub fn certain(&self, view: &LocalView) -> Option<Located> {
        self.locate(view).into_iter().next().filter(|best| best.probability >= self.options.confident)
    }

    /// Where the vehicle may be, most probable first.
    #[must_use]
    pub fn locate(&self, view: &LocalView) -> Vec<Located> {
        let by_landmarks = self.by_landmarks(view);
        let by_walls = self.walls.as_ref().map_or_else(Vec::new, |walls| self.by_walls(walls, view));
        let found = posterior::normalize(refine::distinct([by_landmarks, by_walls].concat()), self.area);
        found.into_iter().map(|one| one.seen_from(&view.pose())).collect()
    }

    /// Places at which seen landmarks lie on landmarks of the map.
    fn by_landmarks(&self, view: &LocalView) -> Vec<Located> {
        let seen = view.landmarks();
        let guesses = self.pairs.poses(self.map.landmarks(), seen, &self.options);
        let ranked = refine::rank(&guesses, seen, &self.map, &self.options);
        let refined =
            ranked.iter().take(MOST_JUDGED).filter_map(|pose| refine::refine(pose, seen, &self.map, &self.options));
        refined.map(|(pose, covariance, pairs)| self.judged(pose, covariance, pairs, view)).collect()
    }

    /// Places at which the scans lie on the walls of the map.
    fn by_walls(&self, walls: &Walls, view: &LocalView) -> Vec<Located> {
        let scan = thinned(&view.surface());
        let places = walls.places(&scan).into_iter().take(MOST_JUDGED);
        let aligned = places.map(|place| walls.align(&scan, place, None));
        let refined = aligned.filter_map(|a| Some((a.pose, a.information.try_inverse()? + walls.covariance() * BENT)));
        let judged = refined.map(|(pose, covariance)| {
            let pairs = refine::pair(&pose, view.landmarks(), &self.map, self.options.tolerance, &self.options);
            self.judged(pose, covariance, pairs, view)
        });
        judged.collect()
    }

    /// A place with what landmarks and beams say of it.
    fn judged(&self, pose: Se2, covariance: Matrix3<f64>, pairs: Vec<(usize, usize)>, view: &LocalView) -> Located {
        let by_landmarks = evidence::landmarks(&pose, view.landmarks(), &pairs, &self.map, &self.options);
        let scans = view.looks().iter().map(|look| (pose * look.pose, &look.beams[..]));
        let by_beams =
            self.walls.as_ref().map_or(0.0, |walls| beams::evidence(scans, view.wall_length(), walls.grid()));
        Located { pose, covariance, pairs, evidence: both(by_landmarks, by_beams), probability: 0.0 }
    }
}

/// The evidence of landmarks and beams together: most landmarks are the corners of what the beams meet.
fn both(landmarks: f64, beams: f64) -> f64 {
    landmarks.max(beams) + SECOND * landmarks.min(beams)
}

/// The area of the box around all landmarks [m^2].
fn extent(map: &StaticMap) -> f64 {
    let points = || map.landmarks().iter().map(|l| l.position);
    let Some(first) = points().next() else { return 0.0 };
    let (low, high) = points().fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)));
    (high - low).product()
}

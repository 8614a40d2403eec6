//! How to choose where to go on: the rules that robots are given, and the searches.
//!
//! | | after each new camera | then | when all cameras are found |
//! |---|---|---|---|
//! | depth-first | | an exit here, else back to the last place that has one | stop |
//! | nearest | | the nearest place with an exit that nobody took | stop |
//! | return-to-origin | back to the start | the nearest | stop |
//! | return-to-nearest | back to the nearest other camera | the nearest | stop |
//! | cheap | | the place with the least `J` over shortest paths | stop |
//! | search | | the walk with the least `J` over all walks (`search`) | stop |
//! | survey | | the place from which the rest takes the shortest tour (`frontier`) | the walks of least cost ([`super::explorer`]) |
//!
//! `J = length + lambda (sum of the position variances of cameras and robot)`. With errors in the world frame the final
//! covariance does not depend on the order in which ways were driven, only on how often each was (but for the noise of
//! turns): least squares does not know the order of its equations. A detour that lowers the uncertainty is therefore
//! worth as much after the exploration as during it, and is chosen better then, with all ways known. That is what survey
//! does. It pays by a robot that is less certain of its place while it explores.
//!
//! Source of the first four: D. Meger's thesis, chapter 5; of search: Meger, Rekleitis, Dudek, IROS 2008.

use crate::error::Error;
use serde::{Deserialize, Serialize};

/// A rule for the next drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// New ground first, back-tracking at dead ends.
    DepthFirst,
    /// The nearest new ground.
    Nearest,
    /// Home after each new camera.
    ReturnToOrigin,
    /// Back to the nearest known camera after each new one.
    ReturnToNearest,
    /// Which new ground by cost, on the shortest path.
    Cheap,
    /// Which walk to new ground by cost.
    Search,
    /// All new ground in a short drive, then the walks of least cost.
    #[default]
    Survey,
}

impl Strategy {
    /// All, in the order of this page.
    pub const ALL: [Self; 7] = [
        Self::DepthFirst,
        Self::Nearest,
        Self::ReturnToOrigin,
        Self::ReturnToNearest,
        Self::Cheap,
        Self::Search,
        Self::Survey,
    ];

    /// Whether it weighs uncertainty against distance.
    #[must_use]
    pub fn weighs(self) -> bool {
        matches!(self, Self::Cheap | Self::Search | Self::Survey)
    }
}

/// What the drive shall achieve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Goal {
    /// Metres of driving traded for one square metre less of summed variance [1/m].
    Lambda(f64),
    /// Root mean square standard deviation of the cameras' positions to reach [m]; survey only.
    Sigma(f64),
    /// Distance to spend, as far as finding all cameras leaves some of it [m]; survey only.
    Budget(f64),
}

impl Default for Goal {
    fn default() -> Self {
        Self::Lambda(100.0)
    }
}

impl Goal {
    /// Refuses a goal that means nothing, or nothing to this strategy.
    pub fn validate(self, strategy: Strategy) -> Result<(), Error> {
        let (name, value, least) = match self {
            Self::Lambda(value) => ("lambda", value, 0.0),
            Self::Sigma(value) => ("sigma", value, f64::MIN_POSITIVE),
            Self::Budget(value) => ("budget", value, f64::MIN_POSITIVE),
        };
        Error::unless(value >= least && value.is_finite(), name, value, "must be above 0 and finite")?;
        let fits = matches!(self, Self::Lambda(_)) || strategy == Strategy::Survey;
        Error::unless(fits, name, value, "only the strategy survey can be led by it: give lambda")
    }
}

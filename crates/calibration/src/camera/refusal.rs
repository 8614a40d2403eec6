//! Why views do not allow a calibration: values, with the reason and what to do about it.

use groma_models::Cancelled;
use thiserror::Error;

/// What keeps a camera from being calibrated.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Refusal {
    /// Too few views to begin with.
    #[error("{views} usable view{plural} of a panel: at least {needed} with the panel at different angles are needed",
        plural = if *.views == 1 { "" } else { "s" })]
    TooFewViews {
        /// Usable views.
        views: usize,
        /// Least number.
        needed: usize,
    },
    /// No focal length explains what is seen.
    #[error(
        "no focal length between a quarter and five image widths explains the views: is the target the one in the images, and its size right?"
    )]
    NoStart,
    /// The panel faces the same way in all views.
    #[error(
        "the panel faces the same way in all {views} views (within {spread_deg:.1} deg): focal length and distance cannot \
         be distinguished; tilt or turn it by 20 to 45 deg between views, or use panels at different angles"
    )]
    OneAngle {
        /// Number of views.
        views: usize,
        /// Largest angle between two of them.
        spread_deg: f64,
    },
    /// The answer would be useless.
    #[error(
        "the views leave the focal length uncertain by {percent:.1} % (at most {limit:.1} % is accepted): {advice}"
    )]
    Uncertain {
        /// Standard deviation.
        percent: f64,
        /// The limit.
        limit: f64,
        /// What would help.
        advice: &'static str,
    },
    /// A direction of the parameters is not determined at all.
    #[error("the views do not hold {direction}: tilt the panel more, and let it be seen all over the image")]
    Weak {
        /// The direction in words.
        direction: String,
    },
    /// A setting is out of range.
    #[error("{name} = {value}: {rule}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// The refinement ran away.
    #[error("the refinement did not settle: the views contradict each other or do not fit the lens model {lens}")]
    NotSettled {
        /// Name of the lens model.
        lens: &'static str,
    },
}

//! A drive localized in a map, message by message.
//!
//! ```text
//! odometry | wheels -> motions with their noise -----------------.
//! scan -> corners (FALKO, with BSC) and reflectors, each at the time of its beam -> filter -> pose, covariance, quality
//! start -> given, or searched for: every scan is asked where it was taken until one knows;  lost -> searched for again
//! ```
//!
//! Order of arrival decides; nothing looks ahead. A scan that ends after the last motion is taken at a pose that goes on
//! with the last twist (`ahead`), and is taken again when its motion has come (`filter`). Which poses were corrected so is
//! part of the result.
//!
//! One scanner and one source of motions are used: wheels where a vehicle was given, else odometry. Other messages are
//! counted and passed over.

mod ahead;
mod considered;
mod filter;
mod findings;
mod halts;
mod machine;
mod motions;
mod observe;
mod options;
mod result;
mod seen;
mod track;
mod weak;

pub use halts::Halt;
pub use machine::{Begin, Event, Localize, Setup, State};
pub use observe::Observer;
pub use options::Options;
pub use result::{Counts, Localized};
pub use track::Fix;
pub use weak::{Weak, Why};

use thiserror::Error;

/// Why a drive cannot be localized.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Error {
    /// Settings, map or start cannot be used.
    #[error(transparent)]
    Localizer(#[from] groma_localization::Error),
    /// A setting of the pipeline is out of range.
    #[error(transparent)]
    Setting(#[from] groma_models::ModelError),
    /// No scan could be used.
    #[error("no scan could be used: there is nothing to localize")]
    NoScan,
}

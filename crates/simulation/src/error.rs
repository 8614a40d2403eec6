//! What can be wrong with a scenario.

use groma_models::Cancelled;
use thiserror::Error;

/// Why a scenario cannot be simulated.
#[derive(Debug, Error, PartialEq)]
pub enum SimulationError {
    /// A setting is out of range.
    #[error("{name} = {value}: {rule}")]
    Setting {
        /// Path of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// Nobody has drawn this scene.
    #[error("no {kind} is called {name:?}: try one of {names}", names = known.join(", "))]
    UnknownScene {
        /// What was requested: a scene, a network of cameras.
        kind: &'static str,
        /// The name that was requested.
        name: String,
        /// The names there are.
        known: &'static [&'static str],
    },
    /// A camera or a target of the scene makes no sense.
    #[error("{0}")]
    Scene(String),
    /// Nobody has drawn what is printed on a panel.
    #[error("{0} cannot be rendered: use a grid of tags or a chessboard")]
    NoDrawing(&'static str),
    /// The route has no leg.
    #[error("the route leads nowhere")]
    EmptyRoute,
    /// The vehicle lost its path.
    #[error("the vehicle did not reach ({x:.2}, {y:.2}) at the end of leg {leg}: lower the speed or widen the corners")]
    NotFollowed {
        /// Number of the leg, from 0.
        leg: usize,
        /// End of the leg [m].
        x: f64,
        /// End of the leg [m].
        y: f64,
    },
    /// The vehicle touched something.
    #[error("the vehicle touches something at ({x:.2}, {y:.2}) after {time:.2} s: lower the speed or the size")]
    Collision {
        /// Time after the start [s].
        time: f64,
        /// Where [m].
        x: f64,
        /// Where [m].
        y: f64,
    },
    /// The errors requested do not lead to the final error requested.
    #[error("no scale of the wheel errors makes the odometry end {0} m from the truth: give it errors to scale")]
    FinalError(f64),
}

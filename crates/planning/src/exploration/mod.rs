//! Exploration of a network of cameras: which way to drive next, distance against uncertainty.
//!
//! A building is a graph that the robot discovers as it drives: places under a camera, junctions, and exits of which it
//! sees the direction but not where they lead. [`Explorer`] receives what the robot finds and says by which exit to leave;
//! [`run::explore`] lets it explore a graph, [`monte_carlo`] tries the walk out with drawn noise.
//!
//! The covariance is that of the planar filter with errors in the world frame ([`belief`]), whose equations need no
//! measured values, so that a walk can be judged before it is driven.

pub mod belief;
mod bound;
mod branch;
pub mod explorer;
mod frontier;
pub mod graph;
mod known;
#[cfg(test)]
mod live;
pub mod monte_carlo;
pub mod noise;
#[cfg(test)]
mod proofs;
mod rows;
pub mod run;
pub mod scenes;
mod search;
mod smoothing;
pub mod strategy;

pub use explorer::{Decision, Event, Explorer, Settings};
pub use graph::{Edge, Graph, Node};
pub use known::Place;
pub use noise::Noise;
pub use run::{Run, explore, explore_while};
pub use scenes::Scene;
pub use search::Limits;
pub use strategy::{Goal, Strategy};

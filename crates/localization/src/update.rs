//! What a scan has brought: values only.

use crate::quality::Quality;
use nalgebra::{Matrix2, Vector2};

/// Whether a place at range and bearing of the laser would be seen.
pub type View<'a> = &'a dyn Fn(Vector2<f64>) -> bool;

/// An observation and the landmark it was taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Place in the list of observations.
    pub observation: usize,
    /// The landmark: its place in the map, or a number beyond for one found during the drive.
    pub landmark: usize,
    /// Whether it updates the pose.
    pub holds: bool,
    /// Range [m] and bearing [rad], measured less predicted.
    pub innovation: Vector2<f64>,
    /// Its covariance.
    pub covariance: Matrix2<f64>,
}

/// What a scan has brought.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Update {
    /// Pairings.
    pub matches: Vec<Match>,
    /// Landmarks begun.
    pub begun: usize,
    /// Landmarks that update the pose from now on.
    pub proven: usize,
    /// Landmarks forgotten.
    pub forgotten: usize,
    /// Observations that could not be used: not finite, without range or covariance, or out of range.
    pub unusable: usize,
    /// Whether the joint search reached its cap and nearest neighbours were taken.
    pub cut_short: bool,
    /// The probability with which the place was found again, where it was.
    pub relocated: Option<f64>,
    /// Quality of the pose now.
    pub quality: Quality,
}

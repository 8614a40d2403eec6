//! The plan of the thesis: evenly spaced steering angles, left and right, forward and backward, all turning alike.
//!
//! Source: Kallasi's thesis, chapter 5, whose tables name `nseg`, `alpha min`, `alpha max`, `beta` and `v`; that every
//! angle is driven in four ways is read from the times it tells.

use super::arcs::{Arc, Limits};
use groma_calibration::vehicle::Vehicle;

/// `count` angles from the least to the largest, four arcs each that turn by `turn`; those too long are left out.
#[must_use]
pub fn grid(vehicle: &Vehicle, count: usize, turn: f64, limits: &Limits) -> Vec<Arc> {
    let last = count.saturating_sub(1).max(1) as f64;
    let angle = |k: usize| limits.angle_min + (limits.angle_max - limits.angle_min) * k as f64 / last;
    let ways = [(1.0, true), (1.0, false), (-1.0, true), (-1.0, false)];
    let arcs = (0..count).flat_map(|k| ways.map(|(side, forward)| (side * angle(k), forward)));
    arcs.filter_map(|(steering, forward)| Arc::new(vehicle, steering, turn, forward, limits)).collect()
}

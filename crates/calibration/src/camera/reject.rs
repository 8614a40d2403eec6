//! Corners that do not belong: the X84 rule.
//!
//! With the whitened lengths `|r_i|` of all residuals, a corner is left out when `|r_i| > median + 5.2 MAD` (3.6 standard
//! deviations if they were normal, one good corner in 700). A view keeps its place while six corners are left.
//! Source: Hampel et al., "Robust Statistics", 1986.

use super::adjust::State;
use super::view::{Sighting, View};
use groma_estimation::robust;
use groma_geometry::LieGroup;

/// Least corners of a view.
pub(super) const LEAST_CORNERS: usize = 6;

/// Whitened length of the residual of a corner; infinite when it is not seen from there.
pub(super) fn misfit(state: &State, view: usize, corner: &Sighting) -> f64 {
    let seen = state.camera.project(&state.poses[view].act(&corner.point));
    seen.map_or(f64::INFINITY, |pixel| (pixel - corner.pixel).norm() * corner.weight().sqrt())
}

/// The limit of `|r|` that corners of these views must keep.
pub(super) fn limit(state: &State, views: &[View], rejection: f64) -> f64 {
    let mut lengths: Vec<f64> =
        views.iter().enumerate().flat_map(|(k, view)| view.corners.iter().map(move |c| misfit(state, k, c))).collect();
    let middle = robust::median(&mut lengths).unwrap_or(0.0);
    let mut deviations: Vec<f64> = lengths.iter().map(|l| (l - middle).abs()).collect();
    middle + rejection * robust::median(&mut deviations).unwrap_or(0.0)
}

/// The corners of the views that keep the limit; nothing for a view that has too few left.
pub(super) fn kept(state: &State, views: &[View], limit: f64) -> Vec<Option<View>> {
    let keep = |(k, view): (usize, &View)| {
        let corners: Vec<_> = view.corners.iter().filter(|c| misfit(state, k, c) <= limit).copied().collect();
        (corners.len() >= LEAST_CORNERS).then_some(View { image: view.image, corners })
    };
    views.iter().enumerate().map(keep).collect()
}

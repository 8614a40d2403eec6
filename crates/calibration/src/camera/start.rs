//! A first camera and first poses, from nothing but the views.
//!
//! Focal length: Zhang's two constraints on the homography `H = [h_1 h_2 h_3]` of a view, with the principal point in the
//! middle of the image and square pixels (`w = diag(x, x, 1)`, `x = 1/f^2`):
//!
//! ```text
//! h_1^T w h_2 = 0,    h_1^T w h_1 = h_2^T w h_2
//! ```
//!
//! each linear in x. They fail for views that face the camera and for lenses that bend much, so a grid of focal lengths
//! stands beside that one. Every candidate is judged by the reprojection error of poses alone, the best ones by a short
//! joint refinement. Source: Zhang, PAMI 22 (2000) 1330.

use super::adjust::{Adjusted, State, adjust};
use super::homography::homography;
use super::panel_pose::both_poses;
use super::view::View;
use groma_models::{Camera, Lens, Token};
use nalgebra::{Matrix3, Vector2};

/// Focal lengths tried, as shares of the image width: from a wide fisheye to a long lens.
const FOCAL_SHARES: [f64; 12] = [0.25, 0.33, 0.42, 0.54, 0.7, 0.9, 1.15, 1.5, 2.0, 2.7, 3.7, 5.0];
/// Views that judge a focal length.
const JUDGES: usize = 15;
/// Candidates that are refined.
const FINALISTS: usize = 3;
/// Squared residual beyond which a corner does not count more, in whitened pixels: half a hundred pixels at most.
const CAP: f64 = 1e4;
const SHORT: usize = 15;

/// The size of the image and the lens to be found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub width: u32,
    pub height: u32,
    pub lens: Lens,
}

/// The best first camera; nothing when no focal length explains the views, or the work was cancelled.
pub(super) fn first_camera(frame: Frame, views: &[View], token: &Token) -> Option<Camera> {
    let judges = spread(views, JUDGES);
    let width = f64::from(frame.width);
    let focals = zhang(frame, &judges).into_iter().chain(FOCAL_SHARES.map(|share| share * width));
    let mut candidates: Vec<(f64, State)> = focals.filter_map(|f| judged(frame, f, &judges, token)).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let finals = candidates.into_iter().take(FINALISTS).filter_map(|(_, state)| rough(state, &judges, token));
    finals.min_by(|a, b| a.error.total_cmp(&b.error)).map(|best| best.state.camera)
}

/// At most so many views, evenly from first to last.
fn spread(views: &[View], most: usize) -> Vec<View> {
    let step = views.len().div_ceil(most).max(1);
    views.iter().step_by(step).cloned().collect()
}

/// The capped error of a focal length, and the state that has it.
fn judged(frame: Frame, focal: f64, views: &[View], token: &Token) -> Option<(f64, State)> {
    let camera = Camera::centred(frame.width, frame.height, frame.lens, focal).ok()?;
    let mut state = State { camera, poses: vec![] };
    let mut error = 0.0;
    for view in views {
        token.check().ok()?;
        let (pose, of_view) = both_poses(&state.camera, &view.corners)?[0];
        error += of_view.min(CAP * view.corners.len() as f64);
        state.poses.push(pose);
    }
    Some((error, state))
}

/// Focal lengths and the first coefficient of the lens, then everything, for a few steps.
fn rough(state: State, views: &[View], token: &Token) -> Option<Adjusted> {
    let count = state.camera.count();
    let few: Vec<bool> = (0..count).map(|k| k < 2 || k == 4).collect();
    let first = adjust(state, views, &few, SHORT, token)?;
    adjust(first.state.clone(), views, &vec![true; count], SHORT, token).or(Some(first))
}

/// The focal length that all homographies agree on best; nothing when they do not tell one.
fn zhang(frame: Frame, views: &[View]) -> Option<f64> {
    let middle = Vector2::new(0.5 * (f64::from(frame.width) - 1.0), 0.5 * (f64::from(frame.height) - 1.0));
    let (mut slope_sq, mut product) = (0.0, 0.0);
    for view in views {
        let pairs: Vec<_> = view.corners.iter().map(|c| (c.point.xy(), c.pixel - middle)).collect();
        for (slope, value) in homography(&pairs).iter().flat_map(constraints) {
            slope_sq += slope * slope;
            product -= slope * value;
        }
    }
    let x = product / slope_sq;
    let share = (1.0 / x).sqrt() / f64::from(frame.width);
    (0.2..6.0).contains(&share).then_some(share * f64::from(frame.width))
}

/// `slope x + value = 0`, scaled such that views count alike.
fn constraints(h: &Matrix3<f64>) -> [(f64, f64); 2] {
    let ((a, b), row) = ((h.fixed_view::<2, 1>(0, 0), h.fixed_view::<2, 1>(0, 1)), (h[(2, 0)], h[(2, 1)]));
    let scale = a.norm() * b.norm();
    let straight = (a.dot(&b) / scale, row.0 * row.1 / scale);
    let equal = ((a.dot(&a) - b.dot(&b)) / scale, (row.0 * row.0 - row.1 * row.1) / scale);
    [straight, equal]
}

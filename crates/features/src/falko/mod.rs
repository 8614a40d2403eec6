//! FALKO: corners of a laser scan, from the shape of the neighbourhood of every beam.
//!
//! ```text
//! radius         r_i = a exp(b rho_i);  0.8 rho_i where that is not below rho_i
//! neighbourhood  C_L = {j < i : |p_j - p_i| <= r_i},  C_R = {j > i : ...},  each with at least m points
//! triangle       f, l = first, last neighbour;  B = |p_l - p_f|,  H = |(p_l - p_f) x (p_i - p_f)| / B;
//!                a candidate has B >= r_i / beta and H >= r_i / beta
//! orientation    theta_i = arg( mean_{C_L}(p_j - p_i) + mean_{C_R}(p_j - p_i) )
//! score          sum over the pairs of C_L and over the pairs of C_R of their distance on a ring of s sectors,
//!                counted from theta_i: low when both arms are straight
//! corners        of the normalised definition: score over its maximum below a threshold, best first, see `selection`;
//!                of the published one: q_i = max_score - score_i, peaks of q above a share of max_score, see `suppression`
//! position       intersection of the total-least-squares lines through C_L + i and C_R + i, see `corner`
//! ```
//!
//! Source: Kallasi, Rizzini, Caselli, RA-L 2016. The remainder in the ring distance is the true modulo, peaks of equal
//! score are not merged, and a scan that goes all round wraps: with these three the keypoints do not depend on how the
//! scanner is turned. (The authors' library uses the signed remainder and merges; its keypoints do depend on it.)
//!
//! The normalised definition is the default: its keypoints are found again more often (docs/theory/feature_evaluation.md).
//!
//! Everything is computed in the frame of the beam under test, where neighbour j = i + k lies at
//! `rho_j (cos k d, sin k d)` (d the bearing step): no polar conversion of the scan is needed, and the outcome cannot
//! depend on `angle_min`, to the last bit.
//!
//! Assumes beams evenly spaced in bearing and ranges of one moment (deskew moves points by less than the radius).
//! It does not segment the scan: a neighbour may lie on another surface.

mod batch;
mod corner;
mod detector;
pub(crate) mod layout;
mod neighbourhood;
mod options;
mod radius;
mod score;
mod selection;
mod suppression;
mod sweep;

pub use batch::detect_all;
pub use detector::Detector;
pub use options::{Definition, Options};

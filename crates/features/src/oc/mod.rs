//! OC: corners of walls that stand at right angles to each other, all in the one direction that dominates the scan.
//!
//! ```text
//! direction    HT(theta, rho) = points with rho = x cos theta + y sin theta, in bins of rho
//!              O(theta) = sum_rho HT(theta, rho)^2 + sum_rho HT(theta + pi/2, rho)^2,   theta in [0, pi/2)
//!              theta_0 = argmax O, refined by a parabola; the points are turned by -theta_0, then for beam i
//! radius       D_i = a exp(b rho_i);  0.8 rho_i where that is not below rho_i
//! neighbours   {j : |p_j - p_i| <= D_i}, at least m on each side;  (dx, dy) = p_j - p_i
//! arms         vertical: |dx| < tol <= |dy|,  n_x points;    horizontal: |dy| < tol <= |dx|,  n_y points
//! score        (n_x + n_y) / (0.1 + |n_x - n_y|); a corner needs more than 1, and m points on each arm
//! suppression  greedy: highest score first (then smallest distance to its corner), none within r_nms of one taken
//! position     (mean x of the vertical arm, mean y of the horizontal arm)
//! orientation  theta_0 + 45, 135, 225 or 315 degrees: the quadrant between the arms
//! covariance   of the means: diag(v_x, v_y) turned by theta_0, v = max(sigma^2, variance of the arm) / n
//! ```
//!
//! Source: Kallasi, Rizzini, Caselli, RA-L 2016; the spectrum is that of Censi, Iocchi, Grisetti, "Scan matching in the
//! Hough domain", ICRA 2005. Corrected against the authors' library: bins for negative rho as well (there, votes beyond
//! half of `rho_max` are lost); the search window follows the bearing step of the scan, not that of the spectrum; the
//! beam itself counts for neither side; beams without a hit are no points; an arm has at least m points (there one stray point
//! makes an arm); suppression is by distance, and consecutive corners of equal score are not merged; the direction is refined between the steps; a scan that goes all round wraps. The default radius
//! exceeds `tol` enough for the arms to hold points, which that of the library does not.
//!
//! The spectrum is taken coarse to fine (see `spectrum`) and counted in 16 bits, a row of rho for theta and one for theta + pi/2 at a time, which stay in the first
//! cache; the squares are summed while counting: `n^2 = sum_{k<n} (2 k + 1)`.
//! Everything is computed in the frame of beam 0, so the keypoints do not depend on `angle_min`, to the last bit.
//!
//! Assumes that most walls are at right angles; corners that stand otherwise are not found.

mod arms;
mod batch;
mod detector;
mod options;
mod spectrum;

pub use batch::detect_all;
pub use detector::Detector;
pub use options::Options;

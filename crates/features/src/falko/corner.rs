//! The corner between the beams: where the lines of its two arms meet, and how well that is known.
//!
//! Each line is the total-least-squares fit through the points of one arm and the beam's own point (so the own point
//! is in both). With the mean c, the direction u along the larger axis of the scatter and the normal n:
//!
//! ```text
//! lines:    n_k . x = n_k . c_k,     corner x = A^-1 b,   A = [n_1^T; n_2^T]
//! noise:    s_k^2 = max( (sigma n_k . e)^2 , smaller eigenvalue of the scatter / (N_k - 2) ),  e the beam direction
//! line at the corner:   v_k = s_k^2 (1/N_k + t_k^2 / S_k),   t_k = u_k . (x - c_k),  S_k the larger eigenvalue
//! shared point:         v_12 = w_1 w_2 s_1 s_2 sign(n_1.e n_2.e),  w_k = 1/N_k + t_k (u_k . (p_i - c_k)) / S_k
//! corner:   Cov = A^-1 [[v_1, v_12], [v_12, v_2]] A^-T + (g^2 + h^2) I,   g = rho d / 8,   h = 5 s^2 / r
//! ```
//!
//! The first term is first order in the noise, for arms whose points are rightly distinguished. They are not quite: the
//! corner lies somewhere between two beams and its own point is put into both lines (g), and noise makes another beam
//! than the nearest the peak, so that points of one arm, over a length of the order of the noise, are fitted with the
//! other (h, second order; s the larger of sigma and s_k). The factors 1/8 and 5 are from simulated corners of 70 to 140
//! degrees, 1 to 6 m away, of 0.3 and 1 degree and 1 to 30 mm noise; the tests hold the coverage there.
//!
//! The corner is the beam's own point where the lines are parallel (`|det A| <= 1e-7`) or meet 0.2 m away or more; its
//! covariance is then that of the range along the beam and of the beam spacing across, `(rho d)^2 / 12`.

use super::neighbourhood::{Arm, Arms};
use nalgebra::{Matrix2, Vector2};

/// Lines whose normals span less than this do not meet.
const PARALLEL: f64 = 1e-7;
/// A corner farther than this from its beam's point is none of it [m].
const FARTHEST: f64 = 0.2;

/// A corner relative to its beam's point, in the beam's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub offset: Vector2<f64>,
    pub covariance: Matrix2<f64>,
}

/// What limits how well a corner is seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Standard deviation of a range [m].
    pub sigma: f64,
    /// Distance of neighbouring beams at the corner, rho d [m].
    pub spacing: f64,
    /// Radius of the neighbourhood [m].
    pub radius: f64,
}

/// The corner of a beam.
pub(super) fn locate(arms: &Arms, resolution: &Resolution) -> Corner {
    let (left, right) = (Line::fit(&arms.left), Line::fit(&arms.right));
    meet(&left, &right, resolution).unwrap_or_else(|| on_beam(resolution))
}

/// The beam's own point.
pub(super) fn on_beam(resolution: &Resolution) -> Corner {
    let &Resolution { sigma, spacing, .. } = resolution;
    Corner { offset: Vector2::zeros(), covariance: Matrix2::new(sigma * sigma, 0.0, 0.0, spacing * spacing / 12.0) }
}

/// Where two lines meet, near the origin.
fn meet(a: &Line, b: &Line, resolution: &Resolution) -> Option<Corner> {
    let det = a.normal.perp(&b.normal);
    if det.abs() <= PARALLEL {
        return None;
    }
    let inverse = Matrix2::new(b.normal.y, -a.normal.y, -b.normal.x, a.normal.x) / det;
    let offset = inverse * Vector2::new(a.normal.dot(&a.mean), b.normal.dot(&b.mean));
    let first_order = inverse * lines(a, b, offset, resolution.sigma) * inverse.transpose();
    let beyond = Matrix2::identity() * confusion(a, b, resolution);
    (offset.norm() < FARTHEST).then_some(Corner { offset, covariance: first_order + beyond })
}

/// Covariance of the two lines' positions at `x`, each across itself.
fn lines(a: &Line, b: &Line, x: Vector2<f64>, sigma: f64) -> Matrix2<f64> {
    let shared = a.own_weight(x) * b.own_weight(x) * a.noise(sigma) * b.noise(sigma);
    let v_ab = shared * (a.normal.x * b.normal.x).signum();
    Matrix2::new(a.variance(x, sigma), v_ab, v_ab, b.variance(x, sigma))
}

/// Variance from points that are fitted with the wrong arm: g^2 + h^2.
fn confusion(a: &Line, b: &Line, resolution: &Resolution) -> f64 {
    let &Resolution { sigma, spacing, radius } = resolution;
    let noise = sigma.max(a.noise(sigma)).max(b.noise(sigma));
    (spacing / 8.0).powi(2) + (5.0 * noise * noise / radius).powi(2)
}

/// Cosine and sine of half the angle of `(x, y)`, which has the length `length`; of angle 0 where that is 0.
fn half_angle(x: f64, y: f64, length: f64) -> (f64, f64) {
    if length == 0.0 {
        return (1.0, 0.0);
    }
    let (cos_2, sin_2) = (x / length, y / length);
    if cos_2 >= 0.0 {
        let cos = (0.5 * (1.0 + cos_2)).sqrt();
        (cos, 0.5 * sin_2 / cos)
    } else {
        let sin = (0.5 * (1.0 - cos_2)).sqrt().copysign(sin_2);
        (0.5 * sin_2 / sin, sin)
    }
}

/// A total-least-squares line through an arm and the origin.
struct Line {
    mean: Vector2<f64>,
    normal: Vector2<f64>,
    points: f64,
    /// Scatter across the line and along it [m^2].
    across: f64,
    along: f64,
}

impl Line {
    fn fit(arm: &Arm) -> Self {
        let (points, (x, y)) = (arm.len() as f64 + 1.0, arm.points());
        let mean = arm.mean() * (arm.len() as f64 / points);
        // Of the double angle: sums of squares less their half, and of products.
        let (mut difference, mut product) = (mean.x * mean.x - mean.y * mean.y, 2.0 * mean.x * mean.y);
        let mut total = mean.norm_squared();
        for (x, y) in x.iter().zip(y) {
            let (x, y) = (x - mean.x, y - mean.y);
            difference += x * x - y * y;
            product += 2.0 * x * y;
            total += x * x + y * y;
        }
        let spread = difference.hypot(product);
        let (cos, sin) = half_angle(difference, product, spread);
        let (across, along) = (0.5 * (total - spread).max(0.0), 0.5 * (total + spread));
        Self { mean, normal: Vector2::new(-sin, cos), points, across, along }
    }

    /// Standard deviation of a point across the line: of the range noise, or of the points where that is more.
    fn noise(&self, sigma: f64) -> f64 {
        let scatter = if self.points > 2.0 { self.across / (self.points - 2.0) } else { 0.0 };
        (sigma * self.normal.x).abs().max(scatter.sqrt())
    }

    /// By how much a shift of point `p` across the line shifts the line at `x`.
    fn weight(&self, p: Vector2<f64>, x: Vector2<f64>) -> f64 {
        1.0 / self.points + self.normal.perp(&(x - self.mean)) * self.normal.perp(&(p - self.mean)) / self.along
    }

    fn own_weight(&self, x: Vector2<f64>) -> f64 {
        self.weight(Vector2::zeros(), x)
    }

    /// Variance of the line at `x`, across.
    fn variance(&self, x: Vector2<f64>, sigma: f64) -> f64 {
        self.noise(sigma).powi(2) * self.weight(x, x)
    }
}

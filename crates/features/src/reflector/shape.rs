//! The centre of a mark: of a flat one, of a post, or of both by their probabilities.
//!
//! In the frame of the mark's middle bearing (x along it, y towards growing index) the mark has N hits at bearings t_i with
//! ranges rho_i, its ends lie at t_a, t_b, each known to a bearing step d (uniform, variance d^2 / 12).
//!
//! ```text
//! flat     line x = a + b y through the hits, least squares with b ~ N(0, v), v = max(1, e^(2 q) - 1): the light of a flat
//!          mark falls with the cosine of the incidence, tan^2 = 1/cos^2 - 1; q says how dim it is beside the brightest
//!          ends  e = x(t) (1, tan t),  x(t) = a / (1 - b tan t);   centre (e_a + e_b) / 2
//! post     axis (c, u), radius R known:  x_i = c - sqrt(R^2 - (y_i - u)^2);  N hits leave u in [-U, U],
//!          U = min(R - (N - 1) D / 2, (N + 1) D / 2 - R),  D = rho d;  c by least squares, averaged over u
//! odds     post : flat = exp(-(E_post - E_flat) / 2) (2 U / D) : sqrt(v_b / v) / (N ln(w_max / w_min)),
//!          E the squared residuals over sigma^2 (flat: with b^2 / v; post: with (q / DIM)^2, for a post is never dim),
//!          v_b the variance of b after the fit: both evidences by Laplace's approximation, with widths of flat marks
//!          equally likely on a logarithmic scale
//! centre   mixture mean, covariance with the spread between the two; a flat mark of unknown slope may lie along the beam
//!          within what its ends leave open: v_b (x d)^2 / 12 besides
//! ```
//!
//! The noise of a range is the option's, or that of the hits about the line where they say more.
//! Assumes that a hit is bright when the middle of its beam is on the mark.

use super::Options;
use nalgebra::{Matrix2, Vector2};

/// Offsets of a post over which is averaged.
const NODES: usize = 9;
/// Hits from which the residuals may raise the noise.
const ENOUGH: usize = 5;
/// Least share of a beam spacing that the offset of a post is uncertain by.
const LEAST_OFFSET: f64 = 0.1;

/// Spread of the logarithm of the brightness of posts, from the level of the diffuse surfaces mostly.
const DIM: f64 = 0.7;
/// Steepest slope that dimness may tell.
const STEEPEST: f64 = 6.0;

/// Bright beams of one mark, bearings from the middle one.
pub(super) struct Run<'a> {
    /// Bearing [rad] and range [m].
    pub hits: &'a [(f64, f64)],
    /// Bearings halfway to the dark beams before and behind [rad].
    pub ends: (f64, f64),
    /// Bearing step [rad].
    pub step: f64,
    /// By how much the logarithm of the intensities falls short of the brightest mark's.
    pub dimness: f64,
}

/// A centre in the frame of the middle bearing.
pub(super) struct Located {
    pub center: Vector2<f64>,
    pub covariance: Matrix2<f64>,
    pub post: f64,
}

/// One explanation of a run.
struct Shape {
    center: Vector2<f64>,
    covariance: Matrix2<f64>,
    log_evidence: f64,
}

/// The centre of a mark.
pub(super) fn locate(run: &Run, options: &Options) -> Located {
    let points: Vec<Vector2<f64>> = run.hits.iter().map(|&(t, r)| Vector2::new(r * t.cos(), r * t.sin())).collect();
    let steep = ((2.0 * run.dimness).exp() - 1.0).clamp(1.0, STEEPEST * STEEPEST);
    let line = Line::fit(&points, options.range_noise, steep);
    let flat = line.mark(run, options);
    let Some(post) = post(&points, run, line.sigma, options.post_radius) else {
        return Located { center: flat.center, covariance: flat.covariance, post: 0.0 };
    };
    let share = 1.0 / (1.0 + (flat.log_evidence - post.log_evidence).exp());
    let apart = post.center - flat.center;
    Located {
        center: flat.center + apart * share,
        covariance: post.covariance * share
            + flat.covariance * (1.0 - share)
            + apart * apart.transpose() * (share * (1.0 - share)),
        post: share,
    }
}

/// x = a + b y through the hits.
struct Line {
    a: f64,
    b: f64,
    /// Of (a, b), for unit noise.
    spread: Matrix2<f64>,
    squares: f64,
    sigma: f64,
    /// Variance of the slope before the fit.
    steep: f64,
}

impl Line {
    fn fit(points: &[Vector2<f64>], noise: f64, steep: f64) -> Self {
        let prior = noise * noise / steep;
        let (mut normal, mut right) = (Matrix2::new(0.0, 0.0, 0.0, prior), Vector2::zeros());
        for p in points {
            let row = Vector2::new(1.0, p.y);
            normal += row * row.transpose();
            right += row * p.x;
        }
        let spread = normal.try_inverse().unwrap_or_else(Matrix2::identity);
        let solution = spread * right;
        let (a, b) = (solution.x, solution.y);
        let squares = points.iter().map(|p| (p.x - a - b * p.y).powi(2)).sum::<f64>();
        let freedom = points.len().saturating_sub(2) as f64;
        let seen = if points.len() >= ENOUGH { (squares / freedom).sqrt() } else { 0.0 };
        Self { a, b, spread, squares, sigma: noise.max(seen), steep }
    }

    fn mark(&self, run: &Run, options: &Options) -> Shape {
        let (a, b) = (self.end(run.ends.0), self.end(run.ends.1));
        let center = (a.0 + b.0) / 2.0;
        let by_line = (a.1 + b.1) / 2.0;
        let edges = (a.2 * a.2.transpose() + b.2 * b.2.transpose()) * (run.step * run.step / 48.0);
        let fit = by_line * self.spread * by_line.transpose() * (self.sigma * self.sigma);
        let slope_variance = self.spread.m22 * self.sigma * self.sigma;
        let widths = (options.width_max / options.width_min).ln().max(1.0) * run.hits.len() as f64;
        let error = self.squares / (self.sigma * self.sigma) + self.b * self.b / self.steep;
        let along = slope_variance * (self.a * run.step).powi(2) / 12.0;
        Shape {
            center,
            covariance: fit + edges + Matrix2::new(along, 0.0, 0.0, 0.0),
            log_evidence: 0.5 * (slope_variance / self.steep).ln() - widths.ln() - error / 2.0,
        }
    }

    /// The point of the line at a bearing, its derivatives by (a, b) and by the bearing.
    fn end(&self, bearing: f64) -> (Vector2<f64>, Matrix2<f64>, Vector2<f64>) {
        let t = bearing.tan();
        // A line along the beam has no point there: keep away from it.
        let open = (1.0 - self.b * t).max(0.1);
        let x = self.a / open;
        let ray = Vector2::new(1.0, t);
        let by_line = Matrix2::from_columns(&[ray / open, ray * (x * t / open)]);
        let secant_sq = 1.0 + t * t;
        let by_bearing = (ray * (x * self.b / open) + Vector2::new(0.0, x)) * secant_sq;
        (ray * x, by_line, by_bearing)
    }
}

/// The post that N hits leave room for; none when posts are not expected.
fn post(points: &[Vector2<f64>], run: &Run, sigma: f64, radius: f64) -> Option<Shape> {
    let n = points.len() as f64;
    let spacing = points.iter().map(|p| p.x).sum::<f64>() / n * run.step;
    let beams = ((run.ends.1 - run.ends.0) / run.step).round();
    let room = (radius - (beams - 1.0) * spacing / 2.0).min((beams + 1.0) * spacing / 2.0 - radius);
    if radius <= 0.0 || room < -0.5 * spacing {
        return None;
    }
    let half = room.max(LEAST_OFFSET * spacing);
    let offsets = (0..NODES).map(|k| half * (2.0 * (k as f64 + 0.5) / NODES as f64 - 1.0));
    let fits: Vec<(f64, f64)> = offsets.map(|u| axis(points, u, radius)).collect();
    let mean = fits.iter().map(|f| f.0).sum::<f64>() / NODES as f64;
    let between = fits.iter().map(|f| (f.0 - mean).powi(2)).sum::<f64>() / NODES as f64;
    let squares = fits.iter().map(|f| f.1).sum::<f64>() / NODES as f64;
    let miss = (-room / spacing).max(0.0);
    let share = (2.0 * half / spacing).min(1.0) * (-8.0 * miss * miss).exp();
    Some(Shape {
        center: Vector2::new(mean, 0.0),
        covariance: Matrix2::new(sigma * sigma / n + between, 0.0, 0.0, half * half / 3.0),
        log_evidence: share.ln() - squares / (2.0 * sigma * sigma) - 0.5 * (run.dimness / DIM).powi(2),
    })
}

/// Distance of the axis when it lies `offset` to the side, and the squared residuals.
fn axis(points: &[Vector2<f64>], offset: f64, radius: f64) -> (f64, f64) {
    let chord = |p: &Vector2<f64>| (radius * radius - (p.y - offset).powi(2)).max(0.0).sqrt();
    let distance = points.iter().map(|p| p.x + chord(p)).sum::<f64>() / points.len() as f64;
    (distance, points.iter().map(|p| (p.x + chord(p) - distance).powi(2)).sum())
}

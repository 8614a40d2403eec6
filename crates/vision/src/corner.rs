//! Where two edges cross, from the grey values around: a fit of four blurred quadrants.
//!
//! Near a corner q the image is four flat quadrants between two straight edges with normals n_1, n_2, blurred:
//!
//! ```text
//! I(x) = a + b E(u) + c E(v) + d E(u) E(v),   u = n_1 . (x - q) / s,   v = n_2 . (x - q) / s,   E(t) = erf(t/sqrt 2)
//! ```
//!
//! which holds corners of a chessboard (b = c = 0), of a lone square (b = c = d) and any between. The nine unknowns
//! (q, the angles of the normals, ln s, a..d) are fitted by Levenberg-Marquardt to the pixels of a disc. The standard
//! deviation is that of the fit, with the residuals' variance: noise and misfit together. The spread s [pixel] is a
//! measure of blur.
//!
//! Assumes edges straight within the disc and blur alike in all directions. Where edges cross aslant, the product is not
//! quite the blurred corner; for a chessboard this moves nothing, for it is the same seen from both sides. It does not
//! search: the guess must lie well within the disc.

use crate::apriltag::Tag;
use crate::image::Gray;
use crate::special::edge;
use groma_estimation::levenberg_marquardt::{Minimum, Normal, Options, Problem, minimize};
use nalgebra::{SMatrix, SVector, Vector2};
use std::convert::Infallible;

/// Least radius of the disc [pixel]: below, the unknowns outnumber what a blurred edge tells.
pub const LEAST_RADIUS: f64 = 2.5;
/// Largest radius of the disc [pixel]: beyond, the lens bends edges more than noise averages out.
pub const LARGEST_RADIUS: f64 = 6.0;
/// Standard deviation claimed at the least [pixel]: what lenses and prints leave however good the image is.
const LEAST_SIGMA: f64 = 0.02;
/// Standard deviation above which a fit is no better than the guess [pixel].
const USELESS_SIGMA: f64 = 0.3;
/// Share of the radius by which a corner may move from its guess.
const FARTHEST_MOVE: f64 = 0.5;
/// Sine of the least angle between edges.
const LEAST_SINE: f64 = 0.3;
/// Variance that rounding adds to a grey value.
const ROUNDING: f64 = 1.0 / 12.0;
/// Bounds of ln s.
const LOG_SPREAD: (f64, f64) = (-1.5, 2.0);
/// The end is a step that promises less than this share of the squared error: a few thousandths of a standard deviation.
const OPTIONS: Options = Options { max_iterations: 30, tolerance: 1e-7 };
const UNKNOWNS: usize = 9;

type Unknowns = SVector<f64, UNKNOWNS>;

/// Where a corner may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guess {
    /// The place [pixel].
    pub pixel: Vector2<f64>,
    /// Direction of one edge.
    pub first: Vector2<f64>,
    /// Direction of the other.
    pub second: Vector2<f64>,
    /// How far around nothing else is to be seen [pixel].
    pub room: f64,
}

impl Guess {
    /// Where a corner of a tag may be; `room` is the free share of its edge.
    pub(crate) fn of_tag(tag: &Tag, j: usize, room: f64) -> Self {
        let (pixel, next, last) = (tag.corners[j], tag.corners[(j + 1) % 4], tag.corners[(j + 3) % 4]);
        let (first, second) = (next - pixel, last - pixel);
        // Across an edge that is crossed aslant, there is less room than along the other.
        let aslant = (first.perp(&second) / (first.norm() * second.norm())).abs();
        Self { pixel, first, second, room: room * first.norm().min(second.norm()) * aslant }
    }
}

/// Where a corner is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The place [pixel].
    pub pixel: Vector2<f64>,
    /// Standard deviation of a coordinate [pixel].
    pub sigma: f64,
    /// Spread of the edges [pixel].
    pub blur: f64,
}

/// A pixel of the disc: offset from the guess, grey value.
struct Sample {
    offset: Vector2<f64>,
    grey: f64,
}

/// The corner near a guess; nothing when there is no room, no corner, or none where it was guessed.
#[must_use]
pub fn refine(image: &Gray<'_>, guess: &Guess) -> Option<Corner> {
    let radius = guess.room.min(LARGEST_RADIUS);
    if radius.is_nan() || radius < LEAST_RADIUS {
        return None;
    }
    let samples = disc(image, &guess.pixel, radius)?;
    let mut fit = CornerFit { samples: &samples, trial: Normal::zeros(), at: Normal::zeros() };
    let Ok(end) = minimize(&mut fit, start(guess, &samples)?, &OPTIONS);
    let Minimum { state: unknowns, cost, .. } = end?;
    let variance = cost / (samples.len() - UNKNOWNS) as f64 + ROUNDING;
    let covariance = fit.at.information.try_inverse()? * variance;
    let sigma = (0.5 * (covariance[(0, 0)] + covariance[(1, 1)])).sqrt().max(LEAST_SIGMA);
    let (moved, blur) = (Vector2::new(unknowns[0], unknowns[1]), unknowns[4].exp());
    let crosses = (unknowns[2] - unknowns[3]).sin().abs() > LEAST_SINE;
    let good = crosses && sigma < USELESS_SIGMA && moved.norm() < FARTHEST_MOVE * radius && blur < radius;
    good.then_some(Corner { pixel: guess.pixel + moved, sigma, blur })
}

/// The pixels within a radius; nothing when the disc leaves the image.
fn disc(image: &Gray<'_>, centre: &Vector2<f64>, radius: f64) -> Option<Vec<Sample>> {
    if image.inset(centre.x, centre.y) < radius + 0.5 {
        return None;
    }
    let range = |c: f64| ((c - radius).ceil() as i64)..=((c + radius).floor() as i64);
    let at = |x: i64, y: i64| {
        let offset = Vector2::new(x as f64, y as f64) - centre;
        let grey = image.at(x, y)?;
        (offset.norm_squared() <= radius * radius).then_some(Sample { offset, grey })
    };
    let samples: Vec<_> = range(centre.y).flat_map(|y| range(centre.x).filter_map(move |x| at(x, y))).collect();
    (samples.len() > 2 * UNKNOWNS).then_some(samples)
}

/// The edges as guessed, a spread of a pixel, and the quadrants that fit best to them.
fn start(guess: &Guess, samples: &[Sample]) -> Option<Unknowns> {
    let normal = |along: Vector2<f64>| along.x.atan2(-along.y);
    let mut unknowns = Unknowns::zeros();
    (unknowns[2], unknowns[3]) = (normal(guess.first), normal(guess.second));
    let (mut normals, mut right) = (SMatrix::<f64, 4, 4>::zeros(), SVector::<f64, 4>::zeros());
    for sample in samples {
        let by_greys = model(&unknowns, &sample.offset).1.fixed_rows::<4>(5).into_owned();
        normals += by_greys * by_greys.transpose();
        right += by_greys * sample.grey;
    }
    let greys = normals.cholesky()?.solve(&right);
    unknowns.fixed_rows_mut::<4>(5).copy_from(&greys);
    unknowns.iter().all(|v| v.is_finite()).then_some(unknowns)
}

/// I and its derivatives at an offset from the guess.
fn model(unknowns: &Unknowns, offset: &Vector2<f64>) -> (f64, Unknowns) {
    let (q, [b, c, d]) = (unknowns.fixed_rows::<2>(0), [unknowns[6], unknowns[7], unknowns[8]]);
    let (from, scale) = (offset - q, (-unknowns[4]).exp());
    let ((sine_1, cosine_1), (sine_2, cosine_2)) = (unknowns[2].sin_cos(), unknowns[3].sin_cos());
    let u = (cosine_1 * from.x + sine_1 * from.y) * scale;
    let v = (cosine_2 * from.x + sine_2 * from.y) * scale;
    let ((edge_u, slope_u), (edge_v, slope_v)) = (edge(u), edge(v));
    let (by_u, by_v) = ((b + d * edge_v) * slope_u, (c + d * edge_u) * slope_v);
    let derivatives = [
        -(by_u * cosine_1 + by_v * cosine_2) * scale,
        -(by_u * sine_1 + by_v * sine_2) * scale,
        by_u * (cosine_1 * from.y - sine_1 * from.x) * scale,
        by_v * (cosine_2 * from.y - sine_2 * from.x) * scale,
        -(by_u * u + by_v * v),
        1.0,
        edge_u,
        edge_v,
        edge_u * edge_v,
    ];
    (unknowns[5] + b * edge_u + c * edge_v + d * edge_u * edge_v, Unknowns::from(derivatives))
}

/// The unknowns as a problem: their normal equations come with their cost.
struct CornerFit<'a> {
    samples: &'a [Sample],
    trial: Normal<UNKNOWNS>,
    at: Normal<UNKNOWNS>,
}

impl Problem for CornerFit<'_> {
    type State = Unknowns;
    type Step = Unknowns;
    type Error = Infallible;

    fn cost(&mut self, unknowns: &Unknowns) -> Result<Option<f64>, Infallible> {
        let (mut error, mut sums) = (0.0, Normal::<UNKNOWNS>::zeros());
        for sample in self.samples {
            let (value, by) = model(unknowns, &sample.offset);
            let residual = value - sample.grey;
            sums.information.ger(1.0, &by, &by, 1.0);
            sums.gradient.axpy(residual, &by, 1.0);
            error += residual * residual;
        }
        self.trial = sums;
        Ok(error.is_finite().then_some(error))
    }

    fn linearize(&mut self, _: &Unknowns) -> Result<(), Infallible> {
        self.at = self.trial;
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Unknowns, f64)>, Infallible> {
        Ok(self.at.step(damping))
    }

    fn moved(&self, unknowns: &Unknowns, step: &Unknowns) -> Option<Unknowns> {
        let mut moved = unknowns + step;
        moved[4] = moved[4].clamp(LOG_SPREAD.0, LOG_SPREAD.1);
        Some(moved)
    }
}

//! The spread of a pair over neighbouring bins, from tables of whole numbers.
//!
//! A pair at position x (in bins) falls into cell `floor(x)`; bin c has its centre at c + 1/2. The kernel is tabulated for
//! [`STEPS`] positions within a cell, so a pair is placed to 1/32 of a bin, and its weights are whole numbers that sum to
//! [`UNIT`] but for rounding: their products and sums are exact in `f64` for 10^8 pairs.

/// Positions within a bin that are distinguished.
const STEPS: usize = 32;
/// Weight of a pair along one axis.
const UNIT: f64 = 4096.0;

/// Weights over the whole circle of `n` bins.
#[derive(Clone, Debug)]
pub(super) struct Circular {
    bins: usize,
    weights: Vec<f64>,
}

impl Circular {
    /// A Gaussian of standard deviation `sigma` bins, wrapped onto the circle.
    pub fn new(bins: usize, sigma: f64) -> Self {
        let density = |d: f64| (-3..=3).map(|turn| gauss(d + f64::from(turn) * bins as f64, sigma)).sum();
        let row = |step| scaled((0..bins).map(|c| density(c as f64 + 0.5 - middle(step))).collect());
        Self { bins, weights: (0..STEPS).flat_map(row).collect() }
    }

    /// Position `x` in [0, bins): its bin, and the weights of that bin and all after it, around the circle.
    pub fn at(&self, x: f64) -> (usize, &[f64]) {
        let (cell, step) = split(x, self.bins);
        (cell, &self.weights[step * self.bins..][..self.bins])
    }
}

/// Weights on a line of bins, out to three standard deviations.
#[derive(Clone, Debug)]
pub(super) struct Linear {
    bins: usize,
    reach: usize,
    weights: Vec<f64>,
}

impl Linear {
    /// A Gaussian of standard deviation `sigma` bins.
    pub fn new(bins: usize, sigma: f64) -> Self {
        let reach = ((3.0 * sigma).ceil() as usize).min(bins);
        let offset = |k: usize| k as f64 - reach as f64 + 0.5;
        let row = |step| scaled((0..=2 * reach).map(|k| gauss(offset(k) - middle(step), sigma)).collect());
        Self { bins, reach, weights: (0..STEPS).flat_map(row).collect() }
    }

    /// Position `x` in [0, bins): the first bin it touches, and the weights from there on, cut at the ends.
    pub fn at(&self, x: f64) -> (usize, &[f64]) {
        let (cell, step) = split(x, self.bins);
        let width = 2 * self.reach + 1;
        let row = &self.weights[step * width..][..width];
        let skipped = self.reach.saturating_sub(cell);
        let first = cell + skipped - self.reach;
        (first, &row[skipped..(self.bins - first + skipped).min(width)])
    }
}

fn split(x: f64, bins: usize) -> (usize, usize) {
    let position = ((x * STEPS as f64) as usize).min(bins * STEPS - 1);
    (position / STEPS, position % STEPS)
}

fn middle(step: usize) -> f64 {
    (step as f64 + 0.5) / STEPS as f64
}

fn gauss(d: f64, sigma: f64) -> f64 {
    (-0.5 * (d / sigma).powi(2)).exp()
}

fn scaled(row: Vec<f64>) -> Vec<f64> {
    let sum: f64 = row.iter().sum();
    row.iter().map(|w| if sum > 0.0 { (w / sum * UNIT).round() } else { 0.0 }).collect()
}

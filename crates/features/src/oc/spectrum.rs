//! The direction that dominates a scan, from the ortho-spectrum of its points, coarse to fine.
//!
//! The spectrum is first taken at every fourth direction with bins four times as wide, so that its peak is as many steps
//! wide as before, and of a dense scan from every other point or fewer, then in full within four steps of the best: an eighth of
//! the work and a little. Two directions whose energies nearly tie may be distinguished otherwise than by the full spectrum.

use super::Options;
use std::f64::consts::FRAC_PI_2;

/// Added to a number below 2^15, this leaves the number, rounded, in the low bits of the sum.
const ROUNDER: f32 = 12_582_912.0;
/// Steps, and bins, in one of the coarse level.
const COARSE: usize = 4;
/// Points that the coarse level makes do with.
const ENOUGH: usize = 150;
/// Points whose bins are computed side by side.
const BLOCK: usize = 64;

/// The spectrum with its tables and workspace.
#[derive(Clone, Debug)]
pub(super) struct Spectrum {
    /// Cosine and sine of the directions in [0, pi/2), per bin of rho.
    directions: Vec<(f32, f32)>,
    /// Bins of one sign of rho, at most.
    half: f32,
    rho_step: f64,
    /// Points that vote, and those of them that vote at the coarse level.
    all: Points,
    some: Points,
    rows: Rows,
}

/// Coordinates of points, in metres.
#[derive(Clone, Debug, Default)]
struct Points {
    x: Vec<f32>,
    y: Vec<f32>,
}

/// Bins of rho for theta, and for theta + pi/2.
#[derive(Clone, Debug)]
struct Rows([Vec<u16>; 2]);

impl Spectrum {
    /// A spectrum of the steps of the options.
    pub fn new(options: &Options) -> Self {
        let steps = (FRAC_PI_2 / options.angle_step).ceil() as usize;
        let direction = |k: usize| {
            let (sin, cos) = (k as f64 * FRAC_PI_2 / steps as f64).sin_cos();
            ((cos / options.rho_step) as f32, (sin / options.rho_step) as f32)
        };
        let half = (options.rho_max / options.rho_step).ceil() as f32;
        // One more than the bins on either side, for rounding; a power of two, for the mask.
        let row = vec![0; (2 * half as usize + 3).next_power_of_two()];
        Self {
            directions: (0..steps).map(direction).collect(),
            half,
            rho_step: options.rho_step,
            all: Points::default(),
            some: Points::default(),
            rows: Rows([row.clone(), row]),
        }
    }

    /// The direction in [0, pi/2) along which, or across which, most walls run; 0 for no points.
    ///
    /// Points that are NaN or farther than `rho_max` do not vote.
    pub fn dominant(&mut self, x: &[f64], y: &[f64]) -> f64 {
        self.load(x, y);
        let n = self.directions.len();
        let coarse = self.best_of((0..n).step_by(COARSE), true);
        let best = if n > 4 * COARSE {
            self.best_of((n - COARSE..=n + COARSE).map(|k| (coarse + k) % n), false)
        } else {
            self.best_of(0..n, false)
        };
        let step = FRAC_PI_2 / self.directions.len() as f64;
        ((best as f64 + self.peak_offset(best)) * step).rem_euclid(FRAC_PI_2)
    }

    /// Of the given directions the one with most energy, the first of equals.
    fn best_of(&mut self, directions: impl Iterator<Item = usize>, coarse: bool) -> usize {
        let mut best = (0, 0);
        for k in directions {
            let energy = self.energy_at(k, coarse);
            best = if energy > best.1 { (k, energy) } else { best };
        }
        best.0
    }

    fn load(&mut self, x: &[f64], y: &[f64]) {
        let farthest = f64::from(self.half - 1.0) * self.rho_step;
        let near = |x: f64, y: f64| x * x + y * y <= farthest * farthest;
        self.all.clear();
        for (&x, &y) in x.iter().zip(y).filter(|(x, y)| near(**x, **y)) {
            self.all.push(x as f32, y as f32);
        }
        self.some.clear();
        for k in (0..self.all.x.len()).step_by((self.all.x.len() / ENOUGH).max(1)) {
            self.some.push(self.all.x[k], self.all.y[k]);
        }
    }

    /// O(theta_k): the sum of the squares of the bins of both rows.
    fn energy_at(&mut self, k: usize, coarse: bool) -> u64 {
        let (cos, sin) = self.directions[k];
        let zero = self.half + 1.0 + ROUNDER;
        if coarse {
            let scale = 1.0 / COARSE as f32;
            self.rows.energy(&self.some, (scale * cos, scale * sin), zero)
        } else {
            self.rows.energy(&self.all, (cos, sin), zero)
        }
    }

    /// Where the top of the parabola through a value and its neighbours around the circle lies, in steps.
    fn peak_offset(&mut self, best: usize) -> f64 {
        let n = self.directions.len();
        let mut at = |k: usize| self.energy_at(k % n, false) as f64;
        let (before, here, after) = (at(best + n - 1), at(best), at(best + 1));
        let curvature = before - 2.0 * here + after;
        if n >= 3 && curvature < 0.0 { (0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
    }
}

impl Points {
    fn clear(&mut self) {
        self.x.clear();
        self.y.clear();
    }

    fn push(&mut self, x: f32, y: f32) {
        self.x.push(x);
        self.y.push(y);
    }
}

impl Rows {
    /// Sum of the squares of the bins, `zero` being that of rho = 0.
    fn energy(&mut self, points: &Points, (cos, sin): (f32, f32), zero: f32) -> u64 {
        let [along, across] = &mut self.0;
        along.fill(0);
        across.fill(0);
        let mut energy = 0;
        for (x, y) in points.x.chunks(BLOCK).zip(points.y.chunks(BLOCK)) {
            let mut bins = [(0_u32, 0_u32); BLOCK];
            for (bin, (x, y)) in bins.iter_mut().zip(x.iter().zip(y)) {
                *bin = ((x * cos + y * sin + zero).to_bits(), (y * cos - x * sin + zero).to_bits());
            }
            for (p, q) in &bins[..x.len()] {
                energy += count(along, *p) + count(across, *q);
            }
        }
        energy
    }
}

/// Count a point in the bin of the low bits; by how much the square of the bin grows.
#[inline(always)]
fn count(row: &mut [u16], bin: u32) -> u64 {
    let mask = row.len() - 1;
    let cell = &mut row[bin as usize & mask];
    let before = *cell;
    *cell = before.saturating_add(1);
    2 * u64::from(before) + 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_estimation::random::SplitMix64;

    /// The definition, in f64, of the grid of directions.
    fn by_definition(x: &[f64], y: &[f64], options: &Options) -> Vec<u64> {
        let steps = (FRAC_PI_2 / options.angle_step).ceil() as usize;
        let squares = |cos: f64, sin: f64| {
            let mut bins = std::collections::BTreeMap::<i64, u64>::new();
            for (x, y) in x.iter().zip(y) {
                *bins.entry(((x * cos + y * sin) / options.rho_step).round() as i64).or_default() += 1;
            }
            bins.values().map(|n| n * n).sum::<u64>()
        };
        let both = |theta: f64| squares(theta.cos(), theta.sin()) + squares(-theta.sin(), theta.cos());
        (0..steps).map(|k| both(k as f64 * FRAC_PI_2 / steps as f64)).collect()
    }

    #[test]
    fn equals_the_definition() {
        let mut draw = SplitMix64::new(4);
        let (x, y): (Vec<f64>, Vec<f64>) = (0..300).map(|_| (12.0 * draw.uniform() - 6.0, 6.0 * draw.normal())).unzip();
        let near: Vec<usize> = (0..300).filter(|&i| f64::hypot(x[i], y[i]) < 9.9).collect();
        let (x, y): (Vec<f64>, Vec<f64>) = near.iter().map(|&i| (x[i], y[i])).unzip();
        let options = Options::default();
        let mut spectrum = Spectrum::new(&options);
        spectrum.load(&x, &y);
        for (k, slow) in by_definition(&x, &y, &options).into_iter().enumerate() {
            let fast = spectrum.energy_at(k, false);
            assert!(fast.abs_diff(slow) <= 4, "{fast} {slow}"); // a point on the border of two bins, in 32 bits
        }
    }

    #[test]
    fn finds_the_walls() {
        let options = Options::default();
        for k in 0..40 {
            let truth = 0.0391 * f64::from(k);
            let mut draw = SplitMix64::new(k as u64);
            let (sin, cos) = truth.sin_cos();
            let mut wall = |along: f64, u: f64, v: f64| {
                let (u, v) = if along > 0.5 { (u, v + 0.01 * draw.normal()) } else { (v + 0.01 * draw.normal(), u) };
                (u * cos - v * sin, u * sin + v * cos)
            };
            let (x, y): (Vec<f64>, Vec<f64>) = (0..400)
                .map(|i| wall(f64::from(i % 2), f64::from(i) / 50.0 - 4.0, if i % 4 < 2 { 3.0 } else { -2.5 }))
                .unzip();
            let mut spectrum = Spectrum::new(&options);
            let found = spectrum.dominant(&x, &y);
            let full = spectrum.best_of(0..spectrum.directions.len(), false);
            assert!(((found / options.angle_step - full as f64 + 90.0).rem_euclid(180.0) - 90.0).abs() <= 0.5);
            let error = (found - truth + 0.25 * FRAC_PI_2).rem_euclid(FRAC_PI_2) - 0.25 * FRAC_PI_2;
            assert!(error.abs() < 0.004, "{truth} {error}");
        }
    }
}

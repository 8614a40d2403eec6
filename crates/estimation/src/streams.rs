//! Reproducible randomness: one seed, and an independent stream of it for each purpose.
//!
//! The generator is ChaCha with 8 rounds (the same numbers on every machine); a purpose is a stream number, so that a
//! change of, say, the range noise leaves the building and the odometry as they were.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// What a stream of random numbers is used for.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Shape of the building and what stands in it.
    Building,
    /// Wheel slip and systematic errors of the odometry.
    Wheels,
    /// Range noise and dropouts.
    Ranges,
    /// Times at which the odometry stalls.
    Stalls,
    /// Errors of lenses.
    Lenses,
    /// How a target is mounted on its robot.
    Mounting,
    /// Unevenness of the floor.
    Floor,
    /// Noise of the corners of targets.
    Corners,
    /// Where a driver goes.
    Driver,
    /// Noise of pixels.
    Pixels,
}

/// Random numbers for one purpose.
#[derive(Clone, Debug)]
pub struct Random(ChaCha8Rng);

impl Random {
    /// The stream of `seed` for `purpose`.
    #[must_use]
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(purpose as u64);
        Self(generator)
    }

    /// Uniform in `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// True with probability `p`.
    pub fn chance(&mut self, p: f64) -> bool {
        self.0.random::<f64>() < p
    }

    /// Standard normal.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Uniform in `0..n`; 0 when `n` is 0.
    pub fn index(&mut self, n: usize) -> usize {
        if n == 0 { 0 } else { self.0.random_range(0..n) }
    }

    /// `+1` or `-1`.
    pub fn sign(&mut self) -> f64 {
        if self.chance(0.5) { 1.0 } else { -1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_repeat_and_differ() {
        let draw = |seed, purpose| (0..8).map(|_| Random::new(seed, purpose).normal()).next().unwrap();
        assert_eq!(draw(3, Purpose::Ranges), draw(3, Purpose::Ranges));
        assert_ne!(draw(3, Purpose::Ranges), draw(4, Purpose::Ranges));
        assert_ne!(draw(3, Purpose::Ranges), draw(3, Purpose::Wheels));
    }
}

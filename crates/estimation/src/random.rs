//! Seeded random numbers: the same seed gives the same numbers on every machine.
//!
//! SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014): a counter that a mixing
//! function makes random. For draws within estimators (splits, samples) and for tests. Not for secrets; simulations
//! draw from [`crate::streams`], which are independent of each other.

/// A stream of random numbers.
#[derive(Clone, Debug)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// The stream of a seed.
    #[must_use]
    pub const fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number below `n`, uniform to 2^-32 for `n` below 2^32.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// Nearly normal, mean 0, standard deviation 1: twelve uniform numbers less six, so never beyond six.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }

    /// Puts values into a random order (Fisher and Yates); each place as likely as the others to n / 2^64.
    pub fn shuffle<T>(&mut self, values: &mut [T]) {
        for k in (1..values.len()).rev() {
            let other = (self.bits() % (k as u64 + 1)) as usize;
            values.swap(k, other);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_published_generator() {
        // The first numbers of the seed 1234567, from reference tables of SplitMix64.
        let mut random = SplitMix64::new(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| random.bits()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn draws_have_the_moments_that_they_promise() {
        let (mut random, n) = (SplitMix64::new(3), 100_000);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let uniform: Vec<f64> = (0..n).map(|_| random.uniform()).collect();
        assert!((mean(&uniform) - 0.5).abs() < 0.004 && uniform.iter().all(|u| (0.0..1.0).contains(u)));
        let squares: Vec<f64> = (0..n).map(|_| random.normal().powi(2)).collect();
        assert!((mean(&squares) - 1.0).abs() < 0.02);
        let mut counts = [0; 7];
        (0..n).for_each(|_| counts[random.below(7)] += 1);
        assert!(counts.iter().all(|c| (f64::from(*c) * 7.0 / f64::from(n) - 1.0).abs() < 0.04), "{counts:?}");
    }

    #[test]
    fn a_shuffle_keeps_the_values_and_every_place_is_as_likely() {
        let mut random = SplitMix64::new(5);
        let mut first = [0; 4];
        for _ in 0..8000 {
            let mut values = [0, 1, 2, 3];
            random.shuffle(&mut values);
            first[values[0]] += 1;
            values.sort_unstable();
            assert_eq!(values, [0, 1, 2, 3]);
        }
        assert!(first.iter().all(|count| (1850..2150).contains(count)), "{first:?}");
    }
}

//! The radius of the neighbourhood of every beam, for many beams side by side.
//!
//! ```text
//! r = a exp(b rho);   0.8 rho where that is not below rho;   0 where the beam cannot be a corner
//! exp(x) = 2^n sum_k u^k / k!,   n = round(x / ln 2),   u = x - n ln 2,   |u| <= ln 2 / 2,   k to 12
//! ```
//!
//! The series is cut where its rest is below 1e-16 of the sum. The same operations are done in the same order whatever the width of
//! the vectors, so the outcome is the same to the last bit.

use super::Options;

/// ln 2 in two parts, the first with zeros at its end, so that `n` times it is exact.
const LN_2: (f64, f64) = (6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10);
/// Added to a small number, this leaves the number, rounded, in the low bits of the sum.
const ROUNDER: f64 = 6_755_399_441_055_744.0;
/// Beyond it the radius exceeds any range.
const MOST: f64 = 700.0;
/// `1 / k!`, k = 12 to 0 in steps of two, and k = 11 to 1.
const EVEN: [f64; 7] = [1.0 / 479_001_600.0, 1.0 / 3_628_800.0, 1.0 / 40_320.0, 1.0 / 720.0, 1.0 / 24.0, 0.5, 1.0];
const ODD: [f64; 6] = [1.0 / 39_916_800.0, 1.0 / 362_880.0, 1.0 / 5_040.0, 1.0 / 120.0, 1.0 / 6.0, 1.0];

/// e^x for 0 <= x; `MOST` is taken for more.
#[inline(always)]
fn exp(x: f64) -> f64 {
    let x = if x < MOST { x } else { MOST };
    let shifted = x * std::f64::consts::LOG2_E + ROUNDER;
    let n = shifted - ROUNDER;
    let u = (x - n * LN_2.0) - n * LN_2.1;
    let u_sq = u * u;
    let e = &EVEN;
    let even = (((((e[0] * u_sq + e[1]) * u_sq + e[2]) * u_sq + e[3]) * u_sq + e[4]) * u_sq + e[5]) * u_sq + e[6];
    let o = &ODD;
    let odd = ((((o[0] * u_sq + o[1]) * u_sq + o[2]) * u_sq + o[3]) * u_sq + o[4]) * u_sq + o[5];
    let series = even + u * odd;
    series * f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52)
}

/// Replace `radii` by those of the beams at ranges `rho`, NaN for no hit.
#[inline(always)]
pub(super) fn fill(radii: &mut Vec<f64>, rho: &[f64], options: &Options) {
    radii.resize(rho.len(), 0.0);
    let (a, b, least, most) = (options.a, options.b, options.range_min, options.range_max);
    for (radius, &rho) in radii.iter_mut().zip(rho) {
        let r = a * exp(b * rho);
        let r = if r >= rho { 0.8 * rho } else { r };
        *radius = if (rho >= least) & (rho <= most) { r } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equals_the_exponential() {
        for k in 0..70_000 {
            let x = f64::from(k) * 0.01;
            let (fast, exact) = (exp(x), x.min(MOST).exp());
            assert!((fast / exact - 1.0).abs() < 1e-15, "{x}: {fast} {exact}");
        }
        assert!(exp(f64::NAN) > 1e300 && exp(1e9) > 1e300);
    }

    #[test]
    fn a_beam_that_cannot_be_a_corner_has_none() {
        let options = Options { a: 0.2, ..Options::default() };
        let rho = [0.01, f64::NAN, 0.1, 1.0, 31.0, f64::INFINITY, 29.0, 0.05];
        let mut radii = Vec::new();
        fill(&mut radii, &rho, &options);
        assert_eq!([radii[0], radii[1], radii[4], radii[5]], [0.0; 4]);
        assert_eq!((radii[2], radii[7]), (0.8 * 0.1, 0.8 * 0.05));
        assert!((radii[3] - 0.2 * 0.07_f64.exp()).abs() < 1e-16 && (radii[6] - 0.2 * 2.03_f64.exp()).abs() < 1e-15);
    }
}

//! Location and spread of numbers among which some may be outliers.
//!
//! ```text
//! median = x_(n/2), counted from 0 in rising order: of an even number the upper of the two in the middle
//! spread = 1.4826 median |x|        the standard deviation of numbers that are normal about zero
//! quantile of a share p             linear between the two nearest of x_0 .. x_(n-1), of rank p (n - 1)
//! ```
//!
//! All put the numbers into another order; NaN counts as larger than all. The median and the spread serve estimators: they
//! take time in proportion to n and choose a number that is there. The quantile serves reports and thresholds: it sorts, and
//! of an even number that of a half is the middle of two.
//! Source: Hampel, Ronchetti, Rousseeuw, Stahel, "Robust Statistics" (1986).

/// Standard deviation of a normal distribution over the median of its absolute deviations.
const PER_MEDIAN: f64 = 1.4826;

/// The median; none of nothing.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// The quantile of a share from 0 to 1; none of nothing.
pub fn quantile(values: &mut [f64], share: f64) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    let rank = share * values.len().checked_sub(1)? as f64;
    let (low, high) = (values[rank.floor() as usize], values[rank.ceil() as usize]);
    Some(low + (high - low) * rank.fract())
}

/// The robust standard deviation of residuals about zero; none of nothing.
pub fn spread(residuals: impl Iterator<Item = f64>) -> Option<f64> {
    median(&mut residuals.map(f64::abs).collect::<Vec<f64>>()).map(|median| PER_MEDIAN * median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_a_value_that_as_many_are_below_as_above() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median(&mut [f64::INFINITY, -5.0, 1.0, f64::NAN, -5.0]), Some(1.0));
        assert_eq!(median(&mut []), None);
    }

    #[test]
    fn quantiles_go_evenly_from_the_least_to_the_largest() {
        let mut values = [4.0, 1.0, 2.0, 8.0, 5.0];
        let found = [0.0, 0.25, 0.5, 0.625, 0.9, 1.0].map(|share| quantile(&mut values, share).unwrap());
        assert!(found.iter().zip([1.0, 2.0, 4.0, 4.5, 6.8, 8.0]).all(|(q, e)| (q - e).abs() < 1e-12), "{found:?}");
        assert_eq!(quantile(&mut [3.0, 1.0], 0.5), Some(2.0));
        assert_eq!((quantile(&mut [7.0], 0.3), quantile(&mut [], 0.5)), (Some(7.0), None));
    }

    #[test]
    fn the_spread_is_the_standard_deviation_of_normal_residuals_and_outliers_hardly_move_it() {
        // Box and Muller on a lattice of the golden ratio.
        let draws = (0..100_000).map(|k| {
            let (u, v) = ((f64::from(k) + 0.5) / 100_000.0, f64::from(k) * 0.618_033_988_749_895 % 1.0);
            2.5 * (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
        });
        assert!((spread(draws.clone()).unwrap() - 2.5).abs() < 0.02);
        let soiled = draws.chain(std::iter::repeat_n(1e6, 1000));
        assert!((spread(soiled).unwrap() - 2.5).abs() < 0.06);
        assert_eq!(spread(std::iter::empty()), None);
    }
}

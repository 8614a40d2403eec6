//! Location and spread of numbers among which some may be outliers.
//!
//! ```text
//! median = x_(n/2), counted from 0 in rising order: of an even number the upper of the two in the middle
//! spread = 1.4826 median |x|        the standard deviation of numbers that are normal about zero
//! ```
//!
//! Both take time in proportion to n and put the numbers into another order. NaN counts as larger than all.
//! Source: Hampel, Ronchetti, Rousseeuw, Stahel, "Robust Statistics" (1986).

/// Standard deviation of a normal distribution over the median of its absolute deviations.
const PER_MEDIAN: f64 = 1.4826;

/// The median; none of nothing.
pub fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
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

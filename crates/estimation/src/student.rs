//! Student's t distribution as a loss: residuals that are mostly normal and now and then far off.
//!
//! With n degrees of freedom over residuals of m numbers and squared Mahalanobis distance `d^2`:
//!
//! ```text
//! cost    (n + m)/2 ln(1 + d^2/n)        negative log density up to a constant
//! weight  (n + m)/(n + d^2)              twice its derivative by d^2; (n + m)/n at zero
//! ```
//!
//! The weight is that of expectation-maximisation: 1 on average over residuals of this distribution.
//! Source: Lange, Little, Taylor, "Robust statistical modeling using the t distribution", JASA 84 (1989).

/// Student's distribution of residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Student {
    /// Degrees of freedom, above 0: few where residuals may be far off.
    pub dof: f64,
    /// Numbers in a residual.
    pub dimension: f64,
}

impl Student {
    /// Negative log density at a squared distance, up to a constant.
    #[must_use]
    pub fn cost(self, d_sq: f64) -> f64 {
        0.5 * (self.dof + self.dimension) * (d_sq / self.dof).ln_1p()
    }

    /// How much a residual at a squared distance counts.
    #[must_use]
    pub fn weight(self, d_sq: f64) -> f64 {
        (self.dof + self.dimension) / (self.dof + d_sq)
    }

    /// The squared distance that has a weight.
    #[must_use]
    pub fn distance_sq(self, weight: f64) -> f64 {
        (self.dof + self.dimension) / weight - self.dof
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix64;

    const HEAVY: Student = Student { dof: 4.0, dimension: 3.0 };

    #[test]
    fn the_weight_is_twice_the_slope_of_the_cost_and_tells_the_distance() {
        let h = 1e-6;
        for d_sq in (1..200).map(|k| 0.3 * f64::from(k)) {
            let slope = (HEAVY.cost(d_sq + h) - HEAVY.cost(d_sq - h)) / h;
            assert!((slope - HEAVY.weight(d_sq)).abs() < 1e-8);
            assert!((HEAVY.distance_sq(HEAVY.weight(d_sq)) - d_sq).abs() < 1e-12 * d_sq);
        }
        assert_eq!((HEAVY.cost(0.0), HEAVY.weight(0.0)), (0.0, 1.75));
    }

    /// A residual of Student's distribution is a normal one over the root of a chi-square variable of n degrees over n.
    #[test]
    fn weights_are_one_on_average_over_its_own_residuals() {
        let (mut random, runs) = (SplitMix64::new(5), 40_000);
        let mut square = |numbers: usize| (0..numbers).map(|_| random.normal().powi(2)).sum::<f64>();
        let mean = (0..runs).map(|_| HEAVY.weight(square(3) * HEAVY.dof / square(4))).sum::<f64>() / f64::from(runs);
        assert!((mean - 1.0).abs() < 0.01, "{mean}");
    }
}

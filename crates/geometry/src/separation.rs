//! How far apart two poses are, with the two numbers named: they are never added.

/// Distance and angle between two poses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Separation {
    /// Between the origins [m].
    pub distance: f64,
    /// Of the rotation from one to the other, not negative [rad].
    pub angle: f64,
}

impl Separation {
    /// Whether one of the two is more than that of `limit`. A number that is none exceeds nothing.
    #[must_use]
    pub fn exceeds(&self, limit: &Self) -> bool {
        self.distance > limit.distance || self.angle > limit.angle
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_number_exceeds_and_equality_does_not() {
        let limit = Separation { distance: 0.2, angle: 0.1 };
        let exceeds = |distance, angle| Separation { distance, angle }.exceeds(&limit);
        assert!(exceeds(0.21, 0.0) && exceeds(0.0, 0.11));
        assert!(!exceeds(0.2, 0.1) && !exceeds(f64::NAN, 0.0));
    }
}

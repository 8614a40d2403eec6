//! The vertical and the horizontal arm around a beam, in the frame of the walls.

use nalgebra::Vector2;

/// Fewest score that makes a corner, in the parts in which scores are counted: scores are compared as whole numbers.
pub(super) const LEAST_SCORE: u64 = 1 << 20;

/// Points of one side of a beam, or of both; as wide as a coordinate, so that counting vectorises.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Tally {
    /// Neighbours.
    pub near: u64,
    /// Of them on the vertical arm.
    pub vertical: u64,
    /// Of them on the horizontal arm.
    pub horizontal: u64,
}

/// What a neighbour must meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gates {
    pub radius: f64,
    pub tolerance: f64,
}

impl Tally {
    /// Count the points around `own`; points that are NaN are none.
    #[inline(always)]
    pub fn of(x: &[f64], y: &[f64], own: Vector2<f64>, gates: Gates) -> Self {
        let (mut tally, radius_sq) = (Self::default(), gates.radius * gates.radius);
        for (x, y) in x.iter().zip(y) {
            let (dx, dy) = (x - own.x, y - own.y);
            let near = dx * dx + dy * dy <= radius_sq;
            let (thin, flat) = (dx.abs() < gates.tolerance, dy.abs() < gates.tolerance);
            tally.near += u64::from(near);
            tally.vertical += u64::from(near & thin & !flat);
            tally.horizontal += u64::from(near & flat & !thin);
        }
        tally
    }

    /// Score of a corner with these arms, in parts of 2^-20.
    pub fn score(&self) -> u64 {
        let (x, y) = (self.vertical, self.horizontal);
        10 * (x + y) * LEAST_SCORE / (1 + 10 * x.abs_diff(y))
    }

    /// Both tallies.
    pub fn plus(self, other: Self) -> Self {
        Self {
            near: self.near + other.near,
            vertical: self.vertical + other.vertical,
            horizontal: self.horizontal + other.horizontal,
        }
    }
}

/// One arm: moments of its offset across itself, and to which end it goes.
#[derive(Clone, Copy, Debug, Default)]
struct Arm {
    points: f64,
    sum: f64,
    squares: f64,
    /// Points ahead less points behind.
    votes: i32,
}

/// A corner relative to its beam's point, in the frame of the walls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub offset: Vector2<f64>,
    /// Variance of x and of y.
    pub variance: Vector2<f64>,
    /// Sign of the quadrant between the arms, per axis.
    pub quadrant: Vector2<f64>,
}

/// The corner of the arms around `own`, with standard deviation `sigma` of a point at least.
pub(super) fn locate(x: &[f64], y: &[f64], own: Vector2<f64>, gates: Gates, sigma: f64) -> Corner {
    let (mut vertical, mut horizontal) = (Arm::default(), Arm::default());
    for d in x.iter().zip(y).map(|(&x, &y)| Vector2::new(x, y) - own) {
        let near = d.norm_squared() <= gates.radius * gates.radius;
        match (d.x.abs() < gates.tolerance, d.y.abs() < gates.tolerance) {
            (true, false) if near => vertical.push(d.x, d.y),
            (false, true) if near => horizontal.push(d.y, d.x),
            _ => {}
        }
    }
    Corner {
        offset: Vector2::new(vertical.mean(), horizontal.mean()),
        variance: Vector2::new(vertical.variance(sigma), horizontal.variance(sigma)),
        quadrant: Vector2::new(horizontal.sign(), vertical.sign()),
    }
}

impl Arm {
    fn push(&mut self, across: f64, along: f64) {
        self.points += 1.0;
        self.sum += across;
        self.squares += across * across;
        self.votes += if along > 0.0 { 1 } else { -1 };
    }

    fn mean(&self) -> f64 {
        self.sum / self.points.max(1.0)
    }

    /// Variance of the mean.
    fn variance(&self, sigma: f64) -> f64 {
        let points = self.points.max(1.0);
        let scatter = (self.squares - points * self.mean().powi(2)) / (points - 1.0).max(1.0);
        (sigma * sigma).max(scatter) / points
    }

    fn sign(&self) -> f64 {
        if self.votes >= 0 { 1.0 } else { -1.0 }
    }
}

//! A loop closure, and what makes one.
//!
//! The best of the checked poses of local map b in local map a becomes a closure when, with P the covariance of their
//! relative pose in the graph,
//!
//! ```text
//! overlap >= OVERLAP, more where corners found it             the views agree
//! share, common >= SUPPORT, more where more was searched      there is enough to judge by
//! no other pose nearly as good                                the place is not ambiguous
//! e^T (P + R)^-1 e <= GATE                                    it lies within what the graph believes
//! sigma of (R^-1 + P^-1)^-1 <= SLIDES                         it constrains the position, or the graph did
//! ```
//!
//! where R is the covariance of the registration with a floor: local maps bend. What corners found where no window could
//! be searched stays unconfirmed until a neighbour agrees.

use crate::verify::Check;
use groma_geometry::{Se2, Separation};
use nalgebra::{Matrix3, Vector3};

/// The search window [m]: least, and largest that is searched exhaustively; and [rad].
pub const REACH: (f64, f64) = (0.4, 10.0);
const TURN: (f64, f64) = (0.12, std::f64::consts::PI);
/// Least overlap of a closure: where a window was searched, and where corners found the place among all there are. True closures of
/// real recordings have 0.96 to 0.99 in the middle, of simulated ones 1.00; corridors that repeat, shifted by some doors, had 0.86 to
/// 0.95 where corners began the error, and up to 0.98 after it.
const OVERLAP: (f64, f64) = (0.85, 0.96);
/// Least share on surfaces and in common view: where the place was known, and where the window was at its widest.
const SUPPORT: (f64, f64) = (0.2, 0.35);
/// Another pose in the window whose overlap comes this close makes it ambiguous.
const RIVAL: f64 = 0.05;
/// Standard deviation along the weakest direction beyond which a closure slides [m].
const SLIDES: f64 = 0.1;
/// Squared Mahalanobis distance within which a closure must lie of what the graph believed (99.9 %, inflated).
pub const GATE: f64 = 16.27 * 4.0;
/// Covariance that a closure has at least: local maps bend [m], [rad].
const FLOOR: (f64, f64) = (0.03, 0.004);

/// A closure of which more is left after optimisation is violated [m], [rad] (W. Hess et al., ICRA 2016, table IV).
const VIOLATED: Separation = Separation { distance: 0.2, angle: 0.0175 };

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is part of the graph.
    Accepted,
    /// The views disagree.
    NoOverlap,
    /// The two maps have too little in common view to tell.
    TooLittle,
    /// It fits in two places.
    Ambiguous,
    /// A direction that was not known before is unconstrained.
    Slides,
    /// It lies beyond the uncertainty of the graph.
    Implausible,
    /// The other closures contradict it.
    Contradicted,
    /// It was accepted, and the graph of all keyframes cannot meet it.
    Violated,
    /// It looks right, but could be one of many such places: it waits for a neighbour to say the same.
    Unconfirmed,
}

/// A verified or rejected candidate.
#[derive(Clone, Debug)]
pub struct Closure {
    /// Local map a.
    pub from: usize,
    /// Local map b, later than a.
    pub to: usize,
    /// What was found.
    pub check: Check,
    /// `T_a_b` as the graph had it.
    pub predicted: Se2,
    /// What became of it.
    pub verdict: Verdict,
}

impl Closure {
    /// Information of the measured pose `check.pose`, body frame of the later anchor.
    #[must_use]
    pub fn information(&self) -> Matrix3<f64> {
        floored(&self.check.information)
    }

    /// Covariance of the measured pose.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        invert(&self.information())
    }

    /// Residual of the closure when the two anchors stand at `pose` to each other. Nothing is asked of it
    /// along a direction that it does not hold (`SLIDES`).
    #[must_use]
    pub fn residual(&self, pose: &Se2) -> Separation {
        let left = self.check.pose.between(pose);
        let position = self.information().fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigen();
        let held = (0..2).filter(|k| position.eigenvalues[*k] > SLIDES.powi(-2));
        let metres_sq: f64 = held.map(|k| position.eigenvectors.column(k).dot(&left.translation).powi(2)).sum();
        Separation { distance: metres_sq.sqrt(), angle: left.theta().abs() }
    }

    /// Whether no more is left of it than an optimised graph leaves of a true closure.
    #[must_use]
    pub fn is_met(&self, pose: &Se2) -> bool {
        !self.residual(pose).exceeds(&VIOLATED)
    }
}

/// Where the graph expects one local map in another.
#[derive(Clone, Debug)]
pub struct Expected {
    /// `T_a_b`.
    pub pose: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
}

impl Expected {
    /// Half the edge of the window that holds the true position [m].
    #[must_use]
    pub fn whole_reach(&self) -> f64 {
        3.0 * (self.covariance[(0, 0)] + self.covariance[(1, 1)]).sqrt()
    }

    /// The same within what is searched [m].
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.whole_reach().clamp(REACH.0, REACH.1)
    }

    /// Half the opening of the window that is searched [rad].
    #[must_use]
    pub fn turn(&self) -> f64 {
        (3.0 * self.covariance[(2, 2)].sqrt()).clamp(TURN.0, TURN.1)
    }
}

impl Verdict {
    /// Why the closure was rejected, in words; empty when it was accepted.
    #[must_use]
    pub fn told(self) -> &'static str {
        match self {
            Self::Accepted => "",
            Self::NoOverlap => "what the two places show does not agree",
            Self::TooLittle => "too little in common view to tell",
            Self::Ambiguous => "it fits in two places",
            Self::Slides => "a direction that was not known before is unconstrained",
            Self::Implausible => "it lies beyond the uncertainty of the graph",
            Self::Contradicted => "the other closures contradict it",
            Self::Violated => "the whole map cannot meet it",
            Self::Unconfirmed => "no neighbouring place confirms it",
        }
    }
}

/// Judges the best of the poses that were checked; `found_by_corners` when the window was too wide to be searched.
#[must_use]
pub fn judge(best: &Check, others: &[Check], expected: &Expected, found_by_corners: bool) -> Verdict {
    let searched = (expected.reach() / REACH.1).min(1.0);
    let support = SUPPORT.0 + (SUPPORT.1 - SUPPORT.0) * searched;
    if best.overlap < if found_by_corners { OVERLAP.1 } else { OVERLAP.0 } {
        return Verdict::NoOverlap;
    }
    if best.share < support || best.common < support {
        return Verdict::TooLittle;
    }
    let elsewhere = |o: &&Check| {
        let d = best.pose.between(&o.pose);
        d.translation.norm() > 0.3 || d.theta().abs() > 0.1
    };
    if others.iter().filter(elsewhere).any(|o| o.overlap > best.overlap - RIVAL && o.share > best.share * 0.85) {
        return Verdict::Ambiguous;
    }
    let e = best.pose.minus(&expected.pose);
    let spread = expected.covariance + invert(&floored(&best.information));
    if e.dot(&(invert(&spread) * e)) > GATE {
        return Verdict::Implausible;
    }
    let known = invert(&(best.information + invert(&expected.covariance)));
    if (known[(0, 0)] + known[(1, 1)]).sqrt() > SLIDES {
        return Verdict::Slides;
    }
    if found_by_corners {
        return Verdict::Unconfirmed;
    }
    Verdict::Accepted
}

/// The information of a closure with the least covariance added.
fn floored(information: &Matrix3<f64>) -> Matrix3<f64> {
    let floor = Vector3::new(FLOOR.0 * FLOOR.0, FLOOR.0 * FLOOR.0, FLOOR.1 * FLOOR.1);
    invert(&(invert(&(information + Matrix3::identity() * 1e-3)) + Matrix3::from_diagonal(&floor)))
}

/// The inverse; zero where there is none: no information.
#[must_use]
pub fn invert(m: &Matrix3<f64>) -> Matrix3<f64> {
    m.try_inverse().unwrap_or_else(Matrix3::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(x: f64) -> Check {
        let information = Matrix3::from_diagonal(&Vector3::new(1e4, 1e4, 1e6));
        Check { pose: Se2::new(x, 0.0, 0.0), information, overlap: 0.97, share: 0.8, common: 0.7, scale: 0.01 }
    }

    fn expected(sigma: f64) -> Expected {
        let covariance = Matrix3::from_diagonal(&Vector3::new(sigma * sigma, sigma * sigma, 1e-3));
        Expected { pose: Se2::IDENTITY, covariance }
    }

    #[test]
    fn each_condition_has_its_verdict() {
        let near = expected(0.3);
        assert_eq!(judge(&check(0.2), &[], &near, false), Verdict::Accepted);
        assert_eq!(judge(&check(0.2), &[], &near, true), Verdict::Unconfirmed);
        assert_eq!(judge(&Check { overlap: 0.7, ..check(0.2) }, &[], &near, false), Verdict::NoOverlap);
        assert_eq!(judge(&Check { overlap: 0.93, ..check(0.2) }, &[], &near, false), Verdict::Accepted);
        assert_eq!(judge(&Check { overlap: 0.93, ..check(0.2) }, &[], &near, true), Verdict::NoOverlap);
        assert_eq!(judge(&Check { share: 0.1, ..check(0.2) }, &[], &near, false), Verdict::TooLittle);
        assert_eq!(judge(&Check { common: 0.1, ..check(0.2) }, &[], &near, false), Verdict::TooLittle);
        assert_eq!(judge(&check(0.2), &[check(1.4)], &near, false), Verdict::Ambiguous);
        assert_eq!(judge(&check(0.2), &[check(0.25)], &near, false), Verdict::Accepted, "the same pose twice");
        assert_eq!(judge(&check(5.0), &[], &near, false), Verdict::Implausible);
    }

    #[test]
    fn what_slides_needs_a_graph_that_knows_better() {
        let mut corridor = check(0.02);
        corridor.information[(0, 0)] = 1.0;
        assert_eq!(judge(&corridor, &[], &expected(0.5), false), Verdict::Slides);
        assert_eq!(judge(&corridor, &[], &expected(0.05), false), Verdict::Accepted);
    }

    #[test]
    fn the_wider_the_search_the_more_must_be_seen() {
        let thin = Check { share: 0.3, common: 0.3, ..check(0.2) };
        assert_eq!(judge(&thin, &[], &expected(0.1), false), Verdict::Accepted);
        assert_eq!(judge(&thin, &[], &expected(3.0), false), Verdict::TooLittle);
    }

    #[test]
    fn nothing_is_asked_along_a_direction_that_is_not_determined() {
        let mut corridor = check(0.0);
        corridor.information[(0, 0)] = 1.0;
        let closure = Closure { from: 0, to: 5, check: corridor, predicted: Se2::IDENTITY, verdict: Verdict::Accepted };
        let left = closure.residual(&Se2::new(0.8, 0.05, 0.01));
        assert!((left.distance - 0.05).abs() < 1e-3 && (left.angle - 0.01).abs() < 1e-12, "{left:?}");
    }
}

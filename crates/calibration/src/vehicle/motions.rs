//! The data: motions of the laser and the steps of the wheels during each.

use super::Error;
use groma_geometry::{Gaussian, Se2};
use groma_models::WheelLog;
use groma_models::wheel_log::Step;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// How the laser moved between two scans.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Time of the first scan [s].
    pub start: f64,
    /// Time of the second scan [s].
    pub end: f64,
    /// `T_first_second`.
    pub motion: Se2,
    /// The whole turn, not wrapped [rad].
    pub turn: f64,
}

/// Motions in order of time with their errors, of the perturbation `T exp(xi)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Motions {
    /// The motions.
    pub motions: Vec<Motion>,
    /// Their covariances, or nothing where unknown.
    pub covariances: Option<Vec<Matrix3<f64>>>,
    /// Covariance of the errors of a motion and the next; nothing where all are independent.
    pub couplings: Option<Vec<Matrix3<f64>>>,
}

impl Motions {
    /// Motions between poses whose errors are independent, C of `T exp(xi)`: T of motion k from pose k to the next,
    ///
    /// ```text
    /// covariance   C_(k+1) + Ad(T^-1) C_k Ad(T^-1)^T
    /// with the next, whose motion is T'     -C_(k+1) Ad(T'^-1)^T
    /// ```
    ///
    /// `poses` are time [s], x, y [m] and heading with turns counted [rad].
    #[must_use]
    pub fn between_poses(poses: &[(f64, Vector3<f64>)], covariances: &[Matrix3<f64>]) -> Self {
        let pose = |v: &Vector3<f64>| Se2::new(v.x, v.y, v.z);
        let motion = |w: &[(f64, Vector3<f64>)]| {
            let ((start, a), (end, b)) = (w[0], w[1]);
            Motion { start, end, motion: pose(&a).between(&pose(&b)), turn: b.z - a.z }
        };
        let motions: Vec<Motion> = poses.windows(2).map(motion).collect();
        let known: Vec<_> =
            poses.iter().zip(covariances).map(|((_, v), c)| Gaussian { mean: pose(v), covariance: *c }).collect();
        let own = known.windows(2).map(|w| w[0].between(&w[1]).covariance).collect();
        let coupling = |(c, next): (&Matrix3<f64>, &Motion)| -c * next.motion.inverse().adjoint().transpose();
        let shared = covariances.iter().zip(&motions).skip(1).map(coupling).collect();
        Self { motions, covariances: Some(own), couplings: Some(shared) }
    }

    /// Whether all is finite, in order, and as many as it should be.
    ///
    /// # Errors
    /// [`Error::Motion`] names the first that is not, [`Error::Couplings`] a wrong number of them.
    pub fn check(&self) -> Result<(), Error> {
        for (index, m) in self.motions.iter().enumerate() {
            self.fault(index, m).map_or(Ok(()), |why| Err(Error::Motion { index, why }))?;
        }
        let (motions, couplings) = (self.motions.len(), self.couplings.as_ref().map_or(0, Vec::len));
        let fits = self.couplings.is_none() || couplings + 1 == motions;
        if fits { Ok(()) } else { Err(Error::Couplings { motions, couplings }) }
    }

    fn fault(&self, index: usize, m: &Motion) -> Option<&'static str> {
        let numbers = [m.start, m.end, m.motion.x(), m.motion.y(), m.turn];
        if numbers.iter().any(|v| !v.is_finite()) {
            return Some("is not finite");
        }
        if m.end <= m.start {
            return Some("does not end after it starts");
        }
        let has = |c: Option<&Matrix3<f64>>| c.is_some_and(|c| c.cholesky().is_some());
        let lacks = self.covariances.as_ref().is_some_and(|all| !has(all.get(index)));
        lacks.then_some("has no covariance that is positive definite")
    }

    /// Which motions lie within a log by a margin at both ends.
    #[must_use]
    pub fn within(&self, log: &WheelLog, margin: f64) -> Vec<usize> {
        let (first, last) = log.span();
        let lies = |m: &Motion| m.start - margin >= first && m.end + margin <= last;
        (0..self.motions.len()).filter(|&k| lies(&self.motions[k])).collect()
    }

    /// The motions of some indices, rising; a coupling holds between neighbours only.
    #[must_use]
    pub fn subset(&self, indices: &[usize]) -> Self {
        let pick = |all: &Vec<Matrix3<f64>>| indices.iter().map(|&k| all[k]).collect();
        let join = |all: &Vec<Matrix3<f64>>| {
            let neighbours = |w: &[usize]| if w[1] == w[0] + 1 { all[w[0]] } else { Matrix3::zeros() };
            indices.windows(2).map(neighbours).collect()
        };
        Self {
            motions: indices.iter().map(|&k| self.motions[k]).collect(),
            covariances: self.covariances.as_ref().map(pick),
            couplings: self.couplings.as_ref().map(join),
        }
    }
}

/// The steps of the wheels during every motion, end to end.
#[derive(Clone, Debug, Default)]
pub struct Segments {
    steps: Vec<Step>,
    ends: Vec<usize>,
}

impl Segments {
    /// Reads the log at the times of the motions plus a delay; a motion that leaves the log has no steps.
    #[must_use]
    pub fn new(log: &WheelLog, motions: &[Motion], delay: f64) -> Self {
        let mut segments =
            Self { steps: Vec::with_capacity(2 * motions.len()), ends: Vec::with_capacity(motions.len()) };
        for m in motions {
            log.append_steps(m.start + delay, m.end + delay, &mut segments.steps);
            segments.ends.push(segments.steps.len());
        }
        segments
    }

    /// Number of motions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there is no motion.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The steps of one.
    #[must_use]
    pub fn steps(&self, k: usize) -> &[Step] {
        &self.steps[self.range(k)]
    }

    fn range(&self, k: usize) -> Range<usize> {
        let start = k.checked_sub(1).map_or(0, |before| self.ends[before]);
        start..self.ends[k]
    }
}

//! The pose constrained by the walls of the map where landmarks leave it weak.
//!
//! A scan is registered to the surfaces of the occupancy grid, A its pose there, with the filter's pose T and information
//! P^-1 as prior under Student's loss, so that with e = log(T^-1 A) the readings alone say
//!
//! ```text
//! w = min(1, (dof + 3) / (dof + e^T P^-1 e)),    P <- P / w                                 a jump loosens the pose
//! Lambda r = Lambda e + w P^-1 e,    Lambda' = (I + Lambda M)^-1 Lambda,    Lambda' r = (I + Lambda M)^-1 Lambda r
//! Lambda' = V D V^T:   rows sqrt(d_k) v_k^T with residuals v_k^T Lambda' r / sqrt(d_k) and unit noise update the pose
//! ```
//!
//! M is the error of the grid, which neighbouring scans have in common: it has the covariance G and is forgotten over a distance
//! `MEMORY`. White noise that teaches as little over that distance is
//!
//! ```text
//! M = G max(1, 2 MEMORY / distance since the last)
//! ```
//!
//! so that standing still teaches nothing more. Directions that no wall constrains have no information, and none comes
//! in. Landmarks are surveyed to millimetres, a grid is to centimetres: while they constrain the pose better than `WEAK`, the walls are
//! silent.
//!
//! **Motions.** Odometry rarely says how good it is. Where walls constrain the pose, the factor on its variance follows from how
//! far the walls are from where it led: `f <- f (1 + a (d^2 / 3 - 1))`, never below one.
//!
//! **Right or not.** Beams that agree with the grid, end before it, or go through its walls are counted for and against the
//! pose (`beams`), as evidence of being lost that adds to that of the landmarks.

use crate::beams::{Beam, beams};
use crate::joint::{Gain, Joint, Linear, Motion};
use crate::walls::Walls;
use groma_geometry::Se2;
use groma_models::LaserScan;
use groma_registration::{Alignment, Prior, SurfaceScan};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

/// Standard deviation of the position above which the walls are asked [m].
const WEAK: f64 = 0.02;
/// Standard deviations above which they are asked before landmarks are paired [m], [rad].
const WIDE: (f64, f64) = (0.1, 0.03);
/// Distance over which its error is forgotten [m].
const MEMORY: f64 = 1.0;
/// Distance, or turn at a metre, between two scans that are taken [m].
const STEP: f64 = 0.1;
/// Share of a scan that must lie on walls.
const ON_WALLS: f64 = 0.5;
/// Independent beams per metre driven for or against the pose, and that much in one scan at most.
const WITNESSES: (f64, f64) = (8.0, 4.0);
/// Degrees of freedom of the prior: odometry may slip and jump.
const PRIOR_DOF: f64 = 4.0;

/// How fast the noise of the motions is learned, what one scan may say at most, and the largest factor on its variance.
const LEARNING: f64 = 0.05;
const MOST_EXCESS: f64 = 5.0;
const MOST_FACTOR: f64 = 50.0;

/// A scan kept for the next update, in the frame of the vehicle.
#[derive(Clone, Debug)]
struct View {
    surface: SurfaceScan,
    beams: Vec<Beam>,
}

/// How the walls of the map constrain the pose, and what they showed of the motions.
#[derive(Clone, Debug)]
pub(crate) struct WallHold {
    /// A scan that was kept.
    view: Option<View>,
    /// Distance driven, with turns, when the last was taken in.
    taken_at: f64,
    /// Whether walls constrained the pose when they were last asked.
    constrains: bool,
    /// Factor on the covariance of motions, learned.
    motion_factor: f64,
}

impl WallHold {
    /// Nothing seen yet.
    pub fn new() -> Self {
        Self { view: None, taken_at: f64::NEG_INFINITY, constrains: false, motion_factor: 1.0 }
    }

    /// The pose was found again: what was learned no longer counts.
    pub fn restart(&mut self) {
        *self = Self { view: self.view.take(), ..Self::new() };
    }

    /// Whether walls constrained the pose when they were last asked.
    pub fn constrains(&self) -> bool {
        self.constrains
    }

    /// Factor on the covariance of motions.
    pub fn motion_factor(&self) -> f64 {
        self.motion_factor
    }

    /// Keeps a scan for the next update, where enough was driven (with turns) since the last.
    pub fn keep(&mut self, scan: &LaserScan, laser: &Se2, twist: Vector3<f64>, driven: f64) {
        if driven - self.taken_at >= STEP {
            self.view = Some(View { surface: SurfaceScan::new(scan, laser, twist), beams: beams(scan, laser) });
        }
    }

    /// Takes in the scan that was kept, if there is one: the logarithm of the likelihood ratio of being right against being
    /// lost.
    pub fn take_in(&mut self, joint: &mut Joint, walls: &Walls, driven: f64) -> Option<f64> {
        let view = self.view.take()?;
        let distance = (driven - self.taken_at).min(2.0 * MEMORY);
        self.taken_at = driven;
        if joint.sigma_position() > WEAK {
            self.register(joint, walls, &view.surface, distance);
        }
        let witnesses = (WITNESSES.0 * distance).min(WITNESSES.1);
        Some(witnesses * walls.log_ratio(&joint.pose(), &view.beams))
    }

    fn register(&mut self, joint: &mut Joint, walls: &Walls, scan: &SurfaceScan, distance: f64) {
        let Some(information) = joint.pose_covariance().try_inverse() else { return };
        let prior = Prior { pose: joint.pose(), information, dof: PRIOR_DOF };
        let found = walls.register(scan, &prior);
        self.constrains = found.share >= ON_WALLS && found.converged;
        if !self.constrains {
            return;
        }
        let e = found.pose.minus(&prior.pose);
        let weight = prior.student().weight(prior.distance_sq(&found.pose)).min(1.0);
        loosen(joint, 1.0 / weight);
        self.doubt_motion(&found, &e, &information, walls);
        let m = walls.covariance() * (2.0 * MEMORY / distance).max(1.0);
        let Some(damping) = (Matrix3::identity() + found.information * m).try_inverse() else { return };
        let lambda = damping * found.information;
        let towards = damping * (found.information * e + information * e * weight);
        learn_pose(joint, &(0.5 * (lambda + lambda.transpose())), &towards);
    }

    /// Learns how much worse the motions are than their covariance, from how far the walls move the pose.
    fn doubt_motion(&mut self, found: &Alignment, e: &Vector3<f64>, information: &Matrix3<f64>, walls: &Walls) {
        let readings = found.information.try_inverse().map(|c| c + walls.covariance());
        let expected = readings.zip(information.try_inverse()).and_then(|(r, p)| (p + r).try_inverse());
        let Some(expected) = expected else { return };
        let excess = (e.dot(&(expected * e)) / 3.0).min(MOST_EXCESS);
        self.motion_factor = (self.motion_factor * (1.0 + LEARNING * (excess - 1.0))).clamp(1.0, MOST_FACTOR);
    }
}

/// Whether the pose is known so badly that the walls are asked first: corners are close to each other.
pub(crate) fn is_wide(joint: &Joint) -> bool {
    joint.sigma_position() > WIDE.0 || joint.sigma_heading() > WIDE.1
}

/// Makes the covariance of the pose larger: the motions since the last scan were worse than they said.
fn loosen(joint: &mut Joint, factor: f64) {
    let covariance = joint.pose_covariance() * (factor - 1.0);
    joint.predict(&Motion { motion: Se2::IDENTITY, covariance, by_drive: SMatrix::zeros() });
}

/// Updates the pose by information `lambda` on its perturbation and `lambda r`.
fn learn_pose(joint: &mut Joint, lambda: &Matrix3<f64>, towards: &Vector3<f64>) {
    let eigen = lambda.symmetric_eigen();
    let mut rows = Matrix3::zeros();
    let mut residual = Vector3::zeros();
    for k in 0..3 {
        let root = eigen.eigenvalues[k].max(0.0).sqrt();
        if root > 1e-6 {
            rows.set_row(k, &(eigen.eigenvectors.column(k).transpose() * root));
            residual[k] = eigen.eigenvectors.column(k).dot(towards) / root;
        }
    }
    let none = Matrix2x3::zeros();
    for k in [0, 2] {
        let by_pose = Matrix2x3::from_fn(|i, j| if k + i < 3 { rows[(k + i, j)] } else { 0.0 });
        let residual = Vector2::new(residual[k], if k == 0 { residual[1] } else { 0.0 });
        let linear = Linear { residual, by_pose, by_mount: none, landmark: None, noise: Matrix2::identity() };
        joint.update(&linear, Gain::Pose, f64::INFINITY);
    }
    joint.settle();
}

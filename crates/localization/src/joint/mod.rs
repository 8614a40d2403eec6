//! The joint Gaussian of the vehicle's pose, its calibration and the landmarks in memory, and what a Kalman filter does
//! with it.
//!
//! ```text
//! x = ( xi_pose 3 | drive 5, mount 3 (if calibration is considered) | landmark 2, landmark 2, ... )
//! predict   T <- T E,   P_x. <- F P_x. + G P_c.,   P_xx <- F P_xx F^T + F P_xc G^T + G P_cx F^T + G P_cc G^T + Q,   F = Ad(E)^-1
//! update    S = H P H^T + R,   K = P H^T S^-1 on the rows that may move, 0 elsewhere
//!           P_i. <- P_i. - K_i H P    for those rows and, mirrored, columns
//!           P_xx <- (A P A^T)_xx + K R K^T,   A = I - K H    (Joseph, on what the pose is seen by)
//! ```
//!
//! The rows that move choose the filter. All: EKF-SLAM. The pose alone: a Schmidt filter, in which landmarks and
//! calibration stay as they are, but what they have in common with the pose is kept, so that the same error of a
//! landmark, met in a thousand scans, is not averaged away. A landmark alone: it is refined and does not move the pose.
//!
//! Updates of one scan share one linearisation: means stay until [`Joint::settle`], meanwhile `shift` holds what was
//! learned. Perturbations of the pose are on the right.
//!
//! Source: S. F. Schmidt, "Application of state-space methods to navigation problems", 1966; R. Woodbury, J. Junkins,
//! "On the consider Kalman filter", AIAA 2010; Bucy, Joseph 1968 for the form of the update.

mod begin;
mod learn;
mod linear;

use crate::symmetric::Symmetric;
use groma_geometry::{Se2, largest_sigma};
use nalgebra::{DMatrix, Matrix2, Matrix3, SMatrix, Vector2, Vector3};

pub(crate) use learn::Gain;
pub(crate) use linear::{Linear, inverse};

/// Parameters of the drive, as `groma-models` orders them.
pub const DRIVE: usize = 5;
/// Parameters of the calibration: the drive and the mount's perturbation.
pub const CALIBRATION: usize = DRIVE + 3;

/// Covariance of the calibration: the parameters of the drive, then the perturbation of the laser's mount.
pub type CalibrationCovariance = SMatrix<f64, CALIBRATION, CALIBRATION>;

/// A motion of the vehicle, from the wheels.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// `T_before_after`.
    pub motion: Se2,
    /// Covariance of its right perturbation.
    pub covariance: Matrix3<f64>,
    /// Its right perturbation by the parameters of the drive.
    pub by_drive: SMatrix<f64, 3, DRIVE>,
}

/// The rows of the pose, kept for later.
#[derive(Clone, Debug)]
pub(crate) struct Saved {
    rows: [Vec<f64>; 3],
    shift: [f64; 3],
}

/// Pose, calibration and landmarks with their joint covariance.
#[derive(Clone, Debug)]
pub struct Joint {
    pose: Se2,
    /// Rows of the calibration: 0 or [`CALIBRATION`].
    calibration: usize,
    points: Vec<Vector2<f64>>,
    covariance: Symmetric,
    shift: Vec<f64>,
    /// `H P`, kept to save the allocation.
    projected: [Vec<f64>; 2],
}

impl Joint {
    /// A pose with the covariance of its right perturbation; the calibration's covariance where it is considered.
    #[must_use]
    pub fn new(pose: Se2, covariance: &Matrix3<f64>, calibration: Option<&CalibrationCovariance>) -> Self {
        let rows = if calibration.is_some() { CALIBRATION } else { 0 };
        let mut p = Symmetric::zeros(3 + rows);
        for i in 0..3 {
            (0..=i).for_each(|j| p.set(i, j, covariance[(i, j)]));
        }
        if let Some(c) = calibration {
            for i in 0..rows {
                (0..=i).for_each(|j| p.set(3 + i, 3 + j, c[(i, j)]));
            }
        }
        let shift = vec![0.0; p.size()];
        Self { pose, calibration: rows, points: Vec::new(), covariance: p, shift, projected: [Vec::new(), Vec::new()] }
    }

    /// `T_map_base`.
    #[must_use]
    pub fn pose(&self) -> Se2 {
        self.pose
    }

    /// Covariance of the pose's right perturbation.
    #[must_use]
    pub fn pose_covariance(&self) -> Matrix3<f64> {
        Matrix3::from_fn(|i, j| self.covariance.at(i, j))
    }

    /// Standard deviation of the position along its weakest direction [m].
    #[must_use]
    pub fn sigma_position(&self) -> f64 {
        largest_sigma(&self.pose_covariance().fixed_view::<2, 2>(0, 0).into_owned())
    }

    /// Standard deviation of the heading [rad].
    #[must_use]
    pub fn sigma_heading(&self) -> f64 {
        self.covariance.at(2, 2).sqrt()
    }

    /// The means of the landmarks in memory, slot by slot [m].
    #[must_use]
    pub fn points(&self) -> &[Vector2<f64>] {
        &self.points
    }

    /// Covariance of the landmark in a slot [m^2].
    #[must_use]
    pub fn point_covariance(&self, slot: usize) -> Matrix2<f64> {
        let k = self.row_of(slot);
        Matrix2::from_fn(|i, j| self.covariance.at(k + i, k + j))
    }

    /// The whole covariance: pose, calibration, landmarks.
    #[must_use]
    pub fn full_covariance(&self) -> DMatrix<f64> {
        DMatrix::from_fn(self.covariance.size(), self.covariance.size(), |i, j| self.covariance.at(i, j))
    }

    /// Moves the vehicle.
    pub fn predict(&mut self, step: &Motion) {
        let f = step.motion.inverse().adjoint();
        let before = self.pose_covariance();
        let mut own = Matrix3::zeros();
        let mut drive = [(0, Vector3::zeros()); DRIVE];
        let considered = if self.calibration > 0 { DRIVE } else { 0 };
        if considered > 0 {
            let p_xc = SMatrix::<f64, 3, DRIVE>::from_fn(|i, j| self.covariance.at(i, 3 + j));
            let p_cc = SMatrix::<f64, DRIVE, DRIVE>::from_fn(|i, j| self.covariance.at(3 + i, 3 + j));
            let cross = f * p_xc * step.by_drive.transpose();
            own = cross + cross.transpose() + step.by_drive * p_cc * step.by_drive.transpose();
            drive = std::array::from_fn(|c| (3 + c, step.by_drive.column(c).into_owned()));
        }
        self.covariance.mix_head(&f, &drive[..considered]);
        self.set_pose_covariance(&(f * before * f.transpose() + own + step.covariance));
        self.pose = self.pose * step.motion;
    }

    fn row_of(&self, slot: usize) -> usize {
        3 + self.calibration + 2 * slot
    }

    fn set_pose_covariance(&mut self, p: &Matrix3<f64>) {
        for i in 0..3 {
            (0..=i).for_each(|j| self.covariance.set(i, j, 0.5 * (p[(i, j)] + p[(j, i)])));
        }
    }

    /// Takes the pose to be another one, as independent of everything else as can be.
    pub fn replace_pose(&mut self, pose: Se2, covariance: &Matrix3<f64>) {
        for i in 0..3 {
            (3..self.covariance.size()).for_each(|j| self.covariance.set(i, j, 0.0));
        }
        self.set_pose_covariance(covariance);
        self.pose = pose;
    }

    /// The rows of the pose and what was learned: all that [`Gain::Pose`] changes.
    pub(crate) fn save_pose(&self) -> Saved {
        let rows = [0, 1, 2].map(|i| self.covariance.row(i).to_vec());
        Saved { rows, shift: [self.shift[0], self.shift[1], self.shift[2]] }
    }

    /// Undoes updates of [`Gain::Pose`] since the save; landmarks inserted since then stay, independent of the pose.
    pub(crate) fn restore_pose(&mut self, saved: &Saved) {
        for (i, row) in saved.rows.iter().enumerate() {
            let target = self.covariance.row_mut(i);
            target[..row.len()].copy_from_slice(row);
            target[row.len()..].fill(0.0);
            self.shift[i] = saved.shift[i];
        }
    }

    /// What this scan has taught of the pose so far: a right perturbation.
    pub(crate) fn pose_shift(&self) -> Vector3<f64> {
        Vector3::new(self.shift[0], self.shift[1], self.shift[2])
    }

    /// Adds a landmark whose error has nothing in common with anything else; its slot.
    pub fn insert(&mut self, point: Vector2<f64>, covariance: &Matrix2<f64>) -> usize {
        let row = self.covariance.size();
        self.covariance.grow(2);
        for i in 0..2 {
            (0..=i).for_each(|j| self.covariance.set(row + i, row + j, covariance[(i, j)]));
        }
        self.push_point(point)
    }

    fn push_point(&mut self, point: Vector2<f64>) -> usize {
        self.points.push(point);
        self.shift.resize(self.covariance.size(), 0.0);
        self.points.len() - 1
    }

    /// Forgets the landmark in a slot; the last one takes its place.
    pub fn remove(&mut self, slot: usize) {
        let row = self.row_of(slot);
        self.covariance.swap_remove(row, 2);
        self.points.swap_remove(slot);
        let last = self.shift.len() - 2;
        self.shift.copy_within(last.., row);
        self.shift.truncate(last);
    }

    /// Moves the means by what was learned, and the perturbation to the new pose: `P <- Jr P Jr^T`.
    pub(crate) fn settle(&mut self) {
        let delta = self.pose_shift();
        let j = Se2::right_jacobian(delta);
        self.pose = self.pose.plus(delta);
        let own = j * self.pose_covariance() * j.transpose();
        self.covariance.mix_head(&j, &[]);
        self.set_pose_covariance(&own);
        for slot in 0..self.points.len() {
            let row = self.row_of(slot);
            self.points[slot] += Vector2::new(self.shift[row], self.shift[row + 1]);
        }
        self.shift.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_heads_too_far_left_ends_too_far_left() {
        let sigmas = Vector3::new(1e-3, 1e-3, 0.01);
        let mut joint = Joint::new(Se2::new(3.0, 1.0, 0.7), &Matrix3::from_diagonal(&sigmas.map(|s| s * s)), None);
        let (motion, covariance) = (Se2::new(10.0, 0.0, 0.0), Matrix3::zeros());
        joint.predict(&Motion { motion, covariance, by_drive: SMatrix::zeros() });
        let after = joint.pose_covariance();
        assert!((after.m22.sqrt() - 0.1).abs() < 1e-4 && (after.m23 - 1e-3).abs() < 1e-9, "{after}");
    }

    #[test]
    fn an_error_of_the_drive_adds_up_with_the_path() {
        let mut known = CalibrationCovariance::zeros();
        known[(0, 0)] = 1e-4;
        let mut joint = Joint::new(Se2::IDENTITY, &Matrix3::zeros(), Some(&known));
        let mut by_drive = SMatrix::zeros();
        by_drive[(0, 0)] = 1.0;
        for _ in 0..10 {
            let (motion, covariance) = (Se2::new(1.0, 0.0, 0.0), Matrix3::zeros());
            joint.predict(&Motion { motion, covariance, by_drive });
        }
        assert!((joint.pose_covariance().m11.sqrt() - 0.1).abs() < 1e-12);
    }
}

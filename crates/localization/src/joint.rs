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
//! landmark, met in a thousand scans, is not averaged away. A landmark alone: it is refined without a say of its own.
//!
//! Updates of one scan share one linearisation: means stay until [`Joint::settle`], meanwhile `shift` holds what was
//! learned. Perturbations of the pose are on the right.
//!
//! Source: S. F. Schmidt, "Application of state-space methods to navigation problems", 1966; R. Woodbury, J. Junkins,
//! "On the consider Kalman filter", AIAA 2010; Bucy, Joseph 1968 for the form of the update.

use crate::measurement::Begun;
use crate::symmetric::Symmetric;
use groma_geometry::Se2;
use nalgebra::{DMatrix, Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};
use std::ops::Range;

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

/// What moves in an update.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gain {
    /// The pose.
    Pose,
    /// A landmark.
    Landmark,
    /// The pose and the landmark that was seen.
    PoseAndLandmark,
    /// The pose and every landmark.
    All,
}

/// A sighting as a linear function of the state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Linear {
    /// Measured less predicted.
    pub residual: Vector2<f64>,
    pub by_pose: Matrix2x3<f64>,
    pub by_mount: Matrix2x3<f64>,
    /// Slot of the landmark and the Jacobian by its position.
    pub landmark: Option<(usize, Matrix2<f64>)>,
    /// Of the sighting, and of the landmark where that has no slot.
    pub noise: Matrix2<f64>,
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

    fn row_of(&self, slot: usize) -> usize {
        3 + self.calibration + 2 * slot
    }

    /// Moves the vehicle.
    pub fn predict(&mut self, step: &Motion) {
        let f = step.motion.inverse().adjoint();
        let size = self.covariance.size();
        let before = self.pose_covariance();
        let mut with_calibration = SMatrix::<f64, 3, DRIVE>::zeros();
        let mut own = Matrix3::zeros();
        if self.calibration > 0 {
            let p_xc = SMatrix::<f64, 3, DRIVE>::from_fn(|i, j| self.covariance.at(i, 3 + j));
            let p_cc = SMatrix::<f64, DRIVE, DRIVE>::from_fn(|i, j| self.covariance.at(3 + i, 3 + j));
            with_calibration = step.by_drive;
            let cross = f * p_xc * step.by_drive.transpose();
            own = cross + cross.transpose() + step.by_drive * p_cc * step.by_drive.transpose();
        }
        for j in 3..size {
            let mut moved = f * self.pose_column(j);
            if self.calibration > 0 {
                let drive = SMatrix::<f64, DRIVE, 1>::from_fn(|c, _| self.covariance.at(3 + c, j));
                moved += with_calibration * drive;
            }
            self.set_pose_column(j, &moved);
        }
        self.set_pose_covariance(&(f * before * f.transpose() + own + step.covariance));
        self.pose = self.pose * step.motion;
    }

    /// Covariance of the pose with row `j`.
    fn pose_column(&self, j: usize) -> Vector3<f64> {
        Vector3::new(self.covariance.at(0, j), self.covariance.at(1, j), self.covariance.at(2, j))
    }

    fn set_pose_column(&mut self, j: usize, column: &Vector3<f64>) {
        (0..3).for_each(|i| self.covariance.row_mut(i)[j] = column[i]);
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

    /// Adds a landmark that a sighting with covariance `noise` begins; its slot.
    pub(crate) fn begin(&mut self, begun: &Begun, noise: &Matrix2<f64>) -> usize {
        let row = self.covariance.size();
        let mut rows = [self.combine(0, &begun.by_pose, 0), self.combine(0, &begun.by_pose, 1)];
        if self.calibration > 0 {
            let mount = 3 + DRIVE;
            for (k, values) in rows.iter_mut().enumerate() {
                values.iter_mut().zip(self.combine(mount, &begun.by_mount, k)).for_each(|(v, m)| *v += m);
            }
        }
        let own = begun.by_polar * noise * begun.by_polar.transpose() + self.between(&rows, begun);
        self.covariance.grow(2);
        for (i, values) in rows.iter().enumerate() {
            values.iter().enumerate().for_each(|(j, v)| self.covariance.set(row + i, j, *v));
            (0..=i).for_each(|j| self.covariance.set(row + i, row + j, 0.5 * (own[(i, j)] + own[(j, i)])));
        }
        self.push_point(begun.position)
    }

    /// Row `k` of `J P_start..start+3`.
    fn combine(&self, start: usize, j: &Matrix2x3<f64>, k: usize) -> Vec<f64> {
        let entry = |c: usize| (0..3).map(|r| j[(k, r)] * self.covariance.at(start + r, c)).sum();
        (0..self.covariance.size()).map(entry).collect()
    }

    /// Covariance of a landmark from its rows with all that it depends on.
    fn between(&self, rows: &[Vec<f64>; 2], begun: &Begun) -> Matrix2<f64> {
        Matrix2::from_fn(|i, k| {
            let pose: f64 = (0..3).map(|c| rows[i][c] * begun.by_pose[(k, c)]).sum();
            let mount = 3 + DRIVE;
            let from_mount = |c: usize| rows[i][mount + c] * begun.by_mount[(k, c)];
            pose + if self.calibration > 0 { (0..3).map(from_mount).sum::<f64>() } else { 0.0 }
        })
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

    /// The blocks of a sighting's Jacobian: first row of the state, and the rows of H there.
    fn blocks(&self, m: &Linear) -> ([(usize, Matrix2x3<f64>); 2], usize) {
        let count = if self.calibration > 0 { 2 } else { 1 };
        ([(0, m.by_pose), (3 + DRIVE, m.by_mount)], count)
    }

    /// `H P` between two sets of columns: the covariance of what two sightings predict.
    pub(crate) fn cross(&self, a: &Linear, b: &Linear) -> Matrix2<f64> {
        let mut sum = Matrix2::zeros();
        let ((of_a, n_a), (of_b, n_b)) = (self.blocks(a), self.blocks(b));
        let to = |row: usize, column: usize| Matrix3::from_fn(|i, j| self.covariance.at(row + i, column + j));
        let half =
            |row: usize, column: usize| SMatrix::<f64, 3, 2>::from_fn(|i, j| self.covariance.at(row + i, column + j));
        for (row, h_a) in &of_a[..n_a] {
            for (column, h_b) in &of_b[..n_b] {
                sum += h_a * to(*row, *column) * h_b.transpose();
            }
            if let Some((slot, h_b)) = &b.landmark {
                sum += h_a * half(*row, self.row_of(*slot)) * h_b.transpose();
            }
        }
        let Some((slot, h_a)) = &a.landmark else { return sum };
        let row = self.row_of(*slot);
        for (column, h_b) in &of_b[..n_b] {
            sum += h_a * half(*column, row).transpose() * h_b.transpose();
        }
        if let Some((other, h_b)) = &b.landmark {
            let column = self.row_of(*other);
            sum += h_a * Matrix2::from_fn(|i, j| self.covariance.at(row + i, column + j)) * h_b.transpose();
        }
        sum
    }

    /// Covariance of a sighting's innovation.
    pub(crate) fn innovation_covariance(&self, m: &Linear) -> Matrix2<f64> {
        let s = self.cross(m, m) + m.noise;
        0.5 * (s + s.transpose())
    }

    /// The innovation that is left after what this scan has taught so far.
    pub(crate) fn innovation(&self, m: &Linear) -> Vector2<f64> {
        let at = |k: usize| Vector3::new(self.shift[k], self.shift[k + 1], self.shift[k + 2]);
        let (blocks, count) = self.blocks(m);
        let mut v = m.residual;
        for (row, h) in &blocks[..count] {
            v -= h * at(*row);
        }
        if let Some((slot, h)) = &m.landmark {
            let row = self.row_of(*slot);
            v -= h * Vector2::new(self.shift[row], self.shift[row + 1]);
        }
        v
    }

    /// Squared Mahalanobis distance of a sighting's innovation, with its covariance's inverse; none where that is not
    /// positive definite.
    pub(crate) fn distance_sq(&self, m: &Linear) -> Option<f64> {
        let v = self.innovation(m);
        let inverse = inverse(&self.innovation_covariance(m))?;
        Some(v.dot(&(inverse * v)))
    }

    /// Learns from a sighting, if its innovation passes the gate; its squared Mahalanobis distance then.
    pub(crate) fn update(&mut self, m: &Linear, gain: Gain, gate: f64) -> Option<f64> {
        let v = self.innovation(m);
        let s_inverse = inverse(&self.innovation_covariance(m))?;
        let distance_sq = v.dot(&(s_inverse * v));
        if distance_sq > gate {
            return None;
        }
        self.project(m);
        let [first, second] = std::mem::take(&mut self.projected);
        let (pose, moved) = self.movable(m, gain);
        let joseph = (!pose.is_empty()).then(|| self.joseph(m, &s_inverse, &first, &second));
        for i in pose.chain(moved.clone()) {
            let k = s_inverse * Vector2::new(first[i], second[i]);
            let row = self.covariance.row_mut(i);
            row.iter_mut().zip(&first).zip(&second).for_each(|((p, a), b)| *p -= k.x * a + k.y * b);
            self.shift[i] += k.dot(&v);
        }
        // The mirror image after all rows: where both move, each row has the whole change.
        for i in moved {
            self.covariance.mirror(i);
            let row = s_inverse * Vector2::new(first[i], second[i]);
            if gain == Gain::Landmark {
                (0..3).for_each(|j| self.covariance.row_mut(j)[i] -= row.x * first[j] + row.y * second[j]);
            }
        }
        if let Some(covariance) = joseph {
            self.set_pose_covariance(&covariance);
        }
        self.projected = [first, second];
        Some(distance_sq)
    }

    /// Rows of the pose and of landmarks that move.
    fn movable(&self, m: &Linear, gain: Gain) -> (Range<usize>, Range<usize>) {
        let landmark = || m.landmark.map_or(0..0, |(slot, _)| self.row_of(slot)..self.row_of(slot) + 2);
        match gain {
            Gain::Pose => (0..3, 0..0),
            Gain::Landmark => (0..0, landmark()),
            Gain::PoseAndLandmark => (0..3, landmark()),
            Gain::All => (0..3, self.row_of(0)..self.covariance.size()),
        }
    }

    /// The pose's covariance after a sighting.
    fn joseph(&self, m: &Linear, s_inverse: &Matrix2<f64>, first: &[f64], second: &[f64]) -> Matrix3<f64> {
        let k = SMatrix::<f64, 3, 2>::from_fn(|i, j| Vector2::new(first[i], second[i]).dot(&s_inverse.column(j)));
        let landmark = m.landmark.map(|(slot, h)| (self.row_of(slot), h));
        if self.calibration > 0 {
            let mut h = SMatrix::<f64, 2, 8>::zeros();
            h.fixed_view_mut::<2, 3>(0, 5).copy_from(&m.by_mount);
            self.joseph_of(h, [3 + DRIVE, 4 + DRIVE, 5 + DRIVE].as_slice(), m, landmark, &k)
        } else {
            self.joseph_of(SMatrix::<f64, 2, 5>::zeros(), &[], m, landmark, &k)
        }
    }

    /// The pose's block of `A P A^T + K R K^T`, `A = I - K H`, over N rows: pose, landmark, and the rows of `more`.
    fn joseph_of<const N: usize>(
        &self,
        mut h: SMatrix<f64, 2, N>,
        more: &[usize],
        m: &Linear,
        landmark: Option<(usize, Matrix2<f64>)>,
        k: &SMatrix<f64, 3, 2>,
    ) -> Matrix3<f64> {
        h.fixed_view_mut::<2, 3>(0, 0).copy_from(&m.by_pose);
        let mut at = [0, 1, 2, 0, 0, 0, 0, 0];
        if let Some((row, by_landmark)) = landmark {
            h.fixed_view_mut::<2, 2>(0, 3).copy_from(&by_landmark);
            (at[3], at[4]) = (row, row + 1);
        }
        at[5..5 + more.len()].copy_from_slice(more);
        let p = SMatrix::<f64, N, N>::from_fn(|i, j| self.covariance.at(at[i], at[j]));
        let a = SMatrix::<f64, 3, N>::identity() - k * h;
        a * p * a.transpose() + k * m.noise * k.transpose()
    }

    /// `H P` into `projected`.
    fn project(&mut self, m: &Linear) {
        let size = self.covariance.size();
        let (blocks, count) = self.blocks(m);
        let mut projected = std::mem::take(&mut self.projected);
        for (k, out) in projected.iter_mut().enumerate() {
            out.clear();
            out.resize(size, 0.0);
            let mut add = |row: usize, by: f64| {
                let head = [0, 1, 2].map(|j| by * self.covariance.at(row, j));
                let tail = &self.covariance.row(row)[3..];
                out[3..].iter_mut().zip(tail).for_each(|(o, p)| *o += by * p);
                (0..3).for_each(|j| out[j] += head[j]);
            };
            for (row, h) in &blocks[..count] {
                (0..3).for_each(|r| add(row + r, h[(k, r)]));
            }
            if let Some((slot, h)) = &m.landmark {
                let row = self.row_of(*slot);
                (0..2).for_each(|r| add(row + r, h[(k, r)]));
            }
        }
        self.projected = projected;
    }

    /// Moves the means by what was learned, and the perturbation to the new pose: `P <- Jr P Jr^T`.
    pub(crate) fn settle(&mut self) {
        let delta = self.pose_shift();
        let j = Se2::right_jacobian(delta);
        self.pose = self.pose.plus(delta);
        let own = j * self.pose_covariance() * j.transpose();
        for c in 3..self.covariance.size() {
            let column = j * self.pose_column(c);
            self.set_pose_column(c, &column);
        }
        self.set_pose_covariance(&own);
        for slot in 0..self.points.len() {
            let row = self.row_of(slot);
            self.points[slot] += Vector2::new(self.shift[row], self.shift[row + 1]);
        }
        self.shift.fill(0.0);
    }
}

/// The inverse of a symmetric matrix, if it is positive definite.
pub(crate) fn inverse(s: &Matrix2<f64>) -> Option<Matrix2<f64>> {
    let det = s.m11 * s.m22 - s.m12 * s.m12;
    (s.m11 > 0.0 && det > 0.0 && det.is_finite()).then(|| Matrix2::new(s.m22, -s.m12, -s.m12, s.m11) / det)
}

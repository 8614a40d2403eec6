//! The map of one noisy drive by least squares over all of it, as the mapping of a camera network ends.
//!
//! Unknown are the poses of the robot at its stops, but for the first, which defines the map, and those of the cameras.
//! What the wheels told between two stops, and each look at a camera, is a relation
//!
//! ```text
//! T_a^-1 T_b = M Exp(w),   w ~ N(0, C),   T = Exp(d) T^
//! e(d) = e + A (d_b - d_a),   e = Log(M^-1 T_a^-1 T_b),   A = Jr(e)^-1 Ad(T_b^-1)
//! ```
//!
//! (a look from below a camera, `Z = Exp(v) T_R^-1 T_C`, is the relation of camera to robot with `M = Z^-1`). The sum of
//! the `e' C^-1 e` is minimised by Gauss and Newton's method from the filter's map on. The normalised squared error of the
//! cameras alone is the least that the same sum, linear, can be made when the cameras' errors are held and the robot's are
//! free: its marginal, without the inverse of a matrix.
//!
//! Assumes what the filter assumes but for linearity: independent Gaussian noise, known associations.

use crate::error::Error;
use groma_estimation::{BlockMatrix, Cholesky};
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector3};

/// Steps that the minimisation may take.
const ROUNDS: usize = 20;
/// Largest component of a step at which it ends [m, rad].
const STILL: f64 = 1e-7;
/// Standard deviation that everything has at least, so that wheels without slip weigh finitely [m, rad].
const LEAST: f64 = 1e-6;

/// What one drive measured.
pub(super) struct Drive {
    stops: Vec<Se2>,
    cameras: Vec<Se2>,
    relations: Vec<Relation>,
    /// What the wheels told since the last stop, and its covariance at its end.
    since: (Se2, Matrix3<f64>),
}

/// A pose among the unknown.
#[derive(Clone, Copy)]
enum Pose {
    Stop(usize),
    Camera(usize),
}

struct Relation {
    from: Pose,
    to: Pose,
    measured: Se2,
    covariance: Matrix3<f64>,
}

/// A relation, linear and whitened: `e + a (d_to - d_from)`.
struct Row {
    from: usize,
    to: usize,
    e: Vector3<f64>,
    a: Matrix3<f64>,
}

impl Drive {
    /// From a known pose.
    pub fn new(start: Se2) -> Self {
        Self { stops: vec![start], cameras: vec![], relations: vec![], since: (Se2::IDENTITY, Matrix3::zeros()) }
    }

    /// The wheels told a step, with noise at its end.
    pub fn step(&mut self, told: &Se2, covariance: &Matrix3<f64>) {
        let back = told.inverse().adjoint();
        self.since = (self.since.0 * *told, back * self.since.1 * back.transpose() + covariance);
    }

    /// The robot stops where it believes to be.
    pub fn stop(&mut self, believed: Se2) {
        let (measured, covariance) = std::mem::replace(&mut self.since, (Se2::IDENTITY, Matrix3::zeros()));
        let (from, to) = (Pose::Stop(self.stops.len() - 1), Pose::Stop(self.stops.len()));
        self.relations.push(Relation { from, to, measured, covariance });
        self.stops.push(believed);
    }

    /// The robot saw a camera at its last stop.
    pub fn look(&mut self, camera: usize, measured: &Se2, covariance: &Matrix3<f64>) {
        let (from, to) = (Pose::Camera(camera), Pose::Stop(self.stops.len() - 1));
        self.relations.push(Relation { from, to, measured: measured.inverse(), covariance: *covariance });
    }

    /// The cameras as they are thought to be.
    pub fn cameras(&self) -> &[Se2] {
        &self.cameras
    }

    /// Moves all poses to where the sum of squares is least, the cameras from where they are given.
    pub fn solve(&mut self, cameras: &[Se2]) -> Result<(), Error> {
        self.cameras = cameras.to_vec();
        let held: Vec<_> = (0..self.poses()).map(|i| (i == 0).then(Vector3::zeros)).collect();
        for _ in 0..ROUNDS {
            let step = least(&self.rows()?, &held)?;
            let all = self.stops.iter_mut().chain(&mut self.cameras);
            all.zip(&step).for_each(|(pose, d)| *pose = Se2::exp(*d) * *pose);
            if step.iter().all(|d| d.amax() < STILL) {
                break;
            }
        }
        Ok(())
    }

    /// The normalised squared error of the cameras, given their errors in the world frame.
    pub fn normalised(&self, errors: &[Vector3<f64>]) -> Result<f64, Error> {
        let mut rows = self.rows()?;
        rows.iter_mut().for_each(|row| row.e = Vector3::zeros());
        let free = vec![None; self.stops.len() - 1];
        let held: Vec<_> =
            [Some(Vector3::zeros())].into_iter().chain(free).chain(errors.iter().copied().map(Some)).collect();
        let d = least(&rows, &held)?;
        Ok(rows.iter().map(|row| (row.a * (d[row.to] - d[row.from])).norm_squared()).sum())
    }

    fn poses(&self) -> usize {
        self.stops.len() + self.cameras.len()
    }

    fn rows(&self) -> Result<Vec<Row>, Error> {
        self.relations.iter().map(|relation| self.row(relation)).collect()
    }

    fn row(&self, relation: &Relation) -> Result<Row, Error> {
        let Relation { from, to, measured, covariance } = relation;
        let (a, b) = (self.pose(*from), self.pose(*to));
        let e = (measured.inverse() * a.inverse() * b).log();
        let root = nalgebra::Cholesky::new(covariance + Matrix3::identity() * LEAST.powi(2));
        let whiten = root.and_then(|root| root.l().try_inverse()).ok_or_else(|| unsolved("a covariance"))?;
        let a = whiten * Se2::right_jacobian_inverse(e) * b.inverse().adjoint();
        Ok(Row { from: self.index(*from), to: self.index(*to), e: whiten * e, a })
    }

    fn pose(&self, pose: Pose) -> Se2 {
        match pose {
            Pose::Stop(i) => self.stops[i],
            Pose::Camera(i) => self.cameras[i],
        }
    }

    fn index(&self, pose: Pose) -> usize {
        match pose {
            Pose::Stop(i) => i,
            Pose::Camera(i) => self.stops.len() + i,
        }
    }
}

/// The tangents of all poses that minimise the sum of squares, some of them held.
fn least(rows: &[Row], held: &[Option<Vector3<f64>>]) -> Result<Vec<Vector3<f64>>, Error> {
    let mut count = 0..;
    let block: Vec<Option<usize>> = held.iter().map(|h| if h.is_none() { count.next() } else { None }).collect();
    let blocks = block.iter().flatten().count();
    let pairs = rows.iter().filter_map(|row| Some((block[row.from]?, block[row.to]?)));
    let mut matrix = BlockMatrix::<3>::zeros(blocks, pairs);
    let mut right = vec![Vector3::zeros(); blocks];
    let known = |pose: usize| held[pose].unwrap_or_default();
    for row in rows {
        let weight = row.a.tr_mul(&row.a);
        let pull = row.a.tr_mul(&(row.e + row.a * (known(row.to) - known(row.from))));
        for (end, sign) in [(row.from, 1.0), (row.to, -1.0)] {
            if let Some(i) = block[end] {
                matrix.diagonal[i] += weight;
                right[i] += pull * sign;
            }
        }
        if let (Some(i), Some(j)) = (block[row.from], block[row.to])
            && let Some(slot) = matrix.slot(i.min(j), i.max(j))
        {
            matrix.upper[slot] -= weight;
        }
    }
    let solved = solve(&matrix, &right).map_err(|e| unsolved(&e.to_string()))?;
    Ok(held.iter().zip(&block).map(|(h, b)| h.or(b.map(|b| solved[b])).unwrap_or_default()).collect())
}

fn solve(matrix: &BlockMatrix<3>, right: &[Vector3<f64>]) -> Result<Vec<Vector3<f64>>, groma_estimation::Error> {
    let mut factor = Cholesky::analyze(matrix)?;
    factor.factorize(matrix)?;
    factor.solve(right)
}

fn unsolved(why: &str) -> Error {
    Error::Unreachable(format!("the drive tried out gave no map ({why}): check the noise"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A square of 8 m driven twice under four cameras, without noise in what is told.
    fn square() -> (Drive, Vec<Se2>) {
        let cameras: Vec<Se2> =
            [(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (0.0, 8.0)].map(|(x, y)| Se2::new(x, y, 0.3)).into();
        let mut robot = Se2::new(0.0, 0.0, 0.0);
        let mut drive = Drive::new(robot);
        let covariance = Matrix3::from_diagonal(&Vector3::new(1e-3, 4e-4, 3e-4));
        let look = |drive: &mut Drive, robot: &Se2, camera: usize| {
            drive.look(
                camera,
                &robot.between(&cameras[camera]),
                &Matrix3::from_diagonal(&Vector3::new(2e-5, 2e-5, 3e-5)),
            )
        };
        look(&mut drive, &robot, 0);
        for k in 1..9 {
            for told in [Se2::new(8.0, 0.0, 0.0), Se2::new(0.0, 0.0, std::f64::consts::FRAC_PI_2)] {
                drive.step(&told, &covariance);
                robot = robot * told;
            }
            drive.stop(robot);
            look(&mut drive, &robot, k % 4);
        }
        (drive, cameras)
    }

    #[test]
    fn without_noise_it_comes_back_to_the_truth_from_far_away() {
        let (mut drive, truth) = square();
        let away = |(i, c): (usize, &Se2)| c.plus(Vector3::new(0.8, -0.5, 0.2 * (i as f64 - 1.5)));
        drive
            .stops
            .iter_mut()
            .enumerate()
            .skip(1)
            .for_each(|(i, s)| *s = s.plus(Vector3::new(0.1 * i as f64, 0.3, -0.1)));
        drive.solve(&truth.iter().enumerate().map(away).collect::<Vec<_>>()).unwrap();
        let off = drive.cameras().iter().zip(&truth).map(|(a, b)| a.minus(b).amax()).fold(0.0, f64::max);
        assert!(off < 1e-12, "{off}");
    }

    #[test]
    fn the_normalised_error_is_that_of_the_dense_marginal() {
        let (mut drive, truth) = square();
        drive.solve(&truth).unwrap();
        let (rows, n) = (drive.rows().unwrap(), drive.poses() - 1);
        let mut information = DMatrix::zeros(3 * n, 3 * n);
        for row in &rows {
            let mut jacobian = DMatrix::zeros(3, 3 * n + 3);
            jacobian.view_mut((0, 3 * row.to), (3, 3)).copy_from(&row.a);
            jacobian.view_mut((0, 3 * row.from), (3, 3)).copy_from(&-row.a);
            let jacobian = jacobian.columns(3, 3 * n);
            information += jacobian.transpose() * jacobian;
        }
        let covariance = information.try_inverse().unwrap();
        let at = 3 * (drive.stops.len() - 1);
        let map = covariance.view((at, at), (12, 12)).into_owned();
        let errors: Vec<_> = (0..4).map(|i| Vector3::new(0.01, -0.02, 0.01 * f64::from(i))).collect();
        let flat = DVector::from_iterator(12, errors.iter().flat_map(|e| e.iter().copied()));
        let dense = flat.dot(&(map.try_inverse().unwrap() * &flat));
        assert!((drive.normalised(&errors).unwrap() / dense - 1.0).abs() < 1e-6);
    }
}

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
//! (a view from below a camera, `Z = Exp(v) T_R^-1 T_C`, is the relation of camera to robot with `M = Z^-1`). The sum of
//! the `e' C^-1 e` is minimised from the filter's map on (`estimation::levenberg_marquardt`). The normalised squared error of the
//! cameras alone is the least that the same sum, linear, can be made when the cameras' errors are held and the robot's are
//! free: its marginal, without the inverse of a matrix.
//!
//! Assumes what the filter assumes but for linearity: independent Gaussian noise, known associations.

use crate::error::Error;
use groma_estimation::levenberg_marquardt::{Options, Problem, minimize};
use groma_estimation::{BlockMatrix, Cholesky};
use groma_geometry::Se2;
use nalgebra::{Matrix3, Vector3};

/// When the minimisation ends.
const END: Options = Options { max_iterations: 20, tolerance: 1e-12 };
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
        let held: Vec<_> = (0..self.poses().len()).map(|i| (i == 0).then(Vector3::zeros)).collect();
        let equations = Equations::new(&self.rows(&self.poses())?, &held);
        let mut descent = Descent { drive: self, held: &held, rows: vec![], equations };
        let end = minimize(&mut descent, self.poses(), &END)?;
        let moved = end.ok_or_else(|| unsolved("no cost"))?.state;
        let (stops, cameras) = moved.split_at(self.stops.len());
        (self.stops, self.cameras) = (stops.to_vec(), cameras.to_vec());
        Ok(())
    }

    /// The normalised squared error of the cameras, given their errors in the world frame.
    pub fn normalised(&self, errors: &[Vector3<f64>]) -> Result<f64, Error> {
        let mut rows = self.rows(&self.poses())?;
        rows.iter_mut().for_each(|row| row.e = Vector3::zeros());
        let free = vec![None; self.stops.len() - 1];
        let held: Vec<_> =
            [Some(Vector3::zeros())].into_iter().chain(free).chain(errors.iter().copied().map(Some)).collect();
        let d = Equations::new(&rows, &held).solve(0.0, &held)?;
        Ok(rows.iter().map(|row| (row.a * (d[row.to] - d[row.from])).norm_squared()).sum())
    }

    /// All poses: the stops, then the cameras.
    fn poses(&self) -> Vec<Se2> {
        [&self.stops[..], &self.cameras].concat()
    }

    fn rows(&self, poses: &[Se2]) -> Result<Vec<Row>, Error> {
        self.relations.iter().map(|relation| self.row(relation, poses)).collect()
    }

    fn row(&self, relation: &Relation, poses: &[Se2]) -> Result<Row, Error> {
        let Relation { measured, covariance, .. } = relation;
        let (from, to) = (self.index(relation.from), self.index(relation.to));
        let e = (measured.inverse() * poses[from].inverse() * poses[to]).log();
        let root = nalgebra::Cholesky::new(covariance + Matrix3::identity() * LEAST.powi(2));
        let whiten = root.and_then(|root| root.l().try_inverse()).ok_or_else(|| unsolved("a covariance"))?;
        let a = whiten * Se2::right_jacobian_inverse(e) * poses[to].inverse().adjoint();
        Ok(Row { from, to, e: whiten * e, a })
    }

    fn index(&self, pose: Pose) -> usize {
        match pose {
            Pose::Stop(i) => i,
            Pose::Camera(i) => self.stops.len() + i,
        }
    }
}

/// The sum of squares of a drive, with its rows at the poses of the last cost, and its equations at those last kept.
struct Descent<'a> {
    drive: &'a Drive,
    held: &'a [Option<Vector3<f64>>],
    rows: Vec<Row>,
    equations: Equations,
}

impl Problem for Descent<'_> {
    type State = Vec<Se2>;
    type Step = Vec<Vector3<f64>>;
    type Error = Error;

    fn cost(&mut self, poses: &Vec<Se2>) -> Result<Option<f64>, Error> {
        self.rows = self.drive.rows(poses)?;
        Ok(Some(self.rows.iter().map(|row| row.e.norm_squared()).sum()))
    }

    fn linearize(&mut self, _: &Vec<Se2>) -> Result<(), Error> {
        self.equations = Equations::new(&self.rows, self.held);
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Vec<Vector3<f64>>, f64)>, Error> {
        let step = self.equations.solve(damping, self.held)?;
        let promise = self.equations.promise(&step);
        Ok(Some((step, promise)))
    }

    fn moved(&self, poses: &Vec<Se2>, step: &Vec<Vector3<f64>>) -> Option<Vec<Se2>> {
        Some(poses.iter().zip(step).map(|(pose, d)| Se2::exp(*d) * *pose).collect())
    }
}

/// The normal equations of the tangents of all poses, some of them held.
struct Equations {
    /// The block of every pose that is free.
    block: Vec<Option<usize>>,
    matrix: BlockMatrix<3>,
    right: Vec<Vector3<f64>>,
}

impl Equations {
    fn new(rows: &[Row], held: &[Option<Vector3<f64>>]) -> Self {
        let mut count = 0..;
        let block: Vec<Option<usize>> = held.iter().map(|h| if h.is_none() { count.next() } else { None }).collect();
        let blocks = block.iter().flatten().count();
        let pairs = rows.iter().filter_map(|row| Some((block[row.from]?, block[row.to]?)));
        let mut equations =
            Self { matrix: BlockMatrix::zeros(blocks, pairs), right: vec![Vector3::zeros(); blocks], block };
        let known = |pose: usize| held[pose].unwrap_or_default();
        rows.iter().for_each(|row| equations.add(row, &(known(row.to) - known(row.from))));
        equations
    }

    /// Adds a row whose held ends are `apart`.
    fn add(&mut self, row: &Row, apart: &Vector3<f64>) {
        let (from, to) = (self.block[row.from], self.block[row.to]);
        let weight = row.a.tr_mul(&row.a);
        let pull = row.a.tr_mul(&(row.e + row.a * apart));
        for (end, sign) in [(from, 1.0), (to, -1.0)] {
            if let Some(i) = end {
                self.matrix.diagonal[i] += weight;
                self.right[i] += pull * sign;
            }
        }
        if let (Some(i), Some(j)) = (from, to)
            && let Some(slot) = self.matrix.slot(i.min(j), i.max(j))
        {
            self.matrix.upper[slot] -= weight;
        }
    }

    /// The tangents that minimise the damped sum, those held as they are.
    fn solve(&self, damping: f64, held: &[Option<Vector3<f64>>]) -> Result<Vec<Vector3<f64>>, Error> {
        let mut damped = self.matrix.clone();
        for block in &mut damped.diagonal {
            (0..3).for_each(|k| block[(k, k)] *= 1.0 + damping);
        }
        let solved = solve(&damped, &self.right).map_err(|e| unsolved(&e.to_string()))?;
        Ok(held.iter().zip(&self.block).map(|(h, b)| h.or(b.map(|b| solved[b])).unwrap_or_default()).collect())
    }

    /// By how much a step lowers the sum, linear.
    fn promise(&self, step: &[Vector3<f64>]) -> f64 {
        let free: Vec<Vector3<f64>> =
            step.iter().zip(&self.block).filter(|(_, block)| block.is_some()).map(|(d, _)| *d).collect();
        let bent = self.matrix.multiply(&free);
        free.iter().zip(&self.right).zip(&bent).map(|((d, right), bent)| d.dot(&(right * 2.0 - bent))).sum()
    }
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
        let (rows, n) = (drive.rows(&drive.poses()).unwrap(), drive.poses().len() - 1);
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

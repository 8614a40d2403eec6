//! The filter: robot, mount and cameras, one covariance in factors, errors in the world frame.
//!
//! State: the error of the mount and of the robot (the head of [`Udu`], robot last), and for each camera its pose and its
//! m calibration states, born at first sight. Equations: [`measurement`](crate::measurement), [`floor`](crate::floor),
//! [`odometry`](crate::odometry).
//!
//! ```text
//! moving    xi' = xi + Ad(T') w                    the rest is untouched: O(1)
//! leaving   xi' = F xi                             O(n)
//! arriving  xi' = xi + Ad(T') j                    O(1)
//! birth     (zeta, b) from xi, mu and the view     O(n)
//! view      six rows in one pass                   O(n^2)
//! ```
//!
//! After a correction the estimates move by `Exp(step)` on the left and the error is zero again; the covariance needs no
//! change, to first order. The covariance may be kept in f32; poses are f64.

use crate::floor::levelled;
use crate::measurement::{innovation, jacobians, placed};
use crate::odometry::{lifted, variances};
use crate::{Error, Floor, OdometryNoise, View};
use groma_estimation::Udu;
use groma_estimation::udu::{Real, Rows};
use groma_geometry::{LieGroup, Se2, Se3};
use nalgebra::{Cholesky, DMatrix, DVector, Matrix6, SMatrix, Vector6, convert, try_convert};

/// Blocks of the head.
const MOUNT: usize = 0;
const ROBOT: usize = 1;

/// A camera in the filter.
#[derive(Clone, Debug)]
pub struct Camera {
    /// `T_W_C`.
    pub pose: Se3,
    /// b (m).
    pub calibration: DVector<f64>,
    /// Index of its first state.
    first: usize,
}

/// What a view would change, before it does.
#[derive(Clone, Debug, PartialEq)]
pub struct Innovation {
    /// y (6).
    pub value: Vector6<f64>,
    /// S (6 x 6).
    pub covariance: Matrix6<f64>,
    /// `y^T S^-1 y`; infinite when S is not positive definite.
    pub nis: f64,
}

/// Robot, mount and cameras with their joint covariance.
#[derive(Clone, Debug)]
pub struct NetworkFilter<T: Real = f64> {
    robot: Se3,
    mount: Se3,
    cameras: Vec<Camera>,
    udu: Udu<T>,
    stands: bool,
    odometry: OdometryNoise,
    floor: Floor,
}

impl<T: Real> NetworkFilter<T> {
    /// A robot that stands at the origin of the world, whose target is mounted at `mount` with an error `mu` of covariance
    /// `root root^T` (6 rows; no column when it is known exactly).
    #[must_use]
    pub fn new(mount: Se3, root: &DMatrix<f64>, odometry: OdometryNoise, floor: Floor) -> Self {
        let stand = DMatrix::from_diagonal(&DVector::from_column_slice(floor.sigmas().as_slice()));
        let udu = Udu::new(&[narrow(root), narrow(&stand)]);
        Self { robot: Se3::identity(), mount, cameras: vec![], udu, stands: true, odometry, floor }
    }

    /// `T_W_R`.
    #[must_use]
    pub fn robot(&self) -> &Se3 {
        &self.robot
    }

    /// `T_R_B`.
    #[must_use]
    pub fn mount(&self) -> &Se3 {
        &self.mount
    }

    /// The cameras in the order of their births.
    #[must_use]
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// The factored covariance.
    #[must_use]
    pub fn covariance(&self) -> &Udu<T> {
        &self.udu
    }

    /// Covariance of the world-frame errors of two cameras' poses (of one, for the same).
    #[must_use]
    pub fn camera_covariance(&self, i: usize, j: usize) -> Matrix6<f64> {
        let (i, j) = (self.cameras[i].first, self.cameras[j].first);
        fixed(&self.udu.covariance_block(i, j, 6, 6))
    }

    /// Covariance of the world-frame error of the robot's pose.
    #[must_use]
    pub fn robot_covariance(&self) -> Matrix6<f64> {
        let at = self.udu.head(ROBOT);
        fixed(&self.udu.covariance_block(at, at, 6, 6))
    }

    /// Covariance of all that is estimated of the cameras: pose and calibration of each, in the order of births.
    #[must_use]
    pub fn map_covariance(&self) -> DMatrix<f64> {
        let n = self.udu.head(MOUNT);
        widened(&self.udu.covariance_block(0, 0, n, n))
    }

    /// The robot drives a step of its odometry.
    ///
    /// # Errors
    /// Never for a finite step.
    pub fn drive(&mut self, step: &Se2) -> Result<(), Error> {
        if self.stands {
            let (level, f) = levelled(&self.robot);
            self.robot = level;
            self.udu.predict(Some(&narrow(&dynamic(&f))), &DMatrix::zeros(6, 0))?;
            self.stands = false;
        }
        self.robot = self.robot * lifted(step);
        self.add_noise(&variances(&self.odometry, step).map(f64::sqrt))
    }

    /// The robot stops: the floor is uneven in a new way.
    ///
    /// # Errors
    /// Never.
    pub fn stop(&mut self) -> Result<(), Error> {
        if self.stands {
            return Ok(());
        }
        self.stands = true;
        self.add_noise(&self.floor.sigmas())
    }

    /// Adds a body-frame error with these standard deviations to the robot's pose.
    fn add_noise(&mut self, sigmas: &Vector6<f64>) -> Result<(), Error> {
        let columns: Vec<usize> = (0..6).filter(|&k| sigmas[k] > 0.0).collect();
        let adjoint = self.robot.adjoint();
        let root = DMatrix::from_fn(6, columns.len(), |i, j| adjoint[(i, columns[j])] * sigmas[columns[j]]);
        Ok(self.udu.predict(None, &narrow(&root))?)
    }

    /// Places a camera that is seen for the first time; `root root^T` is the covariance of its m calibration states before
    /// this view. Returns its number.
    ///
    /// # Errors
    /// When the view's covariance is not positive definite or sizes do not fit.
    pub fn birth(&mut self, view: &View, root: &DMatrix<f64>) -> Result<usize, Error> {
        let m = root.nrows();
        let b_inverse = (self.robot * self.mount).adjoint();
        let noise =
            Cholesky::new(view.covariance).ok_or(groma_estimation::Error::NotPositiveDefinite { block: 0 })?.l();
        let mut own = DMatrix::zeros(6 + m, 6 + root.ncols());
        own.view_mut((0, 0), (6, 6)).copy_from(&(b_inverse * noise));
        own.view_mut((0, 6), (6, root.ncols())).copy_from(&(b_inverse * &view.sensitivity * root));
        own.view_mut((6, 6), (m, root.ncols())).copy_from(root);
        let gain = |block: &Matrix6<f64>| Some(narrow(&dynamic(block).resize_vertically(6 + m, 0.0)));
        let gains = [gain(&self.robot.adjoint()), gain(&Matrix6::identity())];
        let first = self.udu.birth(&gains, &narrow(&own))?;
        let calibration = DVector::zeros(m);
        let pose = placed(&self.robot, &self.mount, &calibration, view);
        self.cameras.push(Camera { pose, calibration, first });
        Ok(self.cameras.len() - 1)
    }

    /// What the view of a known camera would change.
    ///
    /// # Errors
    /// When sizes do not fit.
    pub fn innovation(&self, camera: usize, view: &View) -> Result<Innovation, Error> {
        let seen = &self.cameras[camera];
        let value = innovation(&self.robot, &self.mount, &seen.pose, &seen.calibration, view);
        let s = self.udu.innovation_covariance(&self.rows(seen, view), &narrow(&dynamic(&view.covariance)))?;
        let covariance = fixed(&s);
        let nis = Cholesky::new(covariance).map_or(f64::INFINITY, |c| value.dot(&c.solve(&value)));
        Ok(Innovation { value, covariance, nis })
    }

    /// Takes in the view of a known camera; returns `y^T S^-1 y`.
    ///
    /// # Errors
    /// When sizes do not fit or the view's covariance is not positive definite; nothing has changed then.
    pub fn update(&mut self, camera: usize, view: &View) -> Result<f64, Error> {
        let seen = &self.cameras[camera];
        let y = innovation(&self.robot, &self.mount, &seen.pose, &seen.calibration, view);
        let y = DVector::from_iterator(6, y.iter().map(|&v| convert(v)));
        let rows = self.rows(seen, view);
        let done = self.udu.update(&rows, &y, &narrow(&dynamic(&view.covariance)))?;
        self.retract(&done.step);
        Ok(try_convert(done.nis).unwrap_or(f64::INFINITY))
    }

    fn rows(&self, camera: &Camera, view: &View) -> Rows<T> {
        let (b, b_mount) = jacobians(&self.robot, &self.mount);
        let mut own = dynamic(&-b).resize_horizontally(6 + view.sensitivity.ncols(), 0.0);
        own.columns_mut(6, view.sensitivity.ncols()).copy_from(&view.sensitivity);
        let blocks =
            [(camera.first, own), (self.udu.head(MOUNT), dynamic(&b_mount)), (self.udu.head(ROBOT), dynamic(&b))];
        Rows { blocks: blocks.iter().map(|(at, block)| (*at, narrow(block))).collect() }
    }

    fn retract(&mut self, step: &DVector<T>) {
        let part = |at: usize, count: usize| {
            DVector::from_iterator(count, (at..at + count).map(|k| try_convert(step[k]).unwrap_or(f64::NAN)))
        };
        let moved = |pose: &Se3, at: usize| Se3::exp(&Vector6::from_column_slice(part(at, 6).as_slice())) * *pose;
        self.robot = moved(&self.robot, self.udu.head(ROBOT));
        self.mount = moved(&self.mount, self.udu.head(MOUNT));
        for camera in &mut self.cameras {
            camera.pose = moved(&camera.pose, camera.first);
            camera.calibration += part(camera.first + 6, camera.calibration.len());
        }
    }
}

fn dynamic<const R: usize>(m: &SMatrix<f64, R, R>) -> DMatrix<f64> {
    DMatrix::from_column_slice(R, R, m.as_slice())
}

fn narrow<T: Real>(m: &DMatrix<f64>) -> DMatrix<T> {
    m.map(convert)
}

fn widened<T: Real>(m: &DMatrix<T>) -> DMatrix<f64> {
    m.map(|v| try_convert(v).unwrap_or(f64::NAN))
}

fn fixed<T: Real>(m: &DMatrix<T>) -> Matrix6<f64> {
    let m = widened(m);
    Matrix6::from_fn(|i, j| m[(i, j)])
}

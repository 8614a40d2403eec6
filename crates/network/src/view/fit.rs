//! The pose of the target that explains its corners in one image, and what of the camera's calibration goes into it.
//!
//! ```text
//! r_i = (pi(theta, Z p_i) - z_i) / sigma_i,     Z <- Z Exp(d),     dp_C/dd = R [I, -[p]_x]
//! Cov(d) = (J^T J)^-1,     S = (J^T J)^-1 J^T J_theta E
//! ```
//!
//! minimised by Levenberg-Marquardt with Huber's loss on each corner. E takes the calibration states b to theta:
//! `theta = theta^ + E b`, so S says how Z moves when the calibration that it was computed with is off by b.

use super::Corner;
use groma_estimation::Loss;
use groma_estimation::levenberg_marquardt::{self, Minimum, Options, Problem, minimize};
use groma_geometry::{LieGroup, Se3};
use groma_models::Camera;
use groma_models::camera::MAX_PARAMETERS;
use nalgebra::{DMatrix, Matrix3x6, Matrix6, SMatrix, Vector3, Vector6};
use std::convert::Infallible;

/// Corners further off than this, in standard deviations, weigh less.
const LOSS: Loss = Loss::Huber(3.0);
/// Most calibration states of a camera.
const MOST: usize = 6;
const ITERATIONS: usize = 50;
/// A step that promises less than this share is the last.
const ENOUGH: f64 = 1e-9;

/// A pose and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// `Z = T_C_B`.
    pub pose: Se3,
    /// Covariance of d from the noise of the corners.
    pub covariance: Matrix6<f64>,
    /// S, 6 x m.
    pub sensitivity: DMatrix<f64>,
    /// Robust cost, and as a sum of squares a chi-square with `2 corners - 6` degrees of freedom.
    pub cost: f64,
    /// Number of corners.
    pub corners: usize,
}

/// The normal equations of a view at a pose: `1/2 d^T A d + d^T C b + 1/2 b^T D b + g^T d + q^T b`.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// A.
    pub pose: Matrix6<f64>,
    /// C, its first m columns.
    pub coupling: Matrix6<f64>,
    /// D, its first m rows and columns.
    pub calibration: Matrix6<f64>,
    /// g.
    pub gradient: Vector6<f64>,
    /// q, its first m.
    pub calibration_gradient: Vector6<f64>,
    /// Robust cost.
    pub cost: f64,
    /// Sum of squares.
    pub chi_square: f64,
}

/// E with rows and columns of zeros behind its own; nothing for no calibration state.
fn padded(basis: &DMatrix<f64>) -> Option<SMatrix<f64, MAX_PARAMETERS, MOST>> {
    let (rows, columns) = (basis.nrows().min(MAX_PARAMETERS), basis.ncols().min(MOST));
    let mut padded = SMatrix::<f64, MAX_PARAMETERS, MOST>::zeros();
    padded.view_mut((0, 0), (rows, columns)).copy_from(&basis.view((0, 0), (rows, columns)));
    (columns > 0).then_some(padded)
}

/// The normal equations at a pose; nothing when the camera cannot see a corner from there.
#[must_use]
pub fn normal(camera: &Camera, basis: &DMatrix<f64>, corners: &[Corner], pose: &Se3) -> Option<Normal> {
    let basis = padded(basis);
    let mut sum = Normal {
        pose: Matrix6::zeros(),
        coupling: Matrix6::zeros(),
        calibration: Matrix6::zeros(),
        gradient: Vector6::zeros(),
        calibration_gradient: Vector6::zeros(),
        cost: 0.0,
        chi_square: 0.0,
    };
    for corner in corners {
        let seen = camera.project_with_jacobians(&pose.act(&corner.point))?;
        let residual = (seen.pixel - corner.pixel) / corner.sigma;
        let j = seen.by_point * by_twist(pose, &corner.point) / corner.sigma;
        let square = residual.norm_squared();
        let weight = LOSS.weight(square);
        sum.pose += j.transpose() * j * weight;
        sum.gradient += j.transpose() * residual * weight;
        sum.cost += LOSS.rho(square);
        sum.chi_square += square;
        if let Some(basis) = &basis {
            let j_b = seen.by_parameters * basis / corner.sigma;
            sum.coupling += j.transpose() * j_b * weight;
            sum.calibration += j_b.transpose() * j_b * weight;
            sum.calibration_gradient += j_b.transpose() * residual * weight;
        }
    }
    sum.cost.is_finite().then_some(sum)
}

/// `dp_C/dd = R [I, -[p]_x]` of a point p on the target.
#[must_use]
pub fn by_twist(pose: &Se3, point: &Vector3<f64>) -> Matrix3x6<f64> {
    let r = pose.rotation.matrix();
    let mut derivative = Matrix3x6::zeros();
    derivative.fixed_view_mut::<3, 3>(0, 0).copy_from(&r);
    derivative.fixed_view_mut::<3, 3>(0, 3).copy_from(&(-r * point.cross_matrix()));
    derivative
}

/// The best pose near `start`; nothing when it is not determined or not reached.
#[must_use]
pub fn fit(camera: &Camera, basis: &DMatrix<f64>, corners: &[Corner], start: &Se3) -> Option<Fit> {
    let none = DMatrix::zeros(basis.nrows(), 0);
    let mut problem = PoseFit { camera, corners, none, trial: None, at: levenberg_marquardt::Normal::zeros() };
    let options = Options { max_iterations: ITERATIONS, tolerance: ENOUGH };
    let Ok(end) = minimize(&mut problem, *start, &options);
    let Minimum { state: pose, .. } = end?;
    let at = normal(camera, basis, corners, &pose)?;
    let covariance = at.pose.cholesky()?.inverse();
    let sensitivity = covariance * at.coupling;
    let sensitivity = DMatrix::from_fn(6, basis.ncols(), |i, j| sensitivity[(i, j)]);
    Some(Fit { pose, covariance, sensitivity, cost: at.cost, corners: corners.len() })
}

/// The pose as a problem of six unknowns: its normal equations come with its cost.
struct PoseFit<'a> {
    camera: &'a Camera,
    corners: &'a [Corner],
    /// No calibration state.
    none: DMatrix<f64>,
    trial: Option<Normal>,
    at: levenberg_marquardt::Normal<6>,
}

impl Problem for PoseFit<'_> {
    type State = Se3;
    type Step = Vector6<f64>;
    type Error = Infallible;

    fn cost(&mut self, pose: &Se3) -> Result<Option<f64>, Infallible> {
        self.trial = normal(self.camera, &self.none, self.corners, pose);
        Ok(self.trial.as_ref().map(|normal| normal.cost))
    }

    fn linearize(&mut self, _: &Se3) -> Result<(), Infallible> {
        if let Some(Normal { pose, gradient, .. }) = self.trial.take() {
            self.at = levenberg_marquardt::Normal { information: pose, gradient };
        }
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Vector6<f64>, f64)>, Infallible> {
        Ok(self.at.step(damping))
    }

    fn moved(&self, pose: &Se3, step: &Vector6<f64>) -> Option<Se3> {
        Some(pose.plus(step))
    }
}

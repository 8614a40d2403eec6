//! What an error of the parameters does to pixels: the unit in which a calibration is good or bad.
//!
//! Parameters trade against each other, and a camera whose pose is estimated too absorbs any rotation. So the derivative
//! of the pixel q of a fixed direction, `dq/db`, is freed of the best common rotation over a grid of the image: with
//! `G = dq/dr` the derivative in a rotation,
//!
//! ```text
//! P = dq/db - G (sum G^T G)^-1 sum G^T dq/db,    Var(q) = P Cov(b) P^T
//! ```
//!
//! For points far away; close by, a shift of the camera is absorbed as well. Source: mrcal, "projection uncertainty".

use groma_models::Camera;
use groma_models::camera::ParameterJacobian;
use nalgebra::{DMatrix, DVector, Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2};

/// Pixels along the longer side of the grid.
const ALONG: u32 = 20;

/// The pixels of a grid over the image and how each moves with the parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct ProjectionMap {
    /// Columns and rows of the grid.
    pub shape: (usize, usize),
    /// Pixels, row by row.
    pub pixels: Vec<Vector2<f64>>,
    /// P of each pixel; nothing where the lens model does not reach.
    pub by_parameters: Vec<Option<ParameterJacobian>>,
}

impl ProjectionMap {
    /// The map of a camera.
    #[must_use]
    pub fn new(camera: &Camera) -> Self {
        let (shape, pixels) = grid(camera);
        let plain: Vec<_> = pixels.iter().map(|pixel| derivatives(camera, pixel)).collect();
        let (mut normal, mut right) = (Matrix3::zeros(), SMatrix::<f64, 3, 12>::zeros());
        for (by_rotation, by_parameters) in plain.iter().flatten() {
            normal += by_rotation.transpose() * by_rotation;
            right += by_rotation.transpose() * by_parameters;
        }
        let absorbed = normal.try_inverse().map_or_else(SMatrix::zeros, |inverse| inverse * right);
        let freed = |both: Option<(Matrix2x3<f64>, ParameterJacobian)>| both.map(|(g, b)| b - g * absorbed);
        Self { shape, pixels, by_parameters: plain.into_iter().map(freed).collect() }
    }

    /// The standard deviation of each pixel in its worst direction [pixel]; NaN where the lens model does not reach.
    #[must_use]
    pub fn sigmas(&self, covariance: &DMatrix<f64>) -> Vec<f64> {
        let n = covariance.nrows();
        let worst = |by: &Option<ParameterJacobian>| {
            by.as_ref().map_or(f64::NAN, |by| {
                let by = by.columns(0, n);
                let spread: Matrix2<f64> = (by * covariance * by.transpose()).fixed_view::<2, 2>(0, 0).into_owned();
                spread.symmetric_eigenvalues().max().max(0.0).sqrt()
            })
        };
        self.by_parameters.iter().map(worst).collect()
    }

    /// The root mean square by which pixels move when the parameters change [pixel].
    #[must_use]
    pub fn rms_shift(&self, change: &DVector<f64>) -> f64 {
        let seen: Vec<f64> = self
            .by_parameters
            .iter()
            .flatten()
            .map(|by| (by.columns(0, change.len()) * change).norm_squared())
            .collect();
        (seen.iter().sum::<f64>() / seen.len().max(1) as f64).sqrt()
    }
}

/// Shape and pixels of a grid of nearly square cells over the image, their middles.
fn grid(camera: &Camera) -> ((usize, usize), Vec<Vector2<f64>>) {
    let (width, height) = (f64::from(camera.width()), f64::from(camera.height()));
    let cell = width.max(height) / f64::from(ALONG);
    let (columns, rows) = ((width / cell).round().max(1.0), (height / cell).round().max(1.0));
    let at = |k: usize, count: f64, size: f64| (k as f64 + 0.5) * size / count - 0.5;
    let shape = (columns as usize, rows as usize);
    let pixel = |k: usize| Vector2::new(at(k % shape.0, columns, width), at(k / shape.0, rows, height));
    (shape, (0..shape.0 * shape.1).map(pixel).collect())
}

/// Derivatives of the image of the direction that a pixel sees: in a rotation and in the parameters.
fn derivatives(camera: &Camera, pixel: &Vector2<f64>) -> Option<(Matrix2x3<f64>, ParameterJacobian)> {
    let direction = camera.unproject(pixel)?;
    let seen = camera.project_with_jacobians(&direction)?;
    Some((-seen.by_point * direction.cross_matrix(), seen.by_parameters))
}

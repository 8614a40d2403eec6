//! A camera: from points in its frame to pixels and back, with Jacobians.
//!
//! Frame: z along the optical axis, x to the right of the image, y down (ROS "optical" frame). The centre of the upper
//! left pixel is (0, 0), so the image covers `-0.5 .. width - 0.5`. With the point p, the lens' distorted direction
//! `m(p, k)` (see [`Lens`]) and no skew:
//!
//! ```text
//! u = fx m_x + cx,   v = fy m_y + cy,   theta = (fx, fy, cx, cy, k_1, k_2, ...)
//! ```
//!
//! A lens model is a polynomial and turns back at some radius. Beyond that limit, which is found once when the camera is
//! made, points have no image: they would fold back into it. Source: OpenCV 4.x, calib3d and fisheye documentation.

mod brown;
mod distortion;
mod equidistant;
mod lens;

pub use lens::Lens;

use crate::bounds::{FOCAL, IMAGE_SIDE, LENS, PIXEL};
use crate::error::ModelError;
use nalgebra::{Matrix2, Matrix2x3, SMatrix, Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// The most parameters that a camera has.
pub const MAX_PARAMETERS: usize = 12;

/// Derivative of a pixel in the parameters; columns beyond [`Camera::count`] are zero.
pub type ParameterJacobian = SMatrix<f64, 2, MAX_PARAMETERS>;

/// A camera in plain numbers, not yet checked.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// Columns of the image.
    pub width: u32,
    /// Rows of the image.
    pub height: u32,
    /// The lens model.
    pub lens: Lens,
    /// fx, fy, cx, cy [pixel], then those of the lens.
    pub parameters: Vec<f64>,
}

/// A camera whose numbers make sense.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(try_from = "CameraSpec", into = "CameraSpec")]
pub struct Camera {
    spec: CameraSpec,
    coefficients: distortion::Coefficients,
    limit: f64,
}

/// The image of a point and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// The pixel (u, v).
    pub pixel: Vector2<f64>,
    /// Derivative in the point.
    pub by_point: Matrix2x3<f64>,
    /// Derivative in the parameters.
    pub by_parameters: ParameterJacobian,
}

impl Camera {
    /// A camera.
    ///
    /// # Errors
    /// [`ModelError`] when a number is not finite, a focal length or the image is not positive, or there are too few or
    /// too many parameters.
    pub fn new(width: u32, height: u32, lens: Lens, parameters: Vec<f64>) -> Result<Self, ModelError> {
        CameraSpec { width, height, lens, parameters }.try_into()
    }

    /// A camera without distortion, of one focal length [pixel], whose axis goes through the middle of the image.
    ///
    /// # Errors
    /// As [`Camera::new`].
    pub fn centred(width: u32, height: u32, lens: Lens, focal: f64) -> Result<Self, ModelError> {
        let mut parameters = vec![0.0; lens.names().len()];
        let (cx, cy) = (0.5 * (f64::from(width) - 1.0), 0.5 * (f64::from(height) - 1.0));
        parameters[..4].copy_from_slice(&[focal, focal, cx, cy]);
        Self::new(width, height, lens, parameters)
    }

    /// The same image and lens with other parameters.
    ///
    /// # Errors
    /// As [`Camera::new`].
    pub fn with_parameters(&self, parameters: Vec<f64>) -> Result<Self, ModelError> {
        Self::new(self.spec.width, self.spec.height, self.spec.lens, parameters)
    }

    /// Columns of the image.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.spec.width
    }

    /// Rows of the image.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.spec.height
    }

    /// The lens model.
    #[must_use]
    pub fn lens(&self) -> Lens {
        self.spec.lens
    }

    /// fx, fy, cx, cy [pixel], then those of the lens.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.spec.parameters
    }

    /// Number of parameters.
    #[must_use]
    pub fn count(&self) -> usize {
        self.spec.parameters.len()
    }

    /// Whether a pixel lies in the image.
    #[must_use]
    pub fn holds(&self, pixel: &Vector2<f64>) -> bool {
        let inside = |x: f64, size: u32| x >= -0.5 && x <= f64::from(size) - 0.5;
        inside(pixel.x, self.spec.width) && inside(pixel.y, self.spec.height)
    }

    /// The pixel of a point in the frame of the camera, be it in the image or beside it; nothing for a point that the
    /// lens does not see.
    #[must_use]
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.project_with_jacobians(point).map(|p| p.pixel)
    }

    /// The same with derivatives.
    #[must_use]
    pub fn project_with_jacobians(&self, point: &Vector3<f64>) -> Option<Projection> {
        let seen = self.spec.lens.distort(&self.coefficients, self.limit, point)?;
        let (focal, centre) = (self.focal(), self.centre());
        let scale = Matrix2::from_diagonal(&focal);
        let mut by_parameters = ParameterJacobian::zeros();
        by_parameters.fixed_view_mut::<2, 2>(0, 0).copy_from(&Matrix2::from_diagonal(&seen.direction));
        by_parameters.fixed_view_mut::<2, 2>(0, 2).copy_from(&Matrix2::identity());
        by_parameters.fixed_view_mut::<2, 8>(0, 4).copy_from(&(scale * seen.by_coefficients));
        for mut column in by_parameters.column_iter_mut().skip(self.count()) {
            column.fill(0.0);
        }
        let pixel = focal.component_mul(&seen.direction) + centre;
        Some(Projection { pixel, by_point: scale * seen.by_point, by_parameters })
    }

    /// The direction of length 1 that a pixel sees; nothing where the lens model does not reach.
    #[must_use]
    pub fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let direction = (pixel - self.centre()).component_div(&self.focal());
        self.spec.lens.undistort(&self.coefficients, self.limit, &direction)
    }

    fn focal(&self) -> Vector2<f64> {
        Vector2::new(self.spec.parameters[0], self.spec.parameters[1])
    }

    fn centre(&self) -> Vector2<f64> {
        Vector2::new(self.spec.parameters[2], self.spec.parameters[3])
    }
}

impl TryFrom<CameraSpec> for Camera {
    type Error = ModelError;

    fn try_from(spec: CameraSpec) -> Result<Self, ModelError> {
        let names = spec.lens.names();
        if spec.parameters.len() != names.len() {
            let (lens, expected, got) = (spec.lens.name(), names.len(), spec.parameters.len());
            return Err(ModelError::Parameters { lens, expected, names: names.join(", "), got });
        }
        for (name, size) in [("width", spec.width), ("height", spec.height)] {
            IMAGE_SIDE.check(name, f64::from(size))?;
        }
        for (k, (&name, &value)) in names.iter().zip(&spec.parameters).enumerate() {
            [FOCAL, FOCAL, PIXEL, PIXEL].get(k).unwrap_or(&LENS).check(name, value)?;
        }
        let coefficients = spec.lens.coefficients(&spec.parameters[4..]);
        let limit = spec.lens.limit(&coefficients);
        Ok(Self { spec, coefficients, limit })
    }
}

impl From<Camera> for CameraSpec {
    fn from(camera: Camera) -> Self {
        camera.spec
    }
}

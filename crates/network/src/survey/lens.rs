//! What is uncertain about a lens: the leading principal components of its covariance.
//!
//! Parameters have units that cannot be compared; their effect on pixels can. With D the root mean square effect of each
//! parameter over the image (grid of pixels), the components of `D Cov D` are ranked by how much they move pixels, and
//! `E = D^-1 V sqrt(Lambda)`: `Cov = E E^T` but for the components left out.

use super::KnownCamera;
use crate::batch::Lens;
use crate::options::Options;
use groma_models::Camera;
use nalgebra::{DMatrix, DVector, Vector2};

/// Pixels along each side of the image at which the effect of a parameter is taken.
const GRID: u32 = 7;
/// Components below this share of the first are left out.
const LEAST: f64 = 1e-6;

/// The lens of a camera with as many calibration states as the settings allow.
#[must_use]
pub fn lens(known: &KnownCamera, options: &Options) -> Lens {
    let camera = known.camera.clone();
    let covariance = known.covariance.clone().unwrap_or_else(|| focal_only(&camera, options.focal));
    Lens { basis: basis(&camera, &covariance, options.calibration_states), camera }
}

/// The focal lengths are off by a common factor.
fn focal_only(camera: &Camera, relative: f64) -> DMatrix<f64> {
    let mut direction = DVector::zeros(camera.count());
    for k in 0..2 {
        direction[k] = camera.parameters()[k] * relative;
    }
    &direction * direction.transpose()
}

fn basis(camera: &Camera, covariance: &DMatrix<f64>, most: usize) -> DMatrix<f64> {
    let effect = effects(camera);
    let weighted = DMatrix::from_fn(covariance.nrows(), covariance.ncols(), |i, j| {
        effect[i] * (covariance[(i, j)] + covariance[(j, i)]) / 2.0 * effect[j]
    });
    let eigen = weighted.symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let first = order.first().map_or(0.0, |&k| eigen.eigenvalues[k]);
    order.retain(|&k| eigen.eigenvalues[k] > LEAST * first && eigen.eigenvalues[k] > 0.0);
    order.truncate(most);
    DMatrix::from_fn(covariance.nrows(), order.len(), |i, c| {
        eigen.eigenvectors[(i, order[c])] * eigen.eigenvalues[order[c]].sqrt() / effect[i]
    })
}

/// Root mean square motion of a pixel of the image for a unit of each parameter.
fn effects(camera: &Camera) -> DVector<f64> {
    let mut sums = DVector::zeros(camera.count());
    let mut seen = 0.0;
    for row in 0..GRID {
        for column in 0..GRID {
            let place = |k: u32, size: u32| f64::from(size) * (f64::from(k) + 0.5) / f64::from(GRID) - 0.5;
            let pixel = Vector2::new(place(column, camera.width()), place(row, camera.height()));
            let Some(ray) = camera.unproject(&pixel) else { continue };
            let Some(image) = camera.project_with_jacobians(&ray) else { continue };
            seen += 1.0;
            for k in 0..camera.count() {
                sums[k] += image.by_parameters.column(k).norm_squared();
            }
        }
    }
    sums.map(|s: f64| (s / f64::max(seen, 1.0)).sqrt().max(1e-12))
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::Lens as Model;

    #[test]
    fn components_give_the_covariance_back() {
        let camera = Camera::centred(640, 480, Model::Radtan, 600.0).unwrap();
        let root = DMatrix::from_fn(8, 3, |i, j| ((i + 1) * (j + 2)) as f64 % 5.0 * if i < 4 { 1.0 } else { 1e-3 });
        let covariance = &root * root.transpose();
        let e = basis(&camera, &covariance, 6);
        assert_eq!(e.ncols(), 3);
        assert!((&e * e.transpose() - &covariance).amax() < 1e-9 * covariance.amax());
    }

    #[test]
    fn an_unknown_covariance_leaves_the_focal_length() {
        let camera = Camera::centred(640, 480, Model::Radtan, 600.0).unwrap();
        let known = KnownCamera { name: String::new(), camera, covariance: None };
        let e = lens(&known, &Options::default()).basis;
        assert_eq!(e.ncols(), 1);
        assert!(
            (e[(0, 0)].abs() - 3.0).abs() < 1e-9 && (e[(1, 0)] - e[(0, 0)]).abs() < 1e-9 && e[(4, 0)].abs() < 1e-12
        );
    }
}

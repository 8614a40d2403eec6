//! Views of a panel of 6 x 6 tags by a camera, with noise, drawn from a seed.

use groma_calibration::camera::{Sighting, View};
use groma_geometry::{LieGroup, Se3, So3};
use groma_models::target::TagGrid;
use groma_models::{Camera, Lens, Pattern};
use nalgebra::{Vector2, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub struct Scene {
    pub camera: Camera,
    pub noise: f64,
    random: ChaCha8Rng,
}

pub fn camera(lens: Lens) -> Camera {
    let coefficients: &[f64] = match lens {
        Lens::Pinhole => &[],
        Lens::Radtan => &[-0.25, 0.08, 0.001, -0.0005],
        Lens::PlumbBob => &[-0.25, 0.08, 0.001, -0.0005, -0.01],
        Lens::Rational => &[0.5, 0.1, 0.001, -0.0005, 0.02, 0.8, 0.2, 0.05],
        Lens::Equidistant => &[0.02, -0.01, 0.004, -0.0005],
    };
    // Both are lenses of wide cameras: in a narrow view the six radial terms of the rational one cannot be distinguished.
    let focal = if matches!(lens, Lens::Equidistant | Lens::Rational) { 300.0 } else { 600.0 };
    let parameters = [&[focal, 1.01 * focal, 325.0, 236.0], coefficients].concat();
    Camera::new(640, 480, lens, parameters).unwrap()
}

pub fn grid() -> Vec<Vector3<f64>> {
    let family = "tag36h11".to_owned();
    Pattern::TagGrid(TagGrid { family, columns: 6, rows: 6, size: 0.08, spacing: 0.25, first_id: 0, border: 2 })
        .corners()
}

impl Scene {
    pub fn new(lens: Lens, noise: f64, seed: u64) -> Self {
        Self { camera: camera(lens), noise, random: ChaCha8Rng::seed_from_u64(seed) }
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.random::<f64>()
    }

    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }

    /// A panel tilted by `tilt` about a random axis in its plane, seen where the image shows it, at a range [m].
    pub fn pose(&mut self, tilt: f64, range: f64) -> Se3 {
        let axis = self.uniform(0.0, std::f64::consts::TAU);
        let turn = So3::exp(&(Vector3::new(axis.cos(), axis.sin(), 0.0) * tilt));
        let spin = So3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0))
            * So3::exp(&Vector3::new(0.0, 0.0, self.uniform(-0.5, 0.5)));
        let pixel = Vector2::new(self.uniform(80.0, 560.0), self.uniform(60.0, 420.0));
        let middle = self.camera.unproject(&pixel).unwrap() * range;
        let rotation = turn * spin;
        Se3 { rotation, translation: middle - rotation.act(&Vector3::new(0.29, 0.29, 0.0)) }
    }

    /// The corners that fall into the image.
    pub fn view(&mut self, image: usize, pose: &Se3) -> View {
        let mut corners = vec![];
        for point in grid() {
            let noise = Vector2::new(self.normal(), self.normal()) * self.noise;
            let seen = self.camera.project(&pose.act(&point)).filter(|pixel| self.camera.holds(pixel));
            corners.extend(seen.map(|pixel| Sighting { point, pixel: pixel + noise, sigma: 0.3 }));
        }
        View { image, corners }
    }

    pub fn views(&mut self, count: usize, tilt: f64, range: f64) -> Vec<View> {
        (0..count)
            .map(|k| {
                let pose = self.pose(tilt, range);
                self.view(k, &pose)
            })
            .collect()
    }

    /// A pose moved by a twist.
    pub fn moved(pose: &Se3, twist: [f64; 6]) -> Se3 {
        pose.plus(&Vector6::from(twist))
    }
}

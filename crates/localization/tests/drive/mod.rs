//! A drive among landmarks at the level of landmarks: who is in view is drawn, what is seen has noise.
#![allow(dead_code)] // each test file uses its part

use groma_geometry::Se2;
use groma_localization::{CalibrationCovariance, DRIVE, Motion, Observation};
use groma_models::{Landmark, LandmarkKind, LandmarkMap};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub struct Draw(ChaCha8Rng);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
    pub fn vector(&mut self) -> Vector2<f64> {
        Vector2::new(self.normal(), self.normal())
    }
    /// A draw of a Gaussian with this covariance.
    pub fn of<const N: usize>(&mut self, covariance: &SMatrix<f64, N, N>) -> nalgebra::SVector<f64, N> {
        let eigen = nalgebra::DMatrix::from_fn(N, N, |i, j| covariance[(i, j)]).symmetric_eigen();
        let mut x = nalgebra::SVector::<f64, N>::zeros();
        for k in 0..N {
            let z = self.normal() * eigen.eigenvalues[k].max(0.0).sqrt();
            (0..N).for_each(|i| x[i] += eigen.eigenvectors[(i, k)] * z);
        }
        x
    }
}

/// What stands in the hall, and how well it is seen.
pub struct Hall {
    /// True places.
    pub places: Vec<(LandmarkKind, Vector2<f64>)>,
    pub sigma_map: f64,
    pub sigma_range: f64,
    pub sigma_bearing: f64,
    pub reach: f64,
    pub detected: f64,
    /// Sightings of nothing, a scan.
    pub clutter: usize,
}

impl Hall {
    /// Corners all over a hall of `edge` [m], at least `apart` from each other.
    pub fn new(seed: u64, corners: usize, reflectors: usize, edge: f64, apart: f64) -> Self {
        let mut draw = Draw::new(seed);
        let mut places: Vec<(LandmarkKind, Vector2<f64>)> = Vec::new();
        while places.len() < corners + reflectors {
            let p = Vector2::new(draw.uniform(0.0, edge), draw.uniform(0.0, edge));
            if places.iter().all(|(_, q)| (p - q).norm() > apart) {
                let kind = if places.len() < corners { LandmarkKind::Corner } else { LandmarkKind::Reflector };
                places.push((kind, p));
            }
        }
        Self {
            places,
            sigma_map: 0.005,
            sigma_range: 0.012,
            sigma_bearing: 0.002,
            reach: 12.0,
            detected: 0.8,
            clutter: 2,
        }
    }

    /// A map with errors of its own; corners may be left out.
    pub fn survey(&self, draw: &mut Draw, keep: impl Fn(LandmarkKind) -> bool) -> LandmarkMap {
        let landmark = |(kind, p): &(LandmarkKind, Vector2<f64>), draw: &mut Draw| Landmark {
            kind: *kind,
            position: p + draw.vector() * self.sigma_map,
            covariance: Matrix2::identity() * self.sigma_map.powi(2),
            orientation: None,
            descriptor: None,
            seen: 1,
            visible: 1,
        };
        let kept = self.places.iter().filter(|(kind, _)| keep(*kind));
        LandmarkMap { landmarks: kept.map(|p| landmark(p, draw)).collect() }
    }

    pub fn noise(&self) -> Matrix2<f64> {
        Matrix2::from_diagonal(&Vector2::new(self.sigma_range.powi(2), self.sigma_bearing.powi(2)))
    }

    /// What is seen from `T_map_laser` at a time; with each the number of the place it shows.
    pub fn look(&self, laser: &Se2, stamp: f64, draw: &mut Draw) -> Vec<(Option<usize>, Observation)> {
        let mut seen = Vec::new();
        for (k, (kind, p)) in self.places.iter().enumerate() {
            let q = laser.inverse().act(*p);
            if q.norm() < self.reach && draw.uniform(0.0, 1.0) < self.detected {
                seen.push((Some(k), self.sighting(*kind, Vector2::new(q.norm(), q.y.atan2(q.x)), stamp, draw)));
            }
        }
        for _ in 0..self.clutter {
            let polar = Vector2::new(draw.uniform(0.5, self.reach), draw.uniform(-3.1, 3.1));
            seen.push((None, self.sighting(LandmarkKind::Corner, polar, stamp, draw)));
        }
        seen
    }

    fn sighting(&self, kind: LandmarkKind, polar: Vector2<f64>, stamp: f64, draw: &mut Draw) -> Observation {
        let noise = Vector2::new(draw.normal() * self.sigma_range, draw.normal() * self.sigma_bearing);
        let (covariance, orientation, descriptor, identity) = (self.noise(), None, None, None);
        Observation { stamp, polar: polar + noise, covariance, kind, orientation, descriptor, identity }
    }
}

/// Wheels that say a little less or more than what was driven.
pub struct Wheels {
    /// Standard deviations after one metre of path [m], [rad]; they grow with its root.
    pub per_metre: (f64, f64, f64),
    /// Errors of scale and turn that last the whole drive, and how they are drawn.
    pub calibration: Option<CalibrationCovariance>,
    pub error: [f64; DRIVE],
}

impl Wheels {
    pub fn good() -> Self {
        Self { per_metre: (0.01, 0.005, 0.005), calibration: None, error: [0.0; DRIVE] }
    }

    /// Calibrated, with an error of calibration drawn from its covariance.
    pub fn calibrated(draw: &mut Draw) -> (Self, Se2) {
        let sigma = [2e-3, 1e-3, 0.0, 0.0, 0.0, 3e-3, 3e-3, 2e-3];
        let covariance = CalibrationCovariance::from_diagonal(&SMatrix::from_fn(|i, _| sigma[i] * sigma[i]));
        let error = draw.of(&covariance);
        let mount = Se2::exp(Vector3::new(error[5], error[6], error[7]));
        let drive = std::array::from_fn(|k| error[k]);
        (Self { calibration: Some(covariance), error: drive, ..Self::good() }, mount)
    }

    /// What the wheels report of a true step `(path, turn)`.
    ///
    /// The drive has two parameters in this hall: the scale of the path, and radians of turn per metre.
    pub fn say(&self, path: f64, turn: f64, draw: &mut Draw) -> Motion {
        let root = path.abs().sqrt();
        let s = Vector3::new(self.per_metre.0, self.per_metre.1, self.per_metre.2) * root;
        let covariance = Matrix3::from_diagonal(&s.component_mul(&s)) + Matrix3::identity() * 1e-12;
        let mut by_drive = SMatrix::<f64, 3, DRIVE>::zeros();
        by_drive[(0, 0)] = path;
        by_drive[(2, 1)] = path;
        let systematic = by_drive * SMatrix::<f64, DRIVE, 1>::from_fn(|i, _| self.error[i]);
        let noise = Vector3::new(draw.normal() * s.x, draw.normal() * s.y, draw.normal() * s.z);
        // truth = said exp(by_drive error + noise)
        let truth = Se2::exp(Vector3::new(path, 0.0, turn));
        let motion = truth * Se2::exp(systematic + noise).inverse();
        Motion { motion, covariance, by_drive }
    }
}

/// Path and turn of step `k` of a drive round the hall at `rate` steps a second: loops that do not repeat.
pub fn step(k: usize, rate: f64, speed: f64) -> (f64, f64) {
    let t = k as f64 / rate;
    (speed / rate, speed / rate * (0.16 + 0.1 * (0.21 * t).sin()))
}

pub fn nees(truth: &Se2, pose: &Se2, covariance: &Matrix3<f64>) -> f64 {
    let e = truth.minus(pose);
    covariance.try_inverse().map_or(f64::INFINITY, |inverse| e.dot(&(inverse * e)))
}

//! `groma.features`: keypoints of scans, their descriptors, signatures of local maps, association.

use crate::border::{self, In1, In2, Out};
use crate::gate;
use groma_features::association::{self, Hypothesis};
use groma_features::bsc::Bsc;
use groma_features::cgh::Cgh;
use groma_features::reflector::{self, Reflector};
use groma_features::{Keypoint, Surroundings, falko, glarot, oc, rigid_fit};
use groma_models::{BeamGeometry, LaserScan};
use nalgebra::{Matrix2, Matrix3, Vector2};
use numpy::ndarray::{Array2, Array3, ArrayView1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::{Mutex, PoisonError};

type Floats = border::Array1<f64>;
type Indices = border::Array1<i64>;

/// angle_min, angle_increment, range_min, range_max.
type Beams = (f64, f64, f64, f64);

/// The K keypoints of one scan, in beam order, in the laser frame.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct Keypoints {
    /// (K,) beam that hit the corner.
    index: border::Array1<i64>,
    /// (K, 2) position [m].
    point: border::Array2<f64>,
    /// (K,) direction into which the corner opens, in (-pi, pi] [rad].
    orientation: border::Array1<f64>,
    /// (K,) radius of the neighbourhood in which the corner was judged [m].
    radius: border::Array1<f64>,
    /// (K, 2, 2) covariance of the position [m^2].
    covariance: border::Array3<f64>,
    count: usize,
}

#[pymethods]
impl Keypoints {
    fn __len__(&self) -> usize {
        self.count
    }
}

impl Keypoints {
    fn of(py: Python<'_>, all: &[Keypoint]) -> Self {
        Self {
            index: border::column(py, all.iter().map(|k| k.index as i64)),
            point: Array2::from_shape_fn((all.len(), 2), |(k, c)| all[k].point[c]).out(py),
            orientation: border::column(py, all.iter().map(|k| k.orientation)),
            radius: border::column(py, all.iter().map(|k| k.radius)),
            covariance: Array3::from_shape_fn((all.len(), 2, 2), |(k, i, j)| all[k].covariance[(i, j)]).out(py),
            count: all.len(),
        }
    }
}

/// A detector with its options.
#[derive(Clone, Copy)]
enum Kind {
    Falko(falko::Options),
    Oc(oc::Options),
}

/// The tables of a detector for scans of some number of beams.
enum Tables {
    Falko(falko::Detector),
    Oc(oc::Detector),
}

/// Finds the corners of the scans of one scanner; keeps its tables from one scan to the next.
#[pyclass(frozen, module = "groma._core")]
pub(crate) struct CornerDetector {
    kind: Kind,
    geometry: BeamGeometry,
    /// Beams of the last scan, and the tables for them.
    kept: Mutex<Option<(usize, Tables)>>,
}

#[pymethods]
impl CornerDetector {
    /// `name` is `falko` or `oc`, `beams` `(angle_min, angle_increment, range_min, range_max)`, `options` JSON.
    #[new]
    fn new(name: &str, beams: Beams, options: &str) -> PyResult<Self> {
        let kind = match name {
            "falko" => {
                let options: falko::Options = parse(options)?;
                options.validate().map_err(invalid)?;
                Kind::Falko(options)
            }
            "oc" => {
                let options: oc::Options = parse(options)?;
                options.validate().map_err(invalid)?;
                Kind::Oc(options)
            }
            _ => return Err(invalid(format!("detector {name}: it is falko or oc"))),
        };
        Ok(Self { kind, geometry: geometry(beams)?, kept: Mutex::new(None) })
    }

    /// The corners of a scan.
    fn detect(&self, py: Python<'_>, ranges: In1<'_, f64>) -> PyResult<Keypoints> {
        let (ranges, mut found) = (ranges.as_slice()?, Vec::new());
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let (_, tables) = match kept.take() {
            Some((beams, tables)) if beams == ranges.len() => kept.insert((beams, tables)),
            _ => kept.insert((ranges.len(), self.tables(ranges.len()))),
        };
        match tables {
            Tables::Falko(detector) => detector.detect(ranges, &mut found),
            Tables::Oc(detector) => detector.detect(ranges, &mut found),
        }
        Ok(Keypoints::of(py, &found))
    }

    /// The corners of many scans, over all processors, with the GIL released.
    fn detect_all(&self, py: Python<'_>, scans: Vec<In1<'_, f64>>) -> PyResult<Vec<Keypoints>> {
        let scans = scans.iter().map(|scan| Ok(scan.as_slice()?)).collect::<PyResult<Vec<_>>>()?;
        let found = py.detach(|| match self.kind {
            Kind::Falko(options) => falko::detect_all(self.geometry, &scans, options),
            Kind::Oc(options) => oc::detect_all(self.geometry, &scans, options),
        });
        Ok(found.iter().map(|all| Keypoints::of(py, all)).collect())
    }
}

impl CornerDetector {
    fn tables(&self, beams: usize) -> Tables {
        match self.kind {
            Kind::Falko(options) => Tables::Falko(falko::Detector::new(self.geometry, beams, options)),
            Kind::Oc(options) => Tables::Oc(oc::Detector::new(self.geometry, beams, options)),
        }
    }
}

/// Reflectors of scans laid end to end, `counts` beams each: how many a scan, beam indices, and rows of x, y, covariance
/// (4), probability of a post, width, contrast.
#[pyfunction]
pub(crate) fn reflector_detect<'py>(
    py: Python<'py>,
    ranges: In1<'py, f64>,
    intensities: In1<'py, f64>,
    counts: Vec<usize>,
    beams: Beams,
    options: &str,
) -> PyResult<(Indices, Indices, Floats)> {
    let options: reflector::Options = parse(options)?;
    options.validate().map_err(invalid)?;
    let ranges = split(ranges.as_slice()?, &counts)?;
    let intensities = split(intensities.as_slice()?, &counts)?;
    let scans: Vec<(&[f64], &[f64])> = ranges.into_iter().zip(intensities).collect();
    let geometry = geometry(beams)?;
    let found = py.detach(|| reflector::detect_all(&geometry, &scans, &options));
    let all = || found.iter().flatten();
    let row = |r: &Reflector| {
        let c = &r.covariance;
        [r.point.x, r.point.y, c.m11, c.m12, c.m21, c.m22, r.post, r.width, r.contrast]
    };
    Ok((
        border::column(py, found.iter().map(|scan| scan.len() as i64)),
        border::column(py, all().map(|r| r.index as i64)),
        border::column(py, all().flat_map(row)),
    ))
}

/// BSC descriptors of the keypoints of a scan, 16 bytes each; `poses` is x, y, orientation, radius a keypoint.
#[pyfunction]
pub(crate) fn bsc_describe<'py>(
    py: Python<'py>,
    ranges: In1<'py, f64>,
    beams: Beams,
    indices: In1<'py, i64>,
    poses: In2<'py, f64>,
) -> PyResult<border::Array1<u8>> {
    let around = surroundings(&ranges, beams, &indices, &poses)?;
    Ok(border::column(py, around.iter().flat_map(|a| Bsc::of(a).to_bytes())))
}

/// CGH descriptors of the keypoints of a scan, 16 shares each.
#[pyfunction]
pub(crate) fn cgh_describe<'py>(
    py: Python<'py>,
    ranges: In1<'py, f64>,
    beams: Beams,
    indices: In1<'py, i64>,
    poses: In2<'py, f64>,
) -> PyResult<border::Array1<f32>> {
    let around = surroundings(&ranges, beams, &indices, &poses)?;
    Ok(border::column(py, around.iter().flat_map(|a| *Cgh::of(a).shares())))
}

/// The signature of a set of landmarks.
#[pyclass(frozen, module = "groma._core")]
pub(crate) struct GlarotSignature(glarot::Signature);

#[pymethods]
impl GlarotSignature {
    #[new]
    fn new(py: Python<'_>, points: In2<'_, f64>, options: &str) -> PyResult<Self> {
        let options: glarot::Options = parse(options)?;
        options.validate().map_err(invalid)?;
        let points = to_points(&points);
        Ok(Self(py.detach(|| glarot::Signature::from_points(&points, &options))))
    }

    /// Distance 0 to 1, and the rotation that takes the points of self onto those of other, modulo pi.
    fn distance(&self, other: &Self) -> (f64, f64) {
        let difference = self.0.difference(&other.0);
        (difference.distance, difference.rotation)
    }

    /// Distance 0 to 1 without turning either.
    fn distance_unturned(&self, other: &Self) -> f64 {
        self.0.distance_unturned(&other.0)
    }
}

/// Signatures, searched exactly.
#[pyclass(module = "groma._core")]
pub(crate) struct GlarotIndex(glarot::Index);

#[pymethods]
impl GlarotIndex {
    #[new]
    fn new() -> Self {
        Self(glarot::Index::new())
    }

    fn add(&mut self, signature: &GlarotSignature) -> usize {
        self.0.add(&signature.0)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    /// `(index, distance, rotation)` of the `k` nearest, of those allowed where a mask is given.
    fn query(
        &self,
        py: Python<'_>,
        signature: &GlarotSignature,
        k: usize,
        allowed: Option<In1<'_, bool>>,
    ) -> PyResult<Vec<(usize, f64, f64)>> {
        let allowed = allowed.as_ref().map(|a| a.as_slice()).transpose()?;
        let filter = |i: usize| allowed.is_none_or(|a| a.get(i).copied().unwrap_or(false));
        let found = py.detach(|| self.0.query(&signature.0, k, filter));
        Ok(found.into_iter().map(|c| (c.index, c.distance, c.rotation)).collect())
    }
}

/// A motion: x, y, theta; its pairs; the covariance by rows; root mean square distance.
type Motion = ([f64; 3], Vec<(usize, usize)>, Vec<f64>, f64);

/// The motions between two sets of landmarks, and whether the search ran to its end; `compatible` is a mask over
/// (of a, of b), `method` and `options` are JSON.
#[pyfunction]
pub(crate) fn associate(
    py: Python<'_>,
    a: In2<'_, f64>,
    b: In2<'_, f64>,
    compatible: Option<In2<'_, bool>>,
    method: &str,
    options: &str,
) -> PyResult<(Vec<Motion>, bool)> {
    let method: association::Method = parse(method)?;
    let options: association::Options = parse(options)?;
    options.validate().map_err(invalid)?;
    let (a, b) = (to_points(&a), to_points(&b));
    let mask = compatible.as_ref().map(|c| c.as_array());
    let allowed = |i: usize, j: usize| mask.is_none_or(|m| m.get((i, j)).copied().unwrap_or(false));
    let found = py.detach(|| association::associate_by(&method, &a, &b, &options, allowed));
    Ok((found.hypotheses.into_iter().map(motion).collect(), found.complete))
}

/// The rigid motion between paired points: x, y, theta; covariance by rows; root mean square distance.
#[pyfunction]
#[pyo3(name = "rigid_fit")]
pub(crate) fn fit_rigid(a: In2<'_, f64>, b: In2<'_, f64>, least_sigma: f64) -> Option<([f64; 3], Vec<f64>, f64)> {
    let pairs: Vec<_> = to_points(&a).into_iter().zip(to_points(&b)).collect();
    let fit = rigid_fit(&pairs, least_sigma)?;
    Some((fit.transform.to_vector().into(), rows(&fit.covariance), fit.rms))
}

/// The default options of `falko`, `glarot` and `association` as JSON.
#[pyfunction]
pub(crate) fn feature_defaults() -> PyResult<[String; 3]> {
    let falko = serde_json::to_string(&falko::Options::default()).map_err(invalid)?;
    let glarot = serde_json::to_string(&glarot::Options::default()).map_err(invalid)?;
    let association = serde_json::to_string(&association::Options::default()).map_err(invalid)?;
    Ok([falko, glarot, association])
}

fn parse<T: serde::de::DeserializeOwned>(json: &str) -> PyResult<T> {
    serde_json::from_str(json).map_err(invalid)
}

fn invalid(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn geometry((angle_min, angle_increment, range_min, range_max): Beams) -> PyResult<BeamGeometry> {
    gate::geometry((angle_min, angle_increment, 0.0, range_min, range_max))
}

fn split<'a>(mut values: &'a [f64], counts: &[usize]) -> PyResult<Vec<&'a [f64]>> {
    let mut scans = Vec::with_capacity(counts.len());
    for &count in counts {
        let Some((scan, rest)) = values.split_at_checked(count) else {
            return Err(invalid("the counts of the scans exceed the ranges given"));
        };
        scans.push(scan);
        values = rest;
    }
    Ok(scans)
}

fn to_points(rows: &In2<'_, f64>) -> Vec<Vector2<f64>> {
    rows.as_array().outer_iter().map(|p| Vector2::new(p[0], p[1])).collect()
}

fn rows(matrix: &Matrix3<f64>) -> Vec<f64> {
    matrix.transpose().iter().copied().collect()
}

fn motion(found: Hypothesis) -> Motion {
    (found.transform.to_vector().into(), found.pairs, rows(&found.covariance), found.rms)
}

/// What is around every keypoint: the points of the scan but its own.
fn surroundings(
    ranges: &In1<'_, f64>,
    beams: Beams,
    indices: &In1<'_, i64>,
    poses: &In2<'_, f64>,
) -> PyResult<Vec<Surroundings>> {
    let ranges = ranges.as_slice()?.to_vec();
    let scan = LaserScan { stamp: 0.0, geometry: geometry(beams)?, ranges, intensities: Vec::new() };
    let hits: Vec<(usize, Vector2<f64>)> = scan.hits().collect();
    let around = |(pose, &index): (ArrayView1<'_, f64>, &i64)| {
        let (point, covariance) = (Vector2::new(pose[0], pose[1]), Matrix2::zeros());
        let keypoint = Keypoint { index: index as usize, point, orientation: pose[2], radius: pose[3], covariance };
        let others = hits.iter().filter(|(i, _)| *i != keypoint.index).map(|(_, p)| *p);
        Surroundings::of(others, &keypoint, keypoint.radius)
    };
    Ok(poses.as_array().outer_iter().zip(&indices.as_array()).map(around).collect())
}

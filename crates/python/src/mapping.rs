//! `groma.mapping`: scans and odometry pushed in order of time, a map as arrays.

use crate::gate::{self, Beams};
use groma_geometry::Se2;
use groma_mapping::closure::Verdict;
use groma_mapping::map_result::{EdgeKind, MapResult};
use groma_mapping::mapper::{Mapper as Core, Skipped};
use groma_mapping::options::Options;
use groma_mapping::weak::Reason;
use groma_models::{Cell, Grid, LandmarkMap, LaserScan, Odometry};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(map_defaults, m)?)?;
    m.add_class::<Mapper>()
}

/// The settings of mapping and their defaults.
#[pyfunction]
fn map_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    json(py, &Options::default())
}

/// A value as Python has it after JSON.
pub(crate) fn json<'py>(py: Python<'py>, value: &impl serde::Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

/// Builds a map; `finish` may be called once.
#[pyclass]
struct Mapper(Option<Core>);

#[pymethods]
impl Mapper {
    #[new]
    fn new(options: &str) -> PyResult<Self> {
        Ok(Self(Some(Core::new(settings(options)?))))
    }

    /// False when the stamp does not rise or the pose is not finite.
    fn push_odometry(&mut self, py: Python<'_>, stamp: f64, x: f64, y: f64, theta: f64) -> PyResult<bool> {
        let reading = Odometry { stamp, pose: Se2::new(x, y, theta) };
        let core = self.core()?;
        Ok(py.detach(|| core.push_odometry(reading)))
    }

    /// Empty when the scan was used, else why not. `beams` is `(angle_min, angle_increment, time_increment, range_min,
    /// range_max)`, `mount` the pose `(x, y, yaw)` of the laser on the vehicle; intensities as many as ranges, or none.
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: PyReadonlyArray1<'_, f64>,
        intensities: PyReadonlyArray1<'_, f64>,
        beams: Beams,
        mount: (f64, f64, f64),
    ) -> PyResult<&'static str> {
        let scan = laser_scan(stamp, &ranges, &intensities, beams)?;
        let mount = gate::pose(mount)?;
        let core = self.core()?;
        Ok(match py.detach(|| core.push_scan(scan, mount)) {
            Ok(()) => "",
            Err(Skipped::Late) => "stamp not after that of the scan before",
            Err(Skipped::Empty) => "fewer than ten hits",
        })
    }

    /// Keyframes, local maps and accepted closures so far.
    fn progress(&mut self) -> PyResult<(usize, usize, usize)> {
        Ok(self.core()?.progress())
    }

    /// The map as a dict of arrays.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core = self.0.take().ok_or_else(finished)?;
        let result = py.detach(|| core.finish()).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        to_dict(py, result)
    }
}

impl Mapper {
    fn core(&mut self) -> PyResult<&mut Core> {
        self.0.as_mut().ok_or_else(finished)
    }
}

pub(crate) fn laser_scan(
    stamp: f64,
    ranges: &PyReadonlyArray1<'_, f64>,
    intensities: &PyReadonlyArray1<'_, f64>,
    beams: Beams,
) -> PyResult<LaserScan> {
    let scan = gate::scan(stamp, ranges, beams)?;
    Ok(LaserScan { intensities: intensities.as_array().to_vec(), ..scan })
}

pub(crate) fn settings(options: &str) -> PyResult<Options> {
    let options: Options = serde_json::from_str(options).map_err(|e| PyValueError::new_err(e.to_string()))?;
    options.corners.validate().map_err(|e| PyValueError::new_err(e.to_string()))?;
    options.reflectors.validate().map_err(|e| PyValueError::new_err(e.to_string()))?;
    if !(options.resolution > 0.0 && options.resolution <= 1.0) {
        return Err(PyValueError::new_err("resolution: a cell is above 0 m and at most 1 m wide"));
    }
    Ok(options)
}

fn finished() -> PyErr {
    PyValueError::new_err("this map is finished")
}

fn poses<'a>(items: impl ExactSizeIterator<Item = &'a Se2>) -> Array2<f64> {
    let n = items.len();
    let flat: Vec<f64> = items.flat_map(|p| [p.x(), p.y(), p.theta()]).collect();
    Array2::from_shape_vec((n, 3), flat).unwrap_or_default()
}

pub(crate) fn matrices<const R: usize>(items: &[nalgebra::SMatrix<f64, R, R>]) -> Array3<f64> {
    Array3::from_shape_fn((items.len(), R, R), |(k, i, j)| items[k][(i, j)])
}

fn to_dict(py: Python<'_>, r: MapResult) -> PyResult<Bound<'_, PyDict>> {
    let out = PyDict::new(py);
    graph(py, &out, &r)?;
    let stamps: Array1<f64> = r.trajectory.iter().map(|(t, _)| *t).collect();
    out.set_item("trajectory_stamps", stamps.into_pyarray(py))?;
    let path: Vec<Se2> = r.trajectory.iter().map(|(_, p)| *p).collect();
    out.set_item("trajectory", poses(path.iter()).into_pyarray(py))?;
    out.set_item("odometry", poses(r.odometry.iter()).into_pyarray(py))?;
    out.set_item("tracked", poses(r.tracked.iter()).into_pyarray(py))?;
    closures(py, &out, &r)?;
    landmarks(py, &out, &r.landmarks)?;
    grid(py, &out, &r.grid)?;
    weak(&out, &r)?;
    out.set_item("local_maps", r.local_maps)?;
    out.set_item("undecided", r.undecided)?;
    out.set_item("unaided", r.unaided)?;
    let (offset, sigmas) = r.offset;
    out.set_item("offset", (offset.x(), offset.y(), offset.theta()))?;
    out.set_item("offset_sigmas", (sigmas.x, sigmas.y, sigmas.z))?;
    Ok(out)
}

fn graph(py: Python<'_>, out: &Bound<'_, PyDict>, r: &MapResult) -> PyResult<()> {
    let edges = &r.graph.edges;
    let kinds: Vec<&str> =
        r.kinds.iter().map(|k| if *k == EdgeKind::Step { "registration" } else { "closure" }).collect();
    let ends = |k: usize, side: usize| if side == 0 { edges[k].from } else { edges[k].to } as i64;
    let information: Vec<_> = edges.iter().map(|e| e.information).collect();
    let measured: Vec<Se2> = edges.iter().map(|e| e.measurement).collect();
    out.set_item("stamps", Array1::from(r.stamps.clone()).into_pyarray(py))?;
    out.set_item("poses", poses(r.graph.nodes.iter()).into_pyarray(py))?;
    out.set_item("covariances", matrices(&r.covariances).into_pyarray(py))?;
    out.set_item("pairs", Array2::from_shape_fn((edges.len(), 2), |(k, side)| ends(k, side)).into_pyarray(py))?;
    out.set_item("measurements", poses(measured.iter()).into_pyarray(py))?;
    out.set_item("information", matrices(&information).into_pyarray(py))?;
    out.set_item("kinds", kinds)?;
    out.set_item("chi_squares", Array1::from(r.chi_squares.clone()).into_pyarray(py))
}

/// Rows of from, to (keyframes), overlap, correction [m], residual [m], residual [rad], and the verdicts.
fn closures(py: Python<'_>, out: &Bound<'_, PyDict>, r: &MapResult) -> PyResult<()> {
    let rows: Vec<[f64; 6]> = r
        .closures
        .iter()
        .map(|(c, from, to)| {
            let moved = c.predicted.between(&c.check.pose).translation.norm();
            let (metres, radians) = c.residual(&r.graph.nodes[*from].between(&r.graph.nodes[*to]));
            [*from as f64, *to as f64, c.check.overlap, moved, metres, radians]
        })
        .collect();
    let verdicts: Vec<&str> = r.closures.iter().map(|(c, ..)| verdict(c.verdict)).collect();
    out.set_item("closures", Array2::from_shape_fn((rows.len(), 6), |(k, j)| rows[k][j]).into_pyarray(py))?;
    out.set_item("verdicts", verdicts)
}

fn verdict(v: Verdict) -> &'static str {
    match v {
        Verdict::Accepted => "",
        Verdict::NoOverlap => "what the two places show does not agree",
        Verdict::TooLittle => "too little in common view to tell",
        Verdict::Ambiguous => "it fits in two places",
        Verdict::Slides => "nothing holds it along a direction that was not known before",
        Verdict::Implausible => "it lies beyond the uncertainty of the graph",
        Verdict::Contradicted => "the other closures contradict it",
        Verdict::Unconfirmed => "no neighbouring place confirms it",
    }
}

pub(crate) fn landmarks(py: Python<'_>, out: &Bound<'_, PyDict>, map: &LandmarkMap) -> PyResult<()> {
    let all = &map.landmarks;
    let covariances: Vec<_> = all.iter().map(|l| l.covariance).collect();
    let positions = Array2::from_shape_fn((all.len(), 2), |(k, j)| all[k].position[j]);
    out.set_item("landmark_kinds", all.iter().map(|l| l.kind.name()).collect::<Vec<_>>())?;
    out.set_item("landmark_positions", positions.into_pyarray(py))?;
    out.set_item("landmark_covariances", matrices(&covariances).into_pyarray(py))?;
    let orientations: Array1<f64> = all.iter().map(|l| l.orientation.unwrap_or(f64::NAN)).collect();
    out.set_item("landmark_orientations", orientations.into_pyarray(py))?;
    let descriptors = Array2::from_shape_fn((all.len(), 16), |(k, j)| all[k].descriptor.unwrap_or(0).to_le_bytes()[j]);
    out.set_item("landmark_descriptors", descriptors.into_pyarray(py))?;
    let seen: Array1<i64> = all.iter().map(|l| i64::from(l.seen)).collect();
    let visible: Array1<i64> = all.iter().map(|l| i64::from(l.visible)).collect();
    out.set_item("landmark_seen", seen.into_pyarray(py))?;
    out.set_item("landmark_visible", visible.into_pyarray(py))
}

pub(crate) fn grid(py: Python<'_>, out: &Bound<'_, PyDict>, g: &Grid) -> PyResult<()> {
    let value = |c: &Cell| match c {
        Cell::Unknown => -1i8,
        Cell::Free => 0,
        Cell::Occupied => 100,
    };
    let cells = Array2::from_shape_vec((g.height, g.width), g.cells.iter().map(value).collect()).unwrap_or_default();
    out.set_item("grid_cells", cells.into_pyarray(py))?;
    out.set_item("grid_resolution", g.resolution)?;
    out.set_item("grid_origin", (g.origin.x, g.origin.y))
}

/// Tuples of first stamp, last stamp, x, y, sigma, direction, why.
fn weak(out: &Bound<'_, PyDict>, r: &MapResult) -> PyResult<()> {
    let why = |reason: Reason| match reason {
        Reason::Contradiction => "odometry and scans contradict each other",
        Reason::Torn => "the scan was not found on the map and no odometry bridges the gap",
        Reason::Lost => "little of the scan was found on the map",
        Reason::Slides => "nothing stands across this direction: a corridor without ends, or an open space",
    };
    let spots: Vec<_> = r
        .weak
        .iter()
        .map(|w| (w.stamps.0, w.stamps.1, w.position.x, w.position.y, w.sigma, w.direction, why(w.reason)))
        .collect();
    out.set_item("torn", r.weak.iter().filter(|w| w.reason == Reason::Torn).count())?;
    out.set_item("weak", spots)
}

//! `groma.mapping`: scans and odometry pushed in the order in which they come, a map as arrays.

use crate::findings::to_list;
use crate::gate::{self, Beams};
use crate::pose_graph::estimation_error;
use crate::token::{Token, interruptible};
use crate::vehicle::to_vehicle;
use groma_geometry::Se2;
use groma_mapping::conclude;
use groma_mapping::map_result::{EdgeKind, MapResult};
use groma_mapping::options::Options;
use groma_models::{Cell, Grid, LandmarkMap, LaserScan, Odometry};
use groma_pipeline::map::Outcome;
use groma_pipeline::message::WheelReading;
use groma_pipeline::wheels::VirtualWheels;
use groma_pipeline::{Map, Message};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyReadonlyArray1};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(map_defaults, m)?)?;
    m.add_function(wrap_pyfunction!(odometry_jumps, m)?)?;
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

/// Whether no robot drives from one odometry reading `(stamp, x, y, theta)` to the next.
#[pyfunction]
fn odometry_jumps(before: (f64, f64, f64, f64), after: (f64, f64, f64, f64)) -> bool {
    let reading = |(stamp, x, y, theta)| Odometry { stamp, pose: Se2::new(x, y, theta) };
    reading(before).jumps_to(&reading(after))
}

/// Builds a map from messages in the order in which they come.
#[pyclass]
struct Mapper {
    map: Option<Map>,
    /// Wheels made from the odometry of a vehicle that was calibrated by it.
    made: Option<VirtualWheels>,
}

/// x, y, theta.
type Pose = (f64, f64, f64);

#[pymethods]
impl Mapper {
    /// `mount` is `T_base_laser`, where there is no `vehicle` (JSON); `axle` is that of wheels made from odometry [m].
    #[new]
    #[pyo3(signature = (options, mount, vehicle=None, axle=1.0))]
    fn new(options: &str, mount: Pose, vehicle: Option<&str>, axle: f64) -> PyResult<Self> {
        let invalid = |e: String| PyValueError::new_err(e);
        let options: Options = serde_json::from_str(options).map_err(|e| invalid(e.to_string()))?;
        let map = match vehicle {
            Some(vehicle) => Map::of_vehicle(options, &to_vehicle(vehicle)?),
            None => Map::new(options, gate::pose(mount)?),
        };
        let made = vehicle.map(|_| VirtualWheels::new(axle));
        Ok(Self { map: Some(map.map_err(|e| invalid(e.to_string()))?), made })
    }

    /// Odometry; of a vehicle, that which represents its wheels.
    fn push_odometry(&mut self, py: Python<'_>, stamp: f64, x: f64, y: f64, theta: f64) -> PyResult<()> {
        let odometry = Odometry { stamp, pose: Se2::new(x, y, theta) };
        let message = match &mut self.made {
            Some(made) => made.push(&odometry).map(Message::Wheels),
            None => Some(Message::Odometry(odometry)),
        };
        message.map_or(Ok(()), |message| self.push(py, message))
    }

    /// Readings of joints of the vehicle: which of the two, and its position.
    fn push_wheels(&mut self, py: Python<'_>, stamp: f64, positions: Vec<(usize, f64)>) -> PyResult<()> {
        self.push(py, Message::Wheels(WheelReading { stamp, positions }))
    }

    /// `beams` is `(angle_min, angle_increment, time_increment, range_min, range_max)`; intensities as many as ranges, or
    /// none.
    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: PyReadonlyArray1<'_, f64>,
        intensities: PyReadonlyArray1<'_, f64>,
        beams: Beams,
    ) -> PyResult<()> {
        self.push(py, Message::Scan { scanner: 0, scan: laser_scan(stamp, &ranges, &intensities, beams)? })
    }

    /// None before the first scan; else a dict of stamp, pose, covariance (3, 3), keyframes, local_maps and closures.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(state) = self.core()?.state() else { return Ok(None) };
        let out = PyDict::new(py);
        out.set_item("stamp", state.stamp)?;
        out.set_item("pose", (state.pose.x(), state.pose.y(), state.pose.theta()))?;
        out.set_item("covariance", Array2::from_shape_fn((3, 3), |(i, j)| state.covariance[(i, j)]).into_pyarray(py))?;
        out.set_item("keyframes", state.keyframes)?;
        out.set_item("local_maps", state.local_maps)?;
        out.set_item("closures", state.closures)?;
        Ok(Some(out))
    }

    /// The map of what has had its turn as a dict of arrays; goes on as if nobody had asked.
    #[pyo3(signature = (token=None, show=None))]
    fn snapshot<'py>(
        &self,
        py: Python<'py>,
        token: Option<&Token>,
        show: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = self.core()?;
        let outcome = interruptible(py, token, show.as_ref(), |token| core.snapshot(token))?;
        self.told(py, outcome)
    }

    /// The map of everything; may be called once.
    #[pyo3(signature = (token=None, show=None))]
    fn finish<'py>(
        &mut self,
        py: Python<'py>,
        token: Option<&Token>,
        show: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let core = self.map.take().ok_or_else(finished)?;
        let outcome = interruptible(py, token, show.as_ref(), |token| core.finish(token))?;
        self.told(py, outcome)
    }
}

impl Mapper {
    fn core(&self) -> PyResult<&Map> {
        self.map.as_ref().ok_or_else(finished)
    }

    fn told<'py>(&self, py: Python<'py>, outcome: Result<Outcome, conclude::Error>) -> PyResult<Bound<'py, PyDict>> {
        let mut outcome = outcome.map_err(|e| estimation_error(py, e.to_string()))?;
        outcome.findings.extend(self.made.iter().flat_map(VirtualWheels::findings));
        to_dict(py, &outcome)
    }

    fn push(&mut self, py: Python<'_>, message: Message) -> PyResult<()> {
        let core = self.map.as_mut().ok_or_else(finished)?;
        py.detach(|| core.push(message));
        Ok(())
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
    options.validate().map_err(|e| PyValueError::new_err(e.to_string()))?;
    Ok(options)
}

fn finished() -> PyErr {
    PyValueError::new_err("this map is finished")
}

pub(crate) fn poses<'a>(items: impl ExactSizeIterator<Item = &'a Se2>) -> Array2<f64> {
    let n = items.len();
    let flat: Vec<f64> = items.flat_map(|p| [p.x(), p.y(), p.theta()]).collect();
    Array2::from_shape_vec((n, 3), flat).unwrap_or_default()
}

pub(crate) fn matrices<const R: usize>(items: &[nalgebra::SMatrix<f64, R, R>]) -> Array3<f64> {
    Array3::from_shape_fn((items.len(), R, R), |(k, i, j)| items[k][(i, j)])
}

fn to_dict<'py>(py: Python<'py>, outcome: &Outcome) -> PyResult<Bound<'py, PyDict>> {
    let (out, r) = (PyDict::new(py), &outcome.map);
    graph(py, &out, r)?;
    let stamps: Array1<f64> = r.trajectory.iter().map(|(t, _)| *t).collect();
    out.set_item("trajectory_stamps", stamps.into_pyarray(py))?;
    let path: Vec<Se2> = r.trajectory.iter().map(|(_, p)| *p).collect();
    out.set_item("trajectory", poses(path.iter()).into_pyarray(py))?;
    out.set_item("odometry", poses(r.odometry.iter()).into_pyarray(py))?;
    out.set_item("tracked", poses(r.tracked.iter()).into_pyarray(py))?;
    closures(py, &out, r)?;
    landmarks(py, &out, &r.landmarks)?;
    grid(py, &out, &r.grid)?;
    weak(&out, r)?;
    out.set_item("counts", outcome.counts.iter().copied().collect::<BTreeMap<_, _>>())?;
    out.set_item("findings", to_list(py, &outcome.findings)?)?;
    out.set_item("verdict", outcome.verdict)?;
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
        .map(|closed @ (c, from, to)| {
            let moved = c.predicted.between(&c.check.pose).translation.norm();
            let (metres, radians) = r.left_of(closed);
            [*from as f64, *to as f64, c.check.overlap, moved, metres, radians]
        })
        .collect();
    let verdicts: Vec<&str> = r.closures.iter().map(|(c, ..)| c.verdict.told()).collect();
    out.set_item("closures", Array2::from_shape_fn((rows.len(), 6), |(k, j)| rows[k][j]).into_pyarray(py))?;
    out.set_item("verdicts", verdicts)
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
    let spots: Vec<_> = r
        .weak
        .iter()
        .map(|w| (w.stamps.0, w.stamps.1, w.position.x, w.position.y, w.sigma, w.direction, w.reason.told()))
        .collect();
    out.set_item("weak", spots)
}

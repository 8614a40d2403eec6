//! `groma.mapping`: scans and odometry pushed in the order in which they come, a map as arrays.

use crate::border::{self, In1, Out};
use crate::findings::{Row, to_rows};
use crate::gate::{self, Beams};
use crate::pose_graph::estimation_error;
use crate::token::{Token, interruptible};
use crate::vehicle::to_vehicle;
use groma_geometry::Se2;
use groma_mapping::conclude;
use groma_mapping::map_result::{AnchoredClosure, EdgeKind, MapResult};
use groma_mapping::options::Options;
use groma_models::{Cell, Grid, LandmarkMap, LaserScan, Odometry};
use groma_pipeline::map::Outcome;
use groma_pipeline::message::WheelReading;
use groma_pipeline::wheels::VirtualWheels;
use groma_pipeline::{Map, Message};
use numpy::ndarray::{Array2, Array3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::BTreeMap;

/// The settings of mapping and their defaults, as JSON.
#[pyfunction]
pub(crate) fn map_defaults() -> PyResult<String> {
    border::json(&Options::default())
}

/// Whether no robot drives from one odometry reading `(stamp, x, y, theta)` to the next.
#[pyfunction]
pub(crate) fn odometry_jumps(before: (f64, f64, f64, f64), after: (f64, f64, f64, f64)) -> bool {
    let reading = |(stamp, x, y, theta)| Odometry { stamp, pose: Se2::new(x, y, theta) };
    reading(before).jumps_to(&reading(after))
}

/// Builds a map from messages in the order in which they come.
#[pyclass(module = "groma._core")]
pub(crate) struct Mapper {
    map: Option<Map>,
    /// Wheels made from the odometry of a vehicle that was calibrated by it.
    made: Option<VirtualWheels>,
}

/// How far a map is.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct MapState {
    stamp: f64,
    pose: Pose,
    covariance: border::Array2<f64>,
    keyframes: usize,
    local_maps: usize,
    closures: usize,
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
        ranges: In1<'_, f64>,
        intensities: In1<'_, f64>,
        beams: Beams,
    ) -> PyResult<()> {
        self.push(py, Message::Scan { scanner: 0, scan: laser_scan(stamp, &ranges, &intensities, beams)? })
    }

    /// None before the first scan.
    fn state(&self, py: Python<'_>) -> PyResult<Option<MapState>> {
        Ok(self.core()?.state().map(|state| MapState {
            stamp: state.stamp,
            pose: (state.pose.x(), state.pose.y(), state.pose.theta()),
            covariance: Array2::from_shape_fn((3, 3), |(i, j)| state.covariance[(i, j)]).out(py),
            keyframes: state.keyframes,
            local_maps: state.local_maps,
            closures: state.closures,
        }))
    }

    /// The map of what has had its turn; goes on as if nobody had asked.
    #[pyo3(signature = (token=None, show=None))]
    fn snapshot(&self, py: Python<'_>, token: Option<&Token>, show: Option<border::Progress>) -> PyResult<MapArrays> {
        let core = self.core()?;
        let outcome = interruptible(py, token, show.as_ref(), |token| core.snapshot(token))?;
        self.told(py, outcome)
    }

    /// The map of everything; may be called once.
    #[pyo3(signature = (token=None, show=None))]
    fn finish(&mut self, py: Python<'_>, token: Option<&Token>, show: Option<border::Progress>) -> PyResult<MapArrays> {
        let core = self.map.take().ok_or_else(finished)?;
        let outcome = interruptible(py, token, show.as_ref(), |token| core.finish(token))?;
        self.told(py, outcome)
    }
}

impl Mapper {
    fn core(&self) -> PyResult<&Map> {
        self.map.as_ref().ok_or_else(finished)
    }

    fn told(&self, py: Python<'_>, outcome: Result<Outcome, conclude::Error>) -> PyResult<MapArrays> {
        let mut outcome = outcome.map_err(|e| estimation_error(py, e.to_string()))?;
        outcome.findings.extend(self.made.iter().flat_map(VirtualWheels::findings));
        to_arrays(py, &outcome)
    }

    fn push(&mut self, py: Python<'_>, message: Message) -> PyResult<()> {
        let core = self.map.as_mut().ok_or_else(finished)?;
        py.detach(|| core.push(message));
        Ok(())
    }
}

pub(crate) fn laser_scan(
    stamp: f64,
    ranges: &In1<'_, f64>,
    intensities: &In1<'_, f64>,
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

/// A map.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct MapArrays {
    graph: Py<GraphArrays>,
    trajectory_stamps: border::Array1<f64>,
    trajectory: border::Array2<f64>,
    odometry: border::Array2<f64>,
    tracked: border::Array2<f64>,
    /// From, to (keyframes), overlap, correction [m], residual [m], residual [rad] a row.
    closures: border::Array2<f64>,
    /// Why each closure was rejected; empty when it was accepted.
    verdicts: Vec<&'static str>,
    landmarks: Py<LandmarkArrays>,
    grid: Py<GridArrays>,
    /// First and last stamp, x, y, sigma [m], direction [rad], why.
    weak: Vec<(f64, f64, f64, f64, f64, f64, &'static str)>,
    counts: BTreeMap<&'static str, f64>,
    findings: Vec<Row>,
    verdict: &'static str,
}

/// The optimised pose graph.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct GraphArrays {
    stamps: border::Array1<f64>,
    poses: border::Array2<f64>,
    covariances: border::Array3<f64>,
    pairs: border::Array2<i64>,
    measurements: border::Array2<f64>,
    information: border::Array3<f64>,
    kinds: Vec<&'static str>,
    chi_squares: border::Array1<f64>,
}

/// Corners and reflectors in the frame of the map.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct LandmarkArrays {
    kinds: Vec<&'static str>,
    positions: border::Array2<f64>,
    covariances: border::Array3<f64>,
    orientations: border::Array1<f64>,
    descriptors: border::Array2<u8>,
    seen: border::Array1<i64>,
    visible: border::Array1<i64>,
}

/// An occupancy grid: -1 unknown, 0 free, 100 occupied.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct GridArrays {
    cells: border::Array2<i8>,
    resolution: f64,
    origin: (f64, f64),
}

fn to_arrays(py: Python<'_>, outcome: &Outcome) -> PyResult<MapArrays> {
    let r = &outcome.map;
    let path: Vec<Se2> = r.trajectory.iter().map(|(_, p)| *p).collect();
    let closures = closures(r);
    Ok(MapArrays {
        graph: Py::new(py, graph(py, r))?,
        trajectory_stamps: border::column(py, r.trajectory.iter().map(|(t, _)| *t)),
        trajectory: poses(path.iter()).out(py),
        odometry: poses(r.odometry.iter()).out(py),
        tracked: poses(r.tracked.iter()).out(py),
        closures: Array2::from_shape_fn((closures.len(), 6), |(k, j)| closures[k][j]).out(py),
        verdicts: r.closures.iter().map(|c| c.closure.verdict.told()).collect(),
        landmarks: Py::new(py, landmarks(py, &r.landmarks))?,
        grid: Py::new(py, grid(py, &r.grid))?,
        weak: r
            .weak
            .iter()
            .map(|w| (w.stamps.0, w.stamps.1, w.position.x, w.position.y, w.sigma, w.direction, w.reason.told()))
            .collect(),
        counts: outcome.counts.iter().copied().collect(),
        findings: to_rows(&outcome.findings),
        verdict: outcome.verdict,
    })
}

fn graph(py: Python<'_>, r: &MapResult) -> GraphArrays {
    let edges = &r.graph.edges;
    let kind = |k: &EdgeKind| if *k == EdgeKind::Step { "registration" } else { "closure" };
    let ends = |k: usize, side: usize| if side == 0 { edges[k].from } else { edges[k].to } as i64;
    let information: Vec<_> = edges.iter().map(|e| e.information).collect();
    let measured: Vec<Se2> = edges.iter().map(|e| e.measurement).collect();
    GraphArrays {
        stamps: r.stamps.clone().out(py),
        poses: poses(r.graph.nodes.iter()).out(py),
        covariances: matrices(&r.covariances).out(py),
        pairs: Array2::from_shape_fn((edges.len(), 2), |(k, side)| ends(k, side)).out(py),
        measurements: poses(measured.iter()).out(py),
        information: matrices(&information).out(py),
        kinds: r.kinds.iter().map(kind).collect(),
        chi_squares: r.chi_squares.clone().out(py),
    }
}

fn closures(r: &MapResult) -> Vec<[f64; 6]> {
    let row = |closed: &AnchoredClosure| {
        let c = &closed.closure;
        let moved = c.predicted.between(&c.check.pose).translation.norm();
        let left = r.residual(closed);
        [closed.from as f64, closed.to as f64, c.check.overlap, moved, left.distance, left.angle]
    };
    r.closures.iter().map(row).collect()
}

pub(crate) fn landmarks(py: Python<'_>, map: &LandmarkMap) -> LandmarkArrays {
    let all = &map.landmarks;
    let covariances: Vec<_> = all.iter().map(|l| l.covariance).collect();
    let descriptors = Array2::from_shape_fn((all.len(), 16), |(k, j)| all[k].descriptor.unwrap_or(0).to_le_bytes()[j]);
    LandmarkArrays {
        kinds: all.iter().map(|l| l.kind.name()).collect(),
        positions: Array2::from_shape_fn((all.len(), 2), |(k, j)| all[k].position[j]).out(py),
        covariances: matrices(&covariances).out(py),
        orientations: border::column(py, all.iter().map(|l| l.orientation.unwrap_or(f64::NAN))),
        descriptors: descriptors.out(py),
        seen: border::column(py, all.iter().map(|l| i64::from(l.seen))),
        visible: border::column(py, all.iter().map(|l| i64::from(l.visible))),
    }
}

pub(crate) fn grid(py: Python<'_>, g: &Grid) -> GridArrays {
    let value = |c: &Cell| match c {
        Cell::Unknown => -1i8,
        Cell::Free => 0,
        Cell::Occupied => 100,
    };
    let cells = Array2::from_shape_vec((g.height, g.width), g.cells.iter().map(value).collect()).unwrap_or_default();
    GridArrays { cells: cells.out(py), resolution: g.resolution, origin: (g.origin.x, g.origin.y) }
}

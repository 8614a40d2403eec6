//! Simulated recordings: a scenario as JSON in, arrays out.

use crate::border::{self, Out};
use crate::token::{Token, cancelled, interruptible};
use groma_geometry::Se2;
use groma_simulation::calibration::Drivetrain;
use groma_simulation::world::Shape;
use groma_simulation::{
    CalibrationDrive, CalibrationScenario, Scenario, Simulated, SimulationError, simulate,
    simulate_calibration as calibration_drive,
};

use numpy::ndarray::{Array1, Array2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A simulated recording and its truth, as arrays.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct SimulatedArrays {
    scan_stamps: border::Array1<f64>,
    scan_poses: border::Array2<f64>,
    ranges: border::Array2<f64>,
    intensities: border::Array2<f64>,
    odometry_stamps: border::Array1<f64>,
    odometry: border::Array2<f64>,
    joint_names: (String, String),
    joints: border::Array2<f64>,
    truth: border::Array2<f64>,
    stalls: border::Array2<f64>,
    segments: border::Array2<f64>,
    circles: border::Array2<f64>,
}

#[pyfunction]
pub(crate) fn simulation_scenes() -> Vec<&'static str> {
    groma_simulation::scenario::SCENES.to_vec()
}

#[pyfunction]
pub(crate) fn simulation_scenario(scene: &str, seed: u64) -> PyResult<String> {
    let scenario = Scenario::named(scene, seed).map_err(|e| PyValueError::new_err(e.to_string()))?;
    serde_json::to_string(&scenario).map_err(|e| PyValueError::new_err(e.to_string()))
}

#[pyfunction]
#[pyo3(signature = (scenario, token=None))]
pub(crate) fn simulate_scenario(py: Python<'_>, scenario: &str, token: Option<&Token>) -> PyResult<SimulatedArrays> {
    let scenario: Scenario = serde_json::from_str(scenario).map_err(|e| PyValueError::new_err(e.to_string()))?;
    let simulated = interruptible(py, token, None, |token| simulate(&scenario, token))?.map_err(raised)?;
    Ok(arrays(py, &scenario, &simulated))
}

fn raised(error: SimulationError) -> PyErr {
    if matches!(error, SimulationError::Cancelled(_)) { cancelled() } else { PyValueError::new_err(error.to_string()) }
}

fn arrays(py: Python<'_>, scenario: &Scenario, simulated: &Simulated) -> SimulatedArrays {
    let [first, second] = scenario.vehicle.joint_names();
    let scans = &simulated.scans;
    let beams = scenario.scanner.beams;
    let (segments, circles) = surfaces(simulated);
    SimulatedArrays {
        scan_stamps: column(py, scans.iter().map(|scan| scan.stamp)),
        scan_poses: poses(py, simulated.scan_poses.iter()),
        ranges: rows(py, beams, scans.iter().flat_map(|scan| scan.ranges.iter().copied())),
        intensities: rows(py, beams, scans.iter().flat_map(|scan| scan.intensities.iter().copied())),
        odometry_stamps: column(py, simulated.odometry.iter().map(|reading| reading.stamp)),
        odometry: poses(py, simulated.odometry.iter().map(|reading| &reading.pose)),
        joint_names: (first.to_owned(), second.to_owned()),
        joints: rows(py, 2, simulated.joints.iter().flatten().copied()),
        truth: poses(py, simulated.truth.iter()),
        stalls: rows(py, 2, simulated.stalls.iter().flat_map(|s| [scenario.start + s.start, s.duration])),
        segments: rows(py, 5, segments.into_iter()),
        circles: rows(py, 4, circles.into_iter()),
    }
}

/// Segments as `(x, y, x, y, reflectivity)`, circles as `(x, y, radius, reflectivity)`, one after the other.
fn surfaces(simulated: &Simulated) -> (Vec<f64>, Vec<f64>) {
    let (mut segments, mut circles) = (vec![], vec![]);
    for surface in &simulated.world.surfaces {
        match surface.shape {
            Shape::Segment { a, b } => segments.extend([a.x, a.y, b.x, b.y, surface.reflectivity]),
            Shape::Circle { center, radius } => circles.extend([center.x, center.y, radius, surface.reflectivity]),
        }
    }
    (segments, circles)
}

/// A simulated recording for calibration and its truth, as arrays.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct CalibrationArrays {
    scan_stamps: border::Array1<f64>,
    scan_poses: border::Array2<f64>,
    ranges: border::Array2<f64>,
    wheel_stamps: border::Array1<f64>,
    readings: border::Array2<f64>,
    truth: border::Array2<f64>,
}

/// The scenario for a drivetrain (JSON), as JSON.
#[pyfunction]
pub(crate) fn calibration_scenario(drivetrain: &str, seed: u64) -> PyResult<String> {
    let drivetrain: Drivetrain = serde_json::from_str(drivetrain).map_err(|e| PyValueError::new_err(e.to_string()))?;
    serde_json::to_string(&CalibrationScenario::new(drivetrain, seed)).map_err(|e| PyValueError::new_err(e.to_string()))
}

#[pyfunction]
#[pyo3(signature = (scenario, token=None))]
pub(crate) fn simulate_calibration(
    py: Python<'_>,
    scenario: &str,
    token: Option<&Token>,
) -> PyResult<CalibrationArrays> {
    let scenario: CalibrationScenario =
        serde_json::from_str(scenario).map_err(|e| PyValueError::new_err(e.to_string()))?;
    let drive = interruptible(py, token, None, |token| calibration_drive(&scenario, token))?.map_err(raised)?;
    Ok(calibration_arrays(py, scenario.scanner.beams, &drive))
}

fn calibration_arrays(py: Python<'_>, beams: usize, drive: &CalibrationDrive) -> CalibrationArrays {
    CalibrationArrays {
        scan_stamps: column(py, drive.scans.iter().map(|scan| scan.stamp)),
        scan_poses: poses(py, drive.scan_poses.iter()),
        ranges: rows(py, beams, drive.scans.iter().flat_map(|scan| scan.ranges.iter().copied())),
        wheel_stamps: column(py, drive.stamps.iter().copied()),
        readings: rows(py, 2, drive.readings.iter().flatten().copied()),
        truth: poses(py, drive.truth.iter()),
    }
}

fn column(py: Python<'_>, values: impl Iterator<Item = f64>) -> border::Array1<f64> {
    Array1::from_iter(values).out(py)
}

fn poses<'a>(py: Python<'_>, poses: impl Iterator<Item = &'a Se2>) -> border::Array2<f64> {
    rows(py, 3, poses.flat_map(|pose| [pose.x(), pose.y(), pose.theta()]))
}

fn rows(py: Python<'_>, width: usize, values: impl Iterator<Item = f64>) -> border::Array2<f64> {
    let values: Vec<f64> = values.collect();
    let mut table = Array2::zeros((values.len() / width, width));
    table.iter_mut().zip(values).for_each(|(cell, value)| *cell = value);
    table.out(py)
}

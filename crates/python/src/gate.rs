//! What comes in from Python as numbers, made into nouns of the core and checked: the error names the field and the value.

use crate::border::In1;
use groma_geometry::Se2;
use groma_models::bounds::{ALL, ANGLE, COORDINATE};
use groma_models::{BeamGeometry, LaserScan, ModelError};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// angle_min, angle_increment, time_increment, range_min, range_max.
pub(crate) type Beams = (f64, f64, f64, f64, f64);

/// Name, least and largest value, and the rule in words of every bound.
#[pyfunction]
pub(crate) fn bounds() -> Vec<(&'static str, f64, f64, &'static str)> {
    ALL.iter().map(|b| (b.name, b.low, b.high, b.rule)).collect()
}

/// A mistake in the numbers that came in.
pub(crate) fn refused(error: ModelError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// The geometry of the beams of a scan.
pub(crate) fn geometry(
    (angle_min, angle_increment, time_increment, range_min, range_max): Beams,
) -> PyResult<BeamGeometry> {
    let geometry = BeamGeometry { angle_min, angle_increment, time_increment, range_min, range_max };
    geometry.validate().map_err(refused)?;
    Ok(geometry)
}

/// A scan without intensities.
pub(crate) fn scan(stamp: f64, ranges: &In1<'_, f64>, beams: Beams) -> PyResult<LaserScan> {
    let ranges = ranges.as_array().to_vec();
    let scan = LaserScan { stamp, geometry: geometry(beams)?, ranges, intensities: Vec::new() };
    scan.validate().map_err(refused)?;
    Ok(scan)
}

/// A pose in the plane.
pub(crate) fn pose((x, y, theta): (f64, f64, f64)) -> PyResult<Se2> {
    let checked = COORDINATE.check("x", x).and(COORDINATE.check("y", y)).and(ANGLE.check("theta", theta));
    checked.map_err(refused)?;
    Ok(Se2::new(x, y, theta))
}

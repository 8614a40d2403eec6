//! `groma.promotion`: landmark maps in, the promoted map out.

use crate::findings::to_list;
use crate::localization::{Table, to_map};
use crate::mapping::{json, landmarks};
use groma_mapping::promotion::{Options, promote as core};
use numpy::PyReadonlyArray1;
use numpy::PyReadonlyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(promotion_defaults, m)?)?;
    m.add_function(wrap_pyfunction!(promote, m)?)
}

/// The settings of promotion and their defaults.
#[pyfunction]
fn promotion_defaults(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    json(py, &Options::default())
}

/// Landmarks as for the localizer: rows, which are reflectors, descriptors.
type Landmarks<'py> = (Table<'py>, PyReadonlyArray1<'py, bool>, PyReadonlyArray2<'py, u8>);

/// The new map as a dict of arrays, with `promoted`, `confirmed` and `findings`.
#[pyfunction]
fn promote<'py>(
    py: Python<'py>,
    map: Landmarks<'py>,
    days: Vec<Landmarks<'py>>,
    options: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let invalid = |e: String| PyValueError::new_err(e);
    let options: Options = serde_json::from_str(options).map_err(|e| invalid(e.to_string()))?;
    let of = |(rows, reflector, descriptors): &Landmarks<'py>| to_map(rows, reflector, descriptors);
    let (map, days) = (of(&map), days.iter().map(of).collect::<Vec<_>>());
    let result = py.detach(|| core(&map, &days, &options)).map_err(|e| invalid(e.to_string()))?;
    let out = PyDict::new(py);
    landmarks(py, &out, &result.map)?;
    out.set_item("promoted", result.promoted)?;
    out.set_item("confirmed", result.confirmed)?;
    out.set_item("findings", to_list(py, &result.findings)?)?;
    Ok(out)
}

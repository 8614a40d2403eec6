//! `groma.promotion`: landmark maps in, the promoted map out.

use crate::border::{self, In1, In2};
use crate::findings::{Row, to_rows};
use crate::localization::{Table, to_map};
use crate::mapping::{LandmarkArrays, landmarks};
use groma_mapping::promotion::{Options, promote as core};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// The settings of promotion and their defaults, as JSON.
#[pyfunction]
pub(crate) fn promotion_defaults() -> PyResult<String> {
    border::json(&Options::default())
}

/// Landmarks as for the localizer: rows, which are reflectors, descriptors.
type Landmarks<'py> = (Table<'py>, In1<'py, bool>, In2<'py, u8>);

/// A map to which landmarks were promoted.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct PromotedMap {
    landmarks: Py<LandmarkArrays>,
    promoted: usize,
    confirmed: usize,
    findings: Vec<Row>,
}

/// The new map.
#[pyfunction]
pub(crate) fn promote<'py>(
    py: Python<'py>,
    map: Landmarks<'py>,
    days: Vec<Landmarks<'py>>,
    options: &str,
) -> PyResult<PromotedMap> {
    let invalid = |e: String| PyValueError::new_err(e);
    let options: Options = serde_json::from_str(options).map_err(|e| invalid(e.to_string()))?;
    let of = |(rows, reflector, descriptors): &Landmarks<'py>| to_map(rows, reflector, descriptors);
    let (map, days) = (of(&map), days.iter().map(of).collect::<Vec<_>>());
    let result = py.detach(|| core(&map, &days, &options)).map_err(|e| invalid(e.to_string()))?;
    Ok(PromotedMap {
        landmarks: Py::new(py, landmarks(py, &result.map))?,
        promoted: result.promoted,
        confirmed: result.confirmed,
        findings: to_rows(&result.findings),
    })
}

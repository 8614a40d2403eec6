//! `groma.egomotion`: scans pushed in order of time, the motions between stations as arrays.

use crate::gate;
use groma_egomotion::stations::Skipped;
use groma_egomotion::{Motion, Station, Stations, Verdict};
use numpy::ndarray::{Array1, Array2, Array3};
use numpy::{IntoPyArray, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_class::<Egomotion>()
}

/// Follows scans and measures the motions between stations; `finish` may be called once.
#[pyclass]
struct Egomotion(Option<Stations>);

#[pymethods]
impl Egomotion {
    /// `stations` (n, 2): begin and end of a standstill, or twice the same moment, in order of time [s].
    #[new]
    fn new(stations: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        let table = stations.as_array();
        if table.ncols() != 2 {
            return Err(PyValueError::new_err("stations: (n, 2) begin and end"));
        }
        Ok(Self(Some(Stations::new(table.rows().into_iter().map(|r| Station { from: r[0], to: r[1] }).collect()))))
    }

    /// Empty when the scan was used, else why not. `beams` is `(angle_min, angle_increment, time_increment, range_min,
    /// range_max)`.
    fn push(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: PyReadonlyArray1<'_, f64>,
        beams: gate::Beams,
    ) -> PyResult<&'static str> {
        let scan = gate::scan(stamp, &ranges, beams)?;
        let core = self.0.as_mut().ok_or_else(finished)?;
        Ok(match py.detach(|| core.push(scan)) {
            Ok(()) => "",
            Err(Skipped::Late) => "stamp not after that of the scan before",
            Err(Skipped::Empty) => "fewer than ten hits",
        })
    }

    /// The motions as a dict of arrays: start, end, motion, covariance, share, scale, verdict.
    fn finish<'py>(&mut self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core = self.0.take().ok_or_else(finished)?;
        let motions = py.detach(|| core.finish());
        let out = PyDict::new(py);
        let column = |of: fn(&Motion) -> f64| motions.iter().map(of).collect::<Array1<f64>>();
        out.set_item("start", column(|m| m.start).into_pyarray(py))?;
        out.set_item("end", column(|m| m.end).into_pyarray(py))?;
        out.set_item("share", column(|m| m.share).into_pyarray(py))?;
        out.set_item("scale", column(|m| m.scale).into_pyarray(py))?;
        let count = motions.len();
        out.set_item("motion", Array2::from_shape_fn((count, 3), |(k, j)| motions[k].motion[j]).into_pyarray(py))?;
        let covariance = Array3::from_shape_fn((count, 3, 3), |(k, i, j)| motions[k].covariance[(i, j)]);
        out.set_item("covariance", covariance.into_pyarray(py))?;
        out.set_item("verdict", motions.iter().map(|m| words(m.verdict)).collect::<Vec<_>>())?;
        Ok(out)
    }
}

fn finished() -> PyErr {
    PyValueError::new_err("these motions are finished")
}

/// Empty for a motion that counts, else why it does not.
fn words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Good => "",
        Verdict::Unseen => "no scan at one of its ends",
        Verdict::Apart => "its ends have too little in view in common",
        Verdict::Open => "nothing stands across one direction: a corridor, an open space",
        Verdict::Astray => "the scans of its ends could not be registered to each other",
    }
}

//! `groma.findings`: the catalogue of findings, findings of the core as dicts, and the verdict that follows from them.

use groma_models::Finding;
use groma_models::finding::{Code, Kind, Severity, verdict};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

pub(crate) fn register(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add_function(wrap_pyfunction!(finding_catalogue, m)?)?;
    m.add_function(wrap_pyfunction!(finding_verdict, m)?)
}

/// Name, severity, forced verdict, meaning and remedy.
type Row = (&'static str, &'static str, Option<&'static str>, &'static str, &'static str);

/// A row a code.
#[pyfunction]
fn finding_catalogue() -> Vec<Row> {
    Code::ALL.iter().map(|c| (c.name(), severity(c.severity()), c.verdict(), c.meaning(), c.remedy())).collect()
}

/// The verdict on a run of a kind by the codes of its findings.
#[pyfunction]
fn finding_verdict(kind: &str, codes: Vec<String>) -> PyResult<&'static str> {
    let invalid = |e: String| PyValueError::new_err(e);
    let kind = Kind::from_name(kind).map_err(|e| invalid(e.to_string()))?;
    let code = |name: &String| Code::from_name(name).ok_or_else(|| invalid(format!("no finding has the code {name}")));
    Ok(verdict(kind, &codes.iter().map(code).collect::<PyResult<Vec<_>>>()?))
}

fn severity(severity: Severity) -> &'static str {
    match severity {
        Severity::Info => "info",
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

/// Findings as dicts with code, text, span, place and values (name, number, unit).
pub(crate) fn to_list<'py>(py: Python<'py>, findings: &[Finding]) -> PyResult<Bound<'py, PyList>> {
    let dicts = findings.iter().map(|f| {
        let out = PyDict::new(py);
        out.set_item("code", f.code.name())?;
        out.set_item("text", &f.text)?;
        out.set_item("span", f.span)?;
        out.set_item("place", f.place.map(|[x, y]| (x, y)))?;
        out.set_item("values", f.values.iter().map(|q| (q.name, q.value, q.unit)).collect::<Vec<_>>())?;
        Ok(out)
    });
    PyList::new(py, dicts.collect::<PyResult<Vec<_>>>()?)
}

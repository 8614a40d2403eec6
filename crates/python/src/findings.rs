//! `groma.findings`: the catalogue of findings, findings of the core as dicts, and the verdict that follows from them.

use groma_models::Finding;
use groma_models::finding::{Code, Kind, Severity, verdict};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Name, severity, forced verdict, meaning and remedy.
type CodeRow = (&'static str, &'static str, Option<&'static str>, &'static str, &'static str);

/// A row a code.
#[pyfunction]
pub(crate) fn finding_catalogue() -> Vec<CodeRow> {
    Code::ALL.iter().map(|c| (c.name(), severity(c.severity()), c.verdict(), c.meaning(), c.remedy())).collect()
}

/// The verdict on a run of a kind by the codes of its findings.
#[pyfunction]
pub(crate) fn finding_verdict(kind: &str, codes: Vec<String>) -> PyResult<&'static str> {
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

/// Code, text, span, place and values (name, number, unit) of a finding.
pub(crate) type Row =
    (&'static str, String, Option<(f64, f64)>, Option<(f64, f64)>, Vec<(&'static str, f64, &'static str)>);

/// Findings as rows.
pub(crate) fn to_rows(findings: &[Finding]) -> Vec<Row> {
    let row = |f: &Finding| {
        let values = f.values.iter().map(|q| (q.name, q.value, q.unit)).collect();
        (f.code.name(), f.text.clone(), f.span, f.place.map(|[x, y]| (x, y)), values)
    };
    findings.iter().map(row).collect()
}

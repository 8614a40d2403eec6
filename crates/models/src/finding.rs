//! Findings: what was noticed about a recording or a result, as values with a code that programs can rely on.
//!
//! A finding says what it is ([`Code`]: severity, meaning, remedy and the verdict that it forces stand in one table), where
//! (a time span, a place), how much (numbers with units), and in one sentence what happened here. Standard error, the
//! report and `metrics.json` of a run show the same list. A remark that is not a finding does not exist.
//!
//! The verdict of a run follows from its findings alone: [`verdict`] takes the first code of the table that forces one.

use serde::Serialize;
use thiserror::Error;

mod catalogue;

pub use catalogue::Code;

/// How much a finding matters; the order is that of the levels of ROS diagnostics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Worth knowing; nothing to do.
    Info,
    /// The result may suffer: look, then decide.
    Warning,
    /// The result must not be relied on: the run exits with 1.
    Error,
}

/// A number of a finding.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// What it is, in `snake_case`.
    pub name: &'static str,
    /// How much.
    pub value: f64,
    /// Unit as in `m`, `rad`, `s`, `1` for counts and shares.
    pub unit: &'static str,
}

/// Something that was noticed.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What it is.
    pub code: Code,
    /// First and last stamp [s], where it belongs to a time.
    pub span: Option<(f64, f64)>,
    /// Where in the frame of the result [m], where it belongs to a place.
    pub place: Option<[f64; 2]>,
    /// How much.
    pub values: Vec<Quantity>,
    /// What happened here, in one sentence without a full stop.
    pub text: String,
}

impl Finding {
    /// A finding without time, place or numbers.
    #[must_use]
    pub fn new(code: Code, text: impl Into<String>) -> Self {
        Self { code, span: None, place: None, values: Vec::new(), text: text.into() }
    }

    /// The same, of a time span [s].
    #[must_use]
    pub fn during(mut self, from: f64, to: f64) -> Self {
        self.span = Some((from, to));
        self
    }

    /// The same, of a place [m].
    #[must_use]
    pub fn at(mut self, x: f64, y: f64) -> Self {
        self.place = Some([x, y]);
        self
    }

    /// The same with a number.
    #[must_use]
    pub fn with(mut self, name: &'static str, value: f64, unit: &'static str) -> Self {
        self.values.push(Quantity { name, value, unit });
        self
    }
}

/// What is judged: each kind of run has a word for a result without objection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `groma map`.
    Map,
    /// `groma localize`.
    Localization,
    /// `groma calibrate vehicle`.
    Vehicle,
    /// `groma calibrate camera`.
    Camera,
    /// `groma cameras map`.
    Network,
    /// `groma promote`.
    Promotion,
    /// `groma plan ...`.
    Plan,
    /// `groma evaluate ...`.
    Evaluation,
    /// `groma simulate ...`, `groma inspect`.
    Recording,
}

/// No kind of run has this name.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("no kind of run is called {0}")]
pub struct UnknownKind(pub String);

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 9] = [
        Self::Map,
        Self::Localization,
        Self::Vehicle,
        Self::Camera,
        Self::Network,
        Self::Promotion,
        Self::Plan,
        Self::Evaluation,
        Self::Recording,
    ];

    /// The kind in files and names of links (`latest-map`).
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Map => "map",
            Self::Localization => "localization",
            Self::Vehicle => "vehicle",
            Self::Camera => "camera",
            Self::Network => "network",
            Self::Promotion => "promotion",
            Self::Plan => "plan",
            Self::Evaluation => "evaluation",
            Self::Recording => "recording",
        }
    }

    /// The kind of a name.
    ///
    /// # Errors
    /// [`UnknownKind`].
    pub fn from_name(name: &str) -> Result<Self, UnknownKind> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| UnknownKind(name.to_owned()))
    }

    /// The verdict on a result to which nothing is objected.
    #[must_use]
    pub fn good(self) -> &'static str {
        match self {
            Self::Map => "consistent",
            Self::Localization => "tracked",
            Self::Vehicle | Self::Camera => "calibrated",
            Self::Network => "mapped",
            Self::Promotion => "promoted",
            Self::Plan => "planned",
            Self::Evaluation => "evaluated",
            Self::Recording => "whole",
        }
    }
}

/// The verdict on a run: one documented word.
#[must_use]
pub fn verdict(kind: Kind, codes: &[Code]) -> &'static str {
    let forced = Code::ALL.iter().filter(|code| codes.contains(code));
    forced.filter_map(|code| code.verdict()).next().unwrap_or(kind.good())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_codes_are_unique_and_lead_back() {
        for (k, code) in Code::ALL.iter().enumerate() {
            assert_eq!(Code::from_name(code.name()), Some(*code));
            assert!(Code::ALL[..k].iter().all(|other| other.name() != code.name()));
            assert!(code.name().chars().all(|c| c.is_ascii_lowercase() || c == '-'), "{}", code.name());
        }
    }

    #[test]
    fn every_error_forces_a_verdict_and_no_remark_does() {
        for code in Code::ALL {
            match code.severity() {
                Severity::Error => assert!(code.verdict().is_some(), "{}", code.name()),
                Severity::Info => assert!(code.verdict().is_none(), "{}", code.name()),
                Severity::Warning => {}
            }
        }
    }

    #[test]
    fn the_worst_finding_decides() {
        assert_eq!(verdict(Kind::Map, &[]), "consistent");
        assert_eq!(verdict(Kind::Map, &[Code::WeakStretch]), "consistent");
        assert_eq!(verdict(Kind::Map, &[Code::ClosureViolated, Code::MapTorn]), "torn");
        assert_eq!(verdict(Kind::Localization, &[Code::NeverFound]), "not-found");
    }

    #[test]
    fn kinds_have_names() {
        for kind in Kind::ALL {
            assert_eq!(Kind::from_name(kind.name()), Ok(kind));
        }
        assert!(Kind::from_name("poem").is_err());
    }
}

//! Settings of localization: those of the filter, and how messages are taken.

use groma_localization::RelocalizeOptions;
use groma_models::{ModelError, OdometryNoise};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Longest lateness: beyond it a stream is a recording of its own [s].
const LONGEST: f64 = 3600.0;

/// Settings; on file those of the filter stand beside the others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Raw")]
pub struct Options {
    /// Messages wait for others that are up to this late [s].
    pub lateness: f64,
    /// How far odometry is to be trusted; calibrated wheels have a noise of their own.
    pub odometry: OdometryNoise,
    /// The search for the place while it is not known.
    pub relocalize: RelocalizeOptions,
    /// The filter.
    #[serde(flatten)]
    pub localizer: groma_localization::Options,
}

impl Default for Options {
    fn default() -> Self {
        let (odometry, localizer) = (OdometryNoise::uncalibrated(), groma_localization::Options::default());
        Self { lateness: 0.0, odometry, relocalize: RelocalizeOptions::default(), localizer }
    }
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), super::Error> {
        self.odometry.validate()?;
        if !(0.0..=LONGEST).contains(&self.lateness) {
            let rule = "must be between 0 and 3600 s";
            return Err(ModelError::Setting { name: "lateness", value: self.lateness, rule }.into());
        }
        self.localizer.validate().map_err(groma_localization::Error::from)?;
        self.relocalize.validate().map_err(groma_localization::Error::from)?;
        Ok(())
    }
}

/// What stands on file: tables that are flattened let unknown names pass, so these are caught here.
#[derive(Deserialize)]
struct Raw {
    #[serde(default)]
    lateness: f64,
    #[serde(default = "OdometryNoise::uncalibrated")]
    odometry: OdometryNoise,
    #[serde(default)]
    relocalize: RelocalizeOptions,
    #[serde(flatten)]
    localizer: groma_localization::Options,
    #[serde(flatten)]
    unknown: BTreeMap<String, IgnoredAny>,
}

impl TryFrom<Raw> for Options {
    type Error = String;

    fn try_from(raw: Raw) -> Result<Self, String> {
        match raw.unknown.keys().next() {
            Some(name) => Err(format!("unknown setting {name}")),
            None => {
                let Raw { lateness, odometry, relocalize, localizer, .. } = raw;
                Ok(Self { lateness, odometry, relocalize, localizer })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Options, String> {
        serde_json::from_str(text).map_err(|e| e.to_string())
    }

    #[test]
    fn what_is_written_reads_back_and_what_is_left_out_has_its_default() {
        let options = Options { lateness: 0.25, ..Options::default() };
        assert_eq!(parse(&serde_json::to_string(&options).unwrap()), Ok(options));
        assert_eq!(parse("{}"), Ok(Options::default()));
        let mixed = parse(r#"{"mode": "mixed", "odometry": {"along": 0.1}}"#).unwrap();
        assert_eq!(mixed.localizer.mode, groma_localization::Mode::Mixed);
        assert_eq!(mixed.odometry.along, 0.1);
        let sure = parse(r#"{"relocalize": {"confident": 0.9}}"#).unwrap();
        assert_eq!(sure.relocalize, RelocalizeOptions { confident: 0.9, ..RelocalizeOptions::default() });
    }

    #[test]
    fn unknown_names_and_numbers_out_of_range_are_refused_by_name() {
        assert!(parse(r#"{"latenes": 1.0}"#).unwrap_err().contains("latenes"));
        assert!(parse(r#"{"dynamic": {"hit": 1}}"#).unwrap_err().contains("hit"));
        for bad in [-1.0, f64::NAN, 1e300] {
            let error = Options { lateness: bad, ..Options::default() }.validate().unwrap_err();
            assert!(error.to_string().starts_with("lateness"));
        }
        let gate = groma_localization::Options { gate: 2.0, ..groma_localization::Options::default() };
        assert!(Options { localizer: gate, ..Options::default() }.validate().is_err());
        assert!(parse(r#"{"relocalize": {"confidence": 0.9}}"#).unwrap_err().contains("confidence"));
        let relocalize = RelocalizeOptions { confident: 1.5, ..RelocalizeOptions::default() };
        assert!(Options { relocalize, ..Options::default() }.validate().is_err());
        assert!(Options::default().validate().is_ok());
    }
}

//! The findings of a calibration: undetermined parameters, misfits of the model, tolerances that are not reached.

use super::gate::{LeftOut, Reason};
use super::segments::SegmentKind;
use groma_calibration::vehicle::Calibration;
use groma_models::Finding;
use groma_models::finding::Code;
use std::collections::BTreeMap;

/// A test that fails so seldom if the model holds contradicts it.
const LEVEL: f64 = 0.01;
/// Residuals this much larger than stated contradict the model.
const NOISY: f64 = 2.0;
/// Confidence of the intervals that are compared with tolerances.
pub const CONFIDENCE: f64 = 0.95;
/// So many times as much of the same driving is no advice.
const ENDLESS: f64 = 50.0;

/// Findings on an estimate.
pub(super) fn findings(found: &Calibration, segments: SegmentKind) -> Vec<Finding> {
    let assumed = found.notes.iter().map(|note| Finding::new(Code::ParametersAssumed, note.clone()));
    let open = found.weak.iter().map(|weak| Finding::new(Code::ParameterOpen, weak.words.clone()));
    let unsettled = (!found.converged).then(|| {
        Finding::new(
            Code::NotConverged,
            "the estimate still moved when it was ended: its values and intervals are not settled",
        )
    });
    let tests = found.tests.iter().filter(|t| t.p_value < LEVEL).filter_map(|t| {
        let text = against(t.name)?;
        Some(Finding::new(Code::ModelMisfit, text).with("p", t.p_value, "1").with("statistic", t.statistic, "1"))
    });
    let noisy = (found.noise_scale > NOISY).then(|| noisy(found, segments));
    assumed.chain(open).chain(unsettled).chain(tests).chain(noisy).collect()
}

fn against(test: &str) -> Option<&'static str> {
    match test {
        "direction" => Some("motions forward and backward miss differently"),
        "speed" => Some("slow and fast motions miss differently"),
        "steering" => Some("motions to the left and right miss differently"),
        _ => None,
    }
}

fn noisy(found: &Calibration, segments: SegmentKind) -> Finding {
    let hides_a_delay = segments == SegmentKind::Windows && found.layout.position("delay").is_none();
    let perhaps = if hides_a_delay { ", perhaps a delay: try --free delay" } else { "" };
    let text = format!(
        "residuals are {:.1} times as large as the scans and the usual slip explain: something is not in the model{perhaps}",
        found.noise_scale
    );
    Finding::new(Code::ModelMisfit, text).with("noise_scale", found.noise_scale, "1")
}

/// Motions that were left out, a finding a reason.
pub(super) fn left_out(all: &[LeftOut]) -> Vec<Finding> {
    let mut by_reason: BTreeMap<Reason, (usize, f64, f64)> = BTreeMap::new();
    for LeftOut { reason, span } in all {
        let entry = by_reason.entry(*reason).or_insert((0, span.0, span.1));
        *entry = (entry.0 + 1, entry.1.min(span.0), entry.2.max(span.1));
    }
    let finding = |(reason, (count, from, to)): (Reason, (usize, f64, f64))| {
        let text = format!("{count} motions left out: {}", reason.text());
        Finding::new(Code::MotionsLeftOut, text).during(from, to).with("count", count as f64, "1")
    };
    by_reason.into_iter().map(finding).collect()
}

/// What is not yet known as well as wanted: a finding a parameter whose half-width exceeds its tolerance.
///
/// Half-widths fall with the root of the driving, of the same kind.
#[must_use]
pub fn missed(found: &Calibration, tolerances: &BTreeMap<String, f64>) -> Vec<Finding> {
    let widths = found.half_widths(CONFIDENCE);
    let names = found.layout.names();
    let miss = |(k, name): (usize, &&'static str)| {
        let tolerance = *tolerances.get(*name)?;
        let more = more_driving(widths[k], tolerance);
        (more > 1.0).then(|| {
            let advice = if more < ENDLESS {
                format!("drive about {more:.1} times as much of the same")
            } else {
                "drive something else".into()
            };
            let unit = unit(name);
            let finding =
                Finding::new(Code::ToleranceMissed, format!("{name} is not yet within its tolerance: {advice}"));
            let finding = finding.with("tolerance", tolerance, unit).with("driving", more, "1");
            if widths[k].is_finite() { finding.with("half_width", widths[k], unit) } else { finding }
        })
    };
    names.iter().enumerate().filter_map(miss).collect()
}

/// How many times the driving so far it takes to bring a half-width to a tolerance; 1 where it is there.
#[must_use]
pub fn more_driving(half_width: f64, tolerance: f64) -> f64 {
    (half_width / tolerance).powi(2).max(1.0)
}

fn unit(name: &str) -> &'static str {
    match name {
        "delay" => "s",
        "steering_gain" => "1",
        _ if name.starts_with("steering_offset") || name == "laser_yaw" => "rad",
        _ => "m",
    }
}

//! Settings of the detector.

use crate::options::{InvalidOption, require};
use serde::{Deserialize, Serialize};

/// How scored beams become corners.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Definition {
    /// Score over its maximum, threshold the same for all scans, one corner a neighbourhood.
    Normalised,
    /// As published: the sum, a threshold relative to the worst of the scan, a search along the beams.
    Published,
}

/// Settings of FALKO; the default suits 0.25 to 1 degree scanners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Radius of the neighbourhood at range zero [m].
    pub a: f64,
    /// Growth of its logarithm with range [1/m].
    pub b: f64,
    /// Nearer beams are no corners [m].
    pub range_min: f64,
    /// Farther beams are no corners [m].
    pub range_max: f64,
    /// Points a corner needs on each side.
    pub min_side_points: usize,
    /// Radius over the least base and height of the corner's triangle.
    pub beta: f64,
    /// Sectors of the ring on which the score is counted, even.
    pub sectors: u32,
    /// How scored beams become corners.
    pub definition: Definition,
    /// Score that a corner must stay below, of the normalised definition.
    pub threshold: f64,
    /// Share of the worst score of the scan by which a corner must be better, of the published definition [percent].
    pub threshold_percent: u32,
    /// Radius within which only the best corner stays, of the published definition [m]; of the normalised one it is that of the
    /// neighbourhood.
    pub suppression_radius: f64,
    /// Whether the corner is placed between the beams, where its two lines meet.
    pub sub_beam: bool,
    /// Least standard deviation of a range, for the covariance of the corner [m].
    pub range_noise: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            a: 0.2,
            b: 0.07,
            range_min: 0.05,
            range_max: 30.0,
            min_side_points: 2,
            beta: 2.5,
            sectors: 16,
            definition: Definition::Normalised,
            threshold: 0.15,
            threshold_percent: 50,
            suppression_radius: 0.1,
            sub_beam: true,
            range_noise: 0.01,
        }
    }
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        require(positive(self.a), "a", self.a, "above 0 m")?;
        require(self.b.is_finite() && self.b >= 0.0, "b", self.b, "0 /m or more")?;
        require(positive(self.range_min), "range_min", self.range_min, "above 0 m")?;
        require(self.range_max > self.range_min, "range_max", self.range_max, "above range_min")?;
        let points = self.min_side_points;
        require(points >= 1, "min_side_points", points as f64, "1 or more")?;
        require(self.beta >= 1.0 && self.beta.is_finite(), "beta", self.beta, "1 or more")?;
        let even = self.sectors >= 2 && self.sectors.is_multiple_of(2) && self.sectors <= 360;
        require(even, "sectors", f64::from(self.sectors), "even, 2 to 360")?;
        require(self.threshold > 0.0 && self.threshold <= 1.0, "threshold", self.threshold, "above 0, to 1")?;
        let percent = self.threshold_percent;
        require(percent <= 100, "threshold_percent", f64::from(percent), "0 to 100")?;
        let radius = self.suppression_radius;
        require(radius.is_finite() && radius >= 0.0, "suppression_radius", radius, "0 m or more")?;
        require(positive(self.range_noise), "range_noise", self.range_noise, "above 0 m")
    }
}

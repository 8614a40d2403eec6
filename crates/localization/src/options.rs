//! Settings of the localizer.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Which landmarks update the pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Those of the map.
    #[default]
    Static,
    /// Corners found during the drive; the map is not used.
    Dynamic,
    /// Those of the map, and corners found during the drive.
    Mixed,
    /// The reflectors of the map.
    Reflectors,
    /// Those of the map and corners found during the drive, all of them estimated together with the pose (EKF-SLAM).
    Slam,
}

impl Mode {
    /// Whether landmarks are created during the drive.
    #[must_use]
    pub fn creates(self) -> bool {
        matches!(self, Self::Dynamic | Self::Mixed | Self::Slam)
    }

    /// Whether the walls of the map constrain the pose where landmarks do not.
    #[must_use]
    pub fn uses_walls(self) -> bool {
        matches!(self, Self::Static | Self::Mixed)
    }

    /// Whether the map is used.
    #[must_use]
    pub fn uses_map(self) -> bool {
        self != Self::Dynamic
    }
}

/// Settings of the localizer; the default suits a scanner of a quarter to half a degree in a warehouse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Which landmarks update the pose.
    pub mode: Mode,
    /// Share of true pairs that pass the gates, individual and joint.
    pub gate: f64,
    /// Corners are paired when their orientations differ by less than this [rad] ...
    pub orientation_max: f64,
    /// ... and at most so many of the 128 cells of their descriptors.
    pub descriptor_max: u32,
    /// Steps of the joint search, at most; beyond, mutual nearest neighbours that are clearly nearest.
    pub max_nodes: usize,
    /// Observations beyond this range are not used [m].
    pub range_max: f64,
    /// Landmarks of the map whose error is remembered from scan to scan, at most.
    pub memory: usize,
    /// Landmarks found during the drive.
    pub dynamic: DynamicOptions,
    /// When the localizer is lost.
    pub lost: LostOptions,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            mode: Mode::Static,
            gate: 0.999,
            orientation_max: 0.9,
            descriptor_max: 64,
            max_nodes: 2000,
            range_max: 30.0,
            memory: 96,
            dynamic: DynamicOptions::default(),
            lost: LostOptions::default(),
        }
    }
}

/// The life of a landmark found during the drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DynamicOptions {
    /// A corner this far from every landmark begins a new one [m].
    pub separation: f64,
    /// It updates the pose after so many sightings,
    pub hits: u32,
    /// which must be made within so many scans that could see it.
    pub trial: u32,
    /// It is refined up to so many sightings.
    pub refined: u32,
    /// It is forgotten after so many scans in a row that could see it and did not,
    pub misses: u32,
    /// or when the share of scans that saw it falls below this,
    pub share_min: f64,
    /// or when it was not seen over such a distance [m],
    pub way_max: f64,
    /// or time [s].
    pub time_max: f64,
    /// Landmarks found during the drive that are kept, at most.
    pub count_max: usize,
    /// In mixed mode they are begun while the standard deviation of the position is below this [m].
    pub anchor_sigma: f64,
}

impl Default for DynamicOptions {
    fn default() -> Self {
        Self {
            separation: 0.3,
            hits: 3,
            trial: 5,
            refined: 20,
            misses: 5,
            share_min: 0.3,
            way_max: 15.0,
            time_max: 60.0,
            count_max: 100,
            anchor_sigma: 0.02,
        }
    }
}

/// When the localizer says that it is lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LostOptions {
    /// Evidence for being lost against being right at which it says so: a ratio of likelihoods.
    pub evidence: f64,
    /// Standard deviation of the position beyond which it is lost without further evidence [m].
    pub sigma_max: f64,
}

impl Default for LostOptions {
    fn default() -> Self {
        Self { evidence: 1e6, sigma_max: 2.0 }
    }
}

/// A setting outside its range.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name} = {value}: it must be {rule}")]
pub struct InvalidOption {
    /// Name of the setting.
    pub name: &'static str,
    /// The value given.
    pub value: f64,
    /// What it must be.
    pub rule: &'static str,
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        let (d, l) = (&self.dynamic, &self.lost);
        let share = |name, v: f64| require(v > 0.0 && v < 1.0, name, v, "above 0 and below 1");
        let positive = |name, v: f64| require(v > 0.0 && v.is_finite(), name, v, "above 0");
        let counted = |name, v: usize| require(v >= 1, name, v as f64, "1 or more");
        share("gate", self.gate)?;
        positive("orientation_max", self.orientation_max)?;
        counted("max_nodes", self.max_nodes)?;
        positive("range_max", self.range_max)?;
        counted("memory", self.memory)?;
        positive("dynamic.separation", d.separation)?;
        counted("dynamic.hits", d.hits as usize)?;
        require(d.trial >= d.hits, "dynamic.trial", f64::from(d.trial), "as many as dynamic.hits or more")?;
        counted("dynamic.misses", d.misses as usize)?;
        require((0.0..1.0).contains(&d.share_min), "dynamic.share_min", d.share_min, "0 or more and below 1")?;
        positive("dynamic.way_max", d.way_max)?;
        positive("dynamic.time_max", d.time_max)?;
        counted("dynamic.count_max", d.count_max)?;
        positive("dynamic.anchor_sigma", d.anchor_sigma)?;
        require(l.evidence > 1.0 && l.evidence.is_finite(), "lost.evidence", l.evidence, "above 1")?;
        positive("lost.sigma_max", l.sigma_max)
    }
}

/// An error unless `holds`.
pub(crate) fn require(holds: bool, name: &'static str, value: f64, rule: &'static str) -> Result<(), InvalidOption> {
    if holds { Ok(()) } else { Err(InvalidOption { name, value, rule }) }
}

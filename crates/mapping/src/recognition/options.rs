//! Settings of place recognition.

use groma_features::{InvalidOption, association, falko, require};
use serde::{Deserialize, Serialize};

/// Settings of [`Recognizer`](super::Recognizer).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Options {
    /// Corner features.
    pub corners: falko::Options,
    /// Association of the corners of two local maps.
    pub association: association::Options,
    /// Path that a local map covers at most [m].
    pub length: f64,
    /// Path between the ends of successive local maps [m].
    pub step: f64,
    /// Path between the ends of two local maps from which on the later may be a return to the earlier [m].
    pub gap: f64,
    /// Translation between two scans from which on the track may be wrong, so that local maps begin anew [m].
    pub leap: f64,
    /// Rotation from which on it may be [rad].
    pub leap_turn: f64,
    /// Corners of two maps may be one when they open into the same direction to within this [rad].
    pub facing: f64,
    /// Local maps retrieved for each.
    pub candidates: usize,
    /// Path between the ends of those retrieved, at least [m].
    pub spacing: f64,
    /// Motions verified for each.
    pub verified: usize,
    /// Least overlap of the views of a closure.
    pub overlap: f64,
    /// Least share of a closure on surfaces, and in common view.
    pub support: f64,
    /// Another pose in the same place with an overlap within this of the best makes it ambiguous.
    pub rival: f64,
    /// Greatest standard deviation of the position along the weakest direction [m].
    pub slides: f64,
    /// Path between two closures that confirm each other, at least [m].
    pub confirmed_from: f64,
    /// The same, at most [m].
    pub confirmed_within: f64,
    /// How well they must agree [m].
    pub agreement: f64,
    /// The same [rad].
    pub agreement_turn: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            corners: falko::Options::default(),
            // Three corners and their directions are enough to propose; surfaces and views decide.
            association: association::Options {
                min_pairs: 3,
                max_hypotheses: 3,
                max_motions: 20_000,
                ..association::Options::default()
            },
            length: 10.0,
            step: 0.5,
            gap: 10.0,
            leap: 0.9,
            leap_turn: 1.3,
            facing: 0.6,
            candidates: 30,
            spacing: 1.5,
            verified: 12,
            overlap: 0.85,
            support: 0.35,
            rival: 0.05,
            slides: 0.1,
            confirmed_from: 2.0,
            confirmed_within: 6.0,
            agreement: 0.3,
            agreement_turn: 0.1,
        }
    }
}

impl Options {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), InvalidOption> {
        self.corners.validate()?;
        self.association.validate()?;
        let positive = |name, x: f64| require(x.is_finite() && x > 0.0, name, x, "above 0");
        positive("length", self.length)?;
        positive("step", self.step)?;
        require(self.gap >= self.length, "gap", self.gap, "length or more: local maps must not share scans")?;
        positive("leap", self.leap)?;
        positive("leap_turn", self.leap_turn)?;
        positive("facing", self.facing)?;
        require(self.candidates >= 1, "candidates", self.candidates as f64, "1 or more")?;
        require(self.spacing >= 0.0, "spacing", self.spacing, "0 m or more")?;
        require(self.verified >= 1, "verified", self.verified as f64, "1 or more")?;
        let share = |name, x: f64| require((0.0..=1.0).contains(&x), name, x, "0 to 1");
        share("overlap", self.overlap)?;
        share("support", self.support)?;
        share("rival", self.rival)?;
        positive("slides", self.slides)?;
        let from = self.confirmed_from;
        require(from >= 0.0, "confirmed_from", from, "0 m or more")?;
        require(self.confirmed_within >= from, "confirmed_within", self.confirmed_within, "confirmed_from or more")?;
        positive("agreement", self.agreement)?;
        positive("agreement_turn", self.agreement_turn)
    }
}

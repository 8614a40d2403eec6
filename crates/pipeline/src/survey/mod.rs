//! A building's cameras, surveyed by a robot that carries a target: odometry and detections in, the map of the network out.
//!
//! ```text
//! odometry   -> standstill: does the robot stand, at which stop?          state()
//! detections -> views of each camera                                      state()
//! both       -> stops, averaged sightings, filter, gates, batch           finish() -> map, findings
//! ```
//!
//! Live and from a file it is this machine. What it tells while the survey runs ([`SurveyCameras::state`]) follows the order
//! of arrival; the map does not: messages may come late and twice, the same set gives the same bytes
//! ([`groma_network::survey`]). So nothing needs to be put into order first, and `finish` may be called at any time and again
//! after more messages: it is the snapshot too.
//!
//! Detections that carry the number of a stop belong to it whatever the clocks say; others to where the odometry has the
//! robot at their stamp.

mod findings;

use crate::Message;
use crate::message::Detections;
use groma_models::{Finding, Odometry, Target, Token};
use groma_network::standstill::Standstill;
use groma_network::survey::{Detection, KnownCamera};
use groma_network::{Error, NetworkMap, Options, Survey};
use nalgebra::Vector2;
use std::collections::BTreeSet;

/// What a camera has contributed so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Views {
    /// Images in which it saw the target.
    pub images: usize,
    /// Stops at which it did.
    pub stops: usize,
}

/// How far a survey is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct State {
    /// Number of the stop that lasts, from 0; none while the robot moves.
    pub stop: Option<usize>,
    /// Stops so far.
    pub stops: usize,
    /// What each camera has seen, by its number.
    pub views: Vec<Views>,
}

/// The map of a network and what was noticed.
#[derive(Clone, Debug)]
pub struct Surveyed {
    /// The map.
    pub map: NetworkMap,
    /// What was noticed, the weightiest first.
    pub findings: Vec<Finding>,
}

/// Messages that came and those that were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Readings of the odometry that were taken.
    pub odometry: usize,
    /// Readings that are not finite.
    pub odometry_invalid: usize,
    /// Detections that were taken.
    pub detections: usize,
    /// Detections of no camera or panel of the survey, with a number that is not finite, or of sizes that do not fit.
    pub detections_invalid: usize,
}

/// Which stop an image was taken at: one with a number of its own, or one that the odometry told.
type StopKey = (bool, u64);

#[derive(Clone, Debug, Default)]
struct Seen {
    images: usize,
    last_image: Option<f64>,
    stops: BTreeSet<StopKey>,
}

/// The machine.
#[derive(Clone, Debug)]
pub struct SurveyCameras {
    survey: Survey,
    standstill: Standstill,
    stops: usize,
    seen: Vec<Seen>,
    counts: Counts,
}

impl SurveyCameras {
    /// A survey with a target on the robot, of cameras as they are known before.
    ///
    /// # Errors
    /// [`Error::NoData`] for a target that makes no sense or a covariance of a wrong size.
    pub fn new(target: Target, cameras: Vec<KnownCamera>) -> Result<Self, Error> {
        let seen = vec![Seen::default(); cameras.len()];
        let survey = Survey::new(target, cameras)?;
        Ok(Self { survey, standstill: Standstill::default(), stops: 0, seen, counts: Counts::default() })
    }

    /// Takes a message; false when it makes no sense or is of a kind that a survey does not use, and was left out.
    pub fn push(&mut self, message: Message) -> bool {
        match message {
            Message::Odometry(reading) => self.drive(reading),
            Message::Detections(detections) => self.look(detections),
            _ => false,
        }
    }

    /// How far the survey is.
    #[must_use]
    pub fn state(&self) -> State {
        let views = self.seen.iter().map(|s| Views { images: s.images, stops: s.stops.len() }).collect();
        State { stop: self.stop(), stops: self.stops, views }
    }

    /// Messages taken and left out.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// The map of all that has come.
    ///
    /// # Errors
    /// [`Error::Setting`]; [`Error::NoData`] when no camera saw the target while the odometry ran; [`Error::Cancelled`];
    /// what the batch says.
    pub fn finish(&self, options: &Options, token: &Token) -> Result<Surveyed, Error> {
        let map = self.survey.finish(options, token)?;
        let findings = findings::findings(&map, self.survey.cameras(), self.counts, options);
        Ok(Surveyed { map, findings })
    }

    fn stop(&self) -> Option<usize> {
        if self.standstill.stands() { self.stops.checked_sub(1) } else { None }
    }

    fn drive(&mut self, reading: Odometry) -> bool {
        if !self.survey.push_odometry(reading.stamp, reading.pose) {
            self.counts.odometry_invalid += 1;
            return false;
        }
        self.counts.odometry += 1;
        let stood = self.standstill.stands();
        if self.standstill.push(reading) && !stood {
            self.stops += 1;
        }
        true
    }

    fn look(&mut self, detections: Detections) -> bool {
        let (camera, stamp, stop) = (detections.camera, detections.stamp, detections.stop);
        let taken = detection(detections).is_some_and(|d| self.survey.push_detection(d));
        if !taken {
            self.counts.detections_invalid += 1;
            return false;
        }
        self.counts.detections += 1;
        let here = stop.map(|number| (true, number)).or_else(|| self.stop().map(|number| (false, number as u64)));
        if let Some(seen) = self.seen.get_mut(camera) {
            seen.images += usize::from(seen.last_image != Some(stamp));
            seen.last_image = Some(stamp);
            seen.stops.extend(here);
        }
        true
    }
}

/// None when a corner has a number that no panel has.
fn detection(of: Detections) -> Option<Detection> {
    let ids = of.corners.iter().map(|c| u32::try_from(c.0).ok()).collect::<Option<Vec<u32>>>()?;
    let pixels = of.corners.iter().map(|c| Vector2::new(c.1, c.2)).collect();
    let sigmas = of.corners.iter().map(|c| c.3).collect();
    Some(Detection { stamp: of.stamp, camera: of.camera, panel: of.panel, stop: of.stop, ids, pixels, sigmas })
}

#[cfg(test)]
mod tests;

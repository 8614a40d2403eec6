//! Which landmarks an observation may be: of its kind, turned alike, with like surroundings, and within the gate.
//!
//! ```text
//! D^2 = v^T S^-1 v < chi2(2, p),   S = H P H^T + R       P of pose, mount and landmark together
//! ```
//!
//! Looked for within the radius that the gate can reach at most: `chi2 tr(cov of the sighted place)`. A landmark of known
//! identity passes the same gate.

use crate::jcbb::Candidate;
use crate::joint::{Joint, Linear, inverse};
use crate::map::StaticMap;
use crate::measurement::{Viewpoint, residual};
use crate::memory::Memory;
use crate::observation::Observation;
use crate::options::{Mode, Options};
use groma_geometry::{Se2, wrap};
use groma_models::{Landmark, LandmarkKind};
use nalgebra::{Matrix2, Vector2};

/// What is known of all landmarks when a scan comes.
pub(crate) struct Gating<'a> {
    pub joint: &'a Joint,
    pub map: &'a StaticMap,
    pub memory: &'a Memory,
    pub options: &'a Options,
    /// chi2(2, p) of the gate.
    pub gate: f64,
}

/// An observation and the laser that made it, seen from the vehicle at the time of the filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighted<'a> {
    pub observation: &'a Observation,
    pub laser: Se2,
}

/// What tells landmarks apart besides their place.
struct Look {
    kind: LandmarkKind,
    orientation: Option<f64>,
    descriptor: Option<u128>,
}

impl Gating<'_> {
    /// All landmarks that an observation may be.
    pub fn candidates(&self, sighted: &Sighted<'_>) -> Vec<Candidate> {
        let view = Viewpoint { pose: self.joint.pose(), laser: sighted.laser };
        let mut found = Vec::new();
        if let Some(landmark) = sighted.observation.identity {
            found.extend(self.of_map(landmark, &view, sighted.observation));
            return found;
        }
        let (place, radius) = self.reach(&view, sighted.observation);
        let heading = (view.pose * view.laser).theta();
        if self.options.mode.uses_map() {
            self.map.near(place, radius, |k, landmark| {
                if self.looks_alike(sighted.observation, heading, &Look::of(landmark)) {
                    found.extend(self.of_map(k, &view, sighted.observation));
                }
            });
        }
        for (slot, landmark) in self.memory.all_found() {
            let near = (self.joint.points()[slot] - place).norm_squared() <= radius * radius;
            let look = Look { kind: landmark.kind, orientation: landmark.orientation, descriptor: landmark.descriptor };
            if near && self.looks_alike(sighted.observation, heading, &look) {
                let linear =
                    linearize(&view, sighted.observation, self.joint.points()[slot], Some(slot), &Matrix2::zeros());
                found.extend(linear.and_then(|linear| self.gated(landmark.id, linear)));
            }
        }
        found
    }

    /// Where the observation lies in the map, and how far from there a landmark may be that it shows.
    fn reach(&self, view: &Viewpoint, observation: &Observation) -> (Vector2<f64>, f64) {
        let begun = view.begin(observation.polar);
        let from_pose = begun.by_pose * self.joint.pose_covariance() * begun.by_pose.transpose();
        let own = begun.by_polar * observation.covariance * begun.by_polar.transpose();
        let variance = from_pose.trace() + own.trace() + self.map.variance_max;
        // The gate is an ellipse in range and bearing, bent in the plane: a tenth more, and a millimetre, cover it.
        (begun.position, 1.1 * (self.gate * variance).sqrt() + 1e-3)
    }

    fn looks_alike(&self, observation: &Observation, heading: f64, look: &Look) -> bool {
        let turned = match (observation.orientation, look.orientation) {
            (Some(seen), Some(known)) => wrap(heading + seen - known).abs() <= self.options.orientation_max,
            _ => true,
        };
        let described = match (observation.descriptor, look.descriptor) {
            (Some(seen), Some(known)) => (seen ^ known).count_ones() <= self.options.descriptor_max,
            _ => true,
        };
        observation.kind == look.kind
            && turned
            && described
            && (self.options.mode != Mode::Reflectors || look.kind == LandmarkKind::Reflector)
    }

    fn of_map(&self, k: usize, view: &Viewpoint, observation: &Observation) -> Option<Candidate> {
        let landmark = self.map.landmarks().get(k)?;
        let slot = self.memory.slot_of(k);
        let (point, own) = match slot {
            Some(slot) => (self.joint.points()[slot], Matrix2::zeros()),
            None => (landmark.position, landmark.covariance),
        };
        self.gated(k, linearize(view, observation, point, slot, &own)?)
    }

    fn gated(&self, landmark: usize, linear: Linear) -> Option<Candidate> {
        let covariance = self.joint.innovation_covariance(&linear);
        let distance_sq = linear.residual.dot(&(inverse(&covariance)? * linear.residual));
        (distance_sq <= self.gate).then_some(Candidate { landmark, linear, covariance, distance_sq, doubt: None })
    }
}

impl Look {
    fn of(landmark: &Landmark) -> Self {
        Self { kind: landmark.kind, orientation: landmark.orientation, descriptor: landmark.descriptor }
    }
}

/// The sighting of a landmark at `point` as a linear function of the state; `own` is the covariance of a landmark without
/// slot. None where the landmark lies on the laser.
pub(crate) fn linearize(
    view: &Viewpoint,
    observation: &Observation,
    point: Vector2<f64>,
    slot: Option<usize>,
    own: &Matrix2<f64>,
) -> Option<Linear> {
    let sight = view.sight(point)?;
    let j = sight.by_landmark;
    Some(Linear {
        residual: residual(observation.polar, sight.polar),
        by_pose: sight.by_pose,
        by_mount: sight.by_mount,
        landmark: slot.map(|slot| (slot, j)),
        noise: observation.covariance + j * own * j.transpose(),
    })
}

//! What was seen of late, brought together by the odometry: landmarks seen more than once become one, beams stay beams.
//!
//! The frame is that of the vehicle at the last motion. Errors of the odometry over the few metres that are kept are
//! neglected against the tolerance of the search.

use crate::observation::Observation;
use groma_geometry::{Se2, wrap};
use groma_models::{BeamGeometry, LandmarkKind};
use nalgebra::{Matrix2, Vector2};

/// Sightings of like landmarks this close are one [m].
const MERGE: f64 = 0.2;
/// Beams kept of a scan, and scans of which beams are kept, at most.
const BEAMS: usize = 90;
const SCANS: usize = 12;
/// A scan's beams are kept this far from those before [m], [rad].
const APART: (f64, f64) = (0.4, 0.3);
/// Landmarks kept, at most: the latest.
const MOST: usize = 120;

/// A landmark in the frame of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// What it is.
    pub kind: LandmarkKind,
    /// Mean of its sightings [m].
    pub point: Vector2<f64>,
    /// Covariance of the best of them [m^2].
    pub covariance: Matrix2<f64>,
    /// Direction into which the corner opens [rad].
    pub orientation: Option<f64>,
    /// Binary cells around it.
    pub descriptor: Option<u128>,
    /// Number of sightings.
    pub sightings: u32,
    /// Way at which it was last seen [m].
    way: f64,
}

/// A beam in the frame of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Where the laser stood [m].
    pub from: Vector2<f64>,
    /// Its direction.
    pub direction: Vector2<f64>,
    /// What it read [m].
    pub range: f64,
}

/// The last metres of a drive.
#[derive(Clone, Debug, Default)]
pub struct LocalView {
    landmarks: Vec<Seen>,
    beams: Vec<Vec<Beam>>,
    /// Motion since beams were kept last.
    since: Option<Se2>,
    way: f64,
}

impl LocalView {
    /// The vehicle has moved.
    pub fn advance(&mut self, motion: &Se2) {
        let inverse = motion.inverse();
        let turn = inverse.theta();
        for seen in &mut self.landmarks {
            let r = inverse.rotation.matrix();
            seen.point = inverse.act(seen.point);
            seen.covariance = r * seen.covariance * r.transpose();
            seen.orientation = seen.orientation.map(|o| wrap(o + turn));
        }
        for beam in self.beams.iter_mut().flatten() {
            beam.from = inverse.act(beam.from);
            beam.direction = inverse.rotation.act(beam.direction);
        }
        self.since = self.since.map(|s| s * *motion);
        self.way += motion.translation.norm();
    }

    /// Observations of a scan, each with the laser as the vehicle has it now.
    pub fn see(&mut self, observations: &[(Observation, Se2)]) {
        for (o, laser) in observations.iter().filter(|(o, _)| o.is_usable()) {
            let seen = Seen::new(o, laser, self.way);
            let twin = |s: &&mut Seen| s.kind == seen.kind && (s.point - seen.point).norm() < MERGE;
            match self.landmarks.iter_mut().find(twin) {
                Some(known) => known.merge(&seen),
                None => self.landmarks.push(seen),
            }
        }
        let surplus = self.landmarks.len().saturating_sub(MOST);
        self.landmarks.drain(..surplus);
    }

    /// Beams of a scan, made by a laser that the vehicle has at `laser` now.
    pub fn look(&mut self, geometry: &BeamGeometry, ranges: &[f64], laser: &Se2) {
        let moved = self.since.map_or((f64::INFINITY, 0.0), |s| (s.translation.norm(), s.theta().abs()));
        if moved.0 < APART.0 && moved.1 < APART.1 {
            return;
        }
        let hits = ranges.iter().enumerate().filter(|(_, r)| geometry.is_hit(**r));
        let stride = ranges.len().div_ceil(BEAMS).max(1);
        let beam = |(k, range): (usize, &f64)| {
            let (sin, cos) = geometry.bearing(k).sin_cos();
            Beam { from: laser.translation, direction: laser.rotation.act(Vector2::new(cos, sin)), range: *range }
        };
        self.beams.push(hits.step_by(stride).map(beam).collect());
        if self.beams.len() > SCANS {
            self.beams.remove(0);
        }
        self.since = Some(Se2::IDENTITY);
    }

    /// Forgets what was seen more than `way` [m] ago.
    pub fn forget_beyond(&mut self, way: f64) {
        let now = self.way;
        self.landmarks.retain(|s| now - s.way <= way);
    }

    /// Landmarks in the frame of the vehicle.
    #[must_use]
    pub fn landmarks(&self) -> &[Seen] {
        &self.landmarks
    }

    /// Beams in the frame of the vehicle, scan by scan.
    #[must_use]
    pub fn beams(&self) -> &[Vec<Beam>] {
        &self.beams
    }

    /// Way driven since the beginning [m].
    #[must_use]
    pub fn way(&self) -> f64 {
        self.way
    }
}

impl Seen {
    fn new(o: &Observation, laser: &Se2, way: f64) -> Self {
        let (sin, cos) = o.polar.y.sin_cos();
        let r = laser.rotation.matrix();
        let j = r * Matrix2::new(cos, -o.polar.x * sin, sin, o.polar.x * cos);
        Self {
            kind: o.kind,
            point: laser.act(Vector2::new(cos, sin) * o.polar.x),
            covariance: j * o.covariance * j.transpose(),
            orientation: o.orientation.map(|a| wrap(a + laser.theta())),
            descriptor: o.descriptor,
            sightings: 1,
            way,
        }
    }

    fn merge(&mut self, other: &Self) {
        self.sightings += 1;
        self.point += (other.point - self.point) / f64::from(self.sightings);
        self.way = other.way;
        if other.covariance.trace() < self.covariance.trace() {
            self.covariance = other.covariance;
            self.orientation = other.orientation.or(self.orientation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observation(range: f64, bearing: f64) -> Observation {
        let covariance = Matrix2::from_diagonal(&Vector2::new(1e-4, 4e-6));
        Observation {
            orientation: Some(0.5),
            polar: Vector2::new(range, bearing),
            ..Observation::at_point(0.0, Vector2::x(), covariance)
        }
    }

    #[test]
    fn a_landmark_seen_on_the_way_stays_one() {
        let (mount, place) = (Se2::new(0.3, 0.0, 0.1), Vector2::new(6.0, 2.0));
        let (mut view, mut pose) = (LocalView::default(), Se2::IDENTITY);
        for _ in 0..20 {
            let q = (pose * mount).inverse().act(place);
            view.see(&[(observation(q.norm(), q.y.atan2(q.x)), mount)]);
            let step = Se2::new(0.1, 0.0, 0.05);
            view.advance(&step);
            pose = pose * step;
        }
        assert_eq!((view.landmarks().len(), view.landmarks()[0].sightings), (1, 20));
        assert!((pose.act(view.landmarks()[0].point) - place).norm() < 1e-12);
        view.forget_beyond(5.0);
        assert_eq!(view.landmarks().len(), 1);
        view.advance(&Se2::new(6.0, 0.0, 0.0));
        view.forget_beyond(5.0);
        assert!(view.landmarks().is_empty());
    }

    #[test]
    fn beams_of_scans_close_by_are_not_kept() {
        let geometry = BeamGeometry {
            angle_min: -1.5,
            angle_increment: 0.01,
            time_increment: 0.0,
            range_min: 0.1,
            range_max: 20.0,
        };
        let mut view = LocalView::default();
        for _ in 0..100 {
            view.look(&geometry, &[5.0; 300], &Se2::IDENTITY);
            view.advance(&Se2::new(0.1, 0.0, 0.0));
        }
        assert_eq!(view.beams().len(), SCANS);
        assert!(view.beams().iter().all(|b| b.len() <= BEAMS));
        let mut broken = LocalView::default();
        broken.look(&geometry, &[f64::NAN, 0.0, f64::INFINITY], &Se2::IDENTITY);
        broken.look(&geometry, &[], &Se2::IDENTITY);
        assert!(broken.beams().iter().all(Vec::is_empty));
    }
}

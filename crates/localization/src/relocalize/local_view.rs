//! What was seen recently, brought together: landmarks seen more than once become one, scans lie on each other.
//!
//! The frame of a view is where the vehicle was when it began. The odometry moves the vehicle in it; a scan that is kept is
//! registered to those before, with the odometry as prior, for the odometry of a lost vehicle may be any.

use crate::beams::{Beam, beams};
use crate::observation::Observation;
use groma_geometry::{Se2, wrap};
use groma_models::{LandmarkKind, LaserScan};
use groma_registration::{Prior, SurfaceMap, SurfaceScan, align};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::collections::HashSet;

/// Sightings of like landmarks this close are one [m].
const MERGE: f64 = 0.2;
/// Scans that are kept, at most.
const SCANS: usize = 12;
/// A scan is kept this far from the one before [m], [rad].
const APART: (f64, f64) = (0.4, 0.3);
/// What the odometry between two scans is trusted to: [m] and [rad], and shares of the distance and the turn.
const ODOMETRY: (f64, f64, f64) = (0.02, 0.1, 0.15);
/// Degrees of freedom of its prior: it may be badly wrong.
const ODOMETRY_DOF: f64 = 4.0;
/// Share of a scan that must lie on those before, or the pose by odometry is used.
const ON_SURFACES: f64 = 0.3;
/// A wall is as long as it has cells of this size [m].
const STRETCH: f64 = 0.5;
/// Landmarks kept, at most: the latest.
const MOST: usize = 120;

/// A landmark.
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
    /// Distance driven when it was last seen [m].
    distance: f64,
}

/// A scan that is kept.
#[derive(Clone, Debug)]
pub struct Look {
    /// Where the vehicle was.
    pub pose: Se2,
    /// Some of its beams.
    pub beams: Vec<Beam>,
    /// Its points with normals, in the frame of the vehicle that made it.
    pub surface: SurfaceScan,
    /// Distance driven when it was made [m].
    distance: f64,
}

/// The last metres of a drive.
#[derive(Clone, Debug)]
pub struct LocalView {
    /// The vehicle in the frame of the view.
    pose: Se2,
    landmarks: Vec<Seen>,
    looks: Vec<Look>,
    surfaces: SurfaceMap,
    distance: f64,
}

impl Default for LocalView {
    fn default() -> Self {
        let (landmarks, looks, surfaces) = (Vec::new(), Vec::new(), SurfaceMap::default());
        Self { pose: Se2::IDENTITY, landmarks, looks, surfaces, distance: 0.0 }
    }
}

impl LocalView {
    /// The vehicle has moved.
    pub fn advance(&mut self, motion: &Se2) {
        self.pose = self.pose * *motion;
        self.distance += motion.translation.norm();
    }

    /// Observations of a scan, each with the laser as the vehicle has it now.
    pub fn see(&mut self, observations: &[(Observation, Se2)]) {
        for (o, laser) in observations.iter().filter(|(o, _)| o.is_usable()) {
            let seen = Seen::new(o, &(self.pose * *laser), self.distance);
            let twin = |s: &&mut Seen| s.kind == seen.kind && (s.point - seen.point).norm() < MERGE;
            match self.landmarks.iter_mut().find(twin) {
                Some(known) => known.merge(&seen),
                None => self.landmarks.push(seen),
            }
        }
        let surplus = self.landmarks.len().saturating_sub(MOST);
        self.landmarks.drain(..surplus);
    }

    /// A scan, made by a laser that the vehicle has at `laser` now, while it moved with `twist` (body frame, per second).
    pub fn look(&mut self, scan: &LaserScan, laser: &Se2, twist: Vector3<f64>) {
        let step = self.looks.last().map(|last| last.pose.between(&self.pose));
        if step.is_some_and(|s| s.translation.norm() < APART.0 && s.theta().abs() < APART.1) {
            return;
        }
        let surface = SurfaceScan::new(scan, laser, twist);
        if let Some(step) = step {
            let found = align(&surface, &self.surfaces, self.pose, Some(&prior(&self.pose, &step)));
            if found.share > ON_SURFACES {
                self.pose = found.pose;
            }
        }
        self.surfaces.insert(&surface, &self.pose);
        self.looks.push(Look { pose: self.pose, beams: beams(scan, laser), surface, distance: self.distance });
        if self.looks.len() > SCANS {
            self.looks.remove(0);
        }
    }

    /// Forgets what was seen more than `distance` [m] ago.
    pub fn forget_beyond(&mut self, distance: f64) {
        let (now, looks) = (self.distance, self.looks.len());
        self.landmarks.retain(|s| now - s.distance <= distance);
        self.looks.retain(|l| now - l.distance <= distance);
        if self.looks.len() < looks {
            self.surfaces = SurfaceMap::default();
            self.looks.iter().for_each(|l| self.surfaces.insert(&l.surface, &l.pose));
        }
    }

    /// The vehicle in the frame of the view.
    #[must_use]
    pub fn pose(&self) -> Se2 {
        self.pose
    }

    /// Landmarks in the frame of the view.
    #[must_use]
    pub fn landmarks(&self) -> &[Seen] {
        &self.landmarks
    }

    /// Scans that were kept, the latest last.
    #[must_use]
    pub fn looks(&self) -> &[Look] {
        &self.looks
    }

    /// Surface points of all of them in the frame of the view.
    #[must_use]
    pub fn surface(&self) -> SurfaceScan {
        self.surfaces.sample(usize::MAX)
    }

    /// Length of the walls in it, each once [m].
    #[must_use]
    pub fn wall_length(&self) -> f64 {
        let cell = |p: &Vector2<f64>| ((p.x / STRETCH).floor() as i64, (p.y / STRETCH).floor() as i64);
        STRETCH * self.surfaces.points().iter().map(cell).collect::<HashSet<_>>().len() as f64
    }

    /// Whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.landmarks.is_empty() && self.looks.is_empty()
    }

    /// Distance driven since the beginning [m].
    #[must_use]
    pub fn distance(&self) -> f64 {
        self.distance
    }
}

/// The pose after a step by odometry.
fn prior(pose: &Se2, step: &Se2) -> Prior {
    let (distance, turn) = (step.translation.norm(), step.theta().abs());
    let xy = ODOMETRY.0 + ODOMETRY.1 * distance;
    let heading = ODOMETRY.0 + ODOMETRY.1 * distance + ODOMETRY.2 * turn;
    let information = Matrix3::from_diagonal(&Vector3::new(xy.powi(-2), xy.powi(-2), heading.powi(-2)));
    Prior { pose: *pose, information, dof: ODOMETRY_DOF }
}

impl Seen {
    fn new(o: &Observation, laser: &Se2, distance: f64) -> Self {
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
            distance,
        }
    }

    fn merge(&mut self, other: &Self) {
        self.sightings += 1;
        self.point += (other.point - self.point) / f64::from(self.sightings);
        self.distance = other.distance;
        if other.covariance.trace() < self.covariance.trace() {
            self.covariance = other.covariance;
            self.orientation = other.orientation.or(self.orientation);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::beams::BEAMS;
    use groma_models::BeamGeometry;

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
        assert!((view.landmarks()[0].point - place).norm() < 1e-12);
        view.forget_beyond(5.0);
        assert_eq!(view.landmarks().len(), 1);
        view.advance(&Se2::new(6.0, 0.0, 0.0));
        view.forget_beyond(5.0);
        assert!(view.landmarks().is_empty());
    }

    fn scan(ranges: Vec<f64>) -> LaserScan {
        let (angle_min, angle_increment, time_increment) = (-1.5, 0.01, 0.0);
        let geometry = BeamGeometry { angle_min, angle_increment, time_increment, range_min: 0.1, range_max: 20.0 };
        LaserScan { stamp: 0.0, geometry, ranges, intensities: Vec::new() }
    }

    #[test]
    fn scans_close_by_are_not_kept() {
        let mut view = LocalView::default();
        for _ in 0..100 {
            view.look(&scan(vec![5.0; 300]), &Se2::IDENTITY, Vector3::zeros());
            view.advance(&Se2::new(0.1, 0.0, 0.0));
        }
        assert_eq!(view.looks().len(), SCANS);
        assert!(view.looks().iter().all(|l| l.beams.len() <= BEAMS));
        let mut broken = LocalView::default();
        broken.look(&scan(vec![f64::NAN, 0.0, f64::INFINITY]), &Se2::IDENTITY, Vector3::zeros());
        broken.look(&scan(Vec::new()), &Se2::IDENTITY, Vector3::zeros());
        assert!(broken.looks().iter().all(|l| l.beams.is_empty()) && broken.surface().points.is_empty());
    }

    /// The scan of a room of 8 by 6 m from a laser in it.
    fn in_room(laser: &Se2) -> LaserScan {
        let range = |k: usize| {
            let (s, c) = (laser.theta() - 1.5 + 0.01 * k as f64).sin_cos();
            let x = if c > 0.0 { (4.0 - laser.x()) / c } else { (-4.0 - laser.x()) / c };
            let y = if s > 0.0 { (3.0 - laser.y()) / s } else { (-3.0 - laser.y()) / s };
            x.min(y)
        };
        scan((0..300).map(range).collect())
    }

    #[test]
    fn scans_lie_on_each_other_though_the_odometry_is_wrong() {
        let mount = Se2::new(0.3, 0.1, 0.4);
        let (mut view, mut truth) = (LocalView::default(), Se2::IDENTITY);
        for _ in 0..10 {
            view.look(&in_room(&(truth * mount)), &mount, Vector3::zeros());
            view.advance(&Se2::new(0.22, 0.01, 0.33));
            truth = truth * Se2::new(0.2, 0.0, 0.3);
        }
        let error = view.looks()[9].pose.minus(&(truth * Se2::new(0.2, 0.0, 0.3).inverse()));
        assert!(error.norm() < 0.01, "{error}");
        assert!(view.surface().points.iter().all(|p| (p.x.abs() - 4.0).abs().min((p.y.abs() - 3.0).abs()) < 0.01));
    }
}

//! The localizer: predict with every motion of the wheels, update with every scan.
//!
//! Time is that of the last motion. Observations carry the time of their beam; each is taken from where the vehicle was, or
//! will be, at that time. The pose is `T_map_base`, its covariance that of the right perturbation.

use crate::error::Error;
use crate::gating::Sighted;
use crate::history::History;
use crate::integrity::{Integrity, Support};
use crate::joint::{CalibrationCovariance, Joint, Motion};
use crate::landmark_filter::{FoundCount, LandmarkFilter, Scan};
use crate::map::StaticMap;
use crate::observation::Observation;
use crate::odometer::Odometer;
use crate::options::{Mode, Options};
use crate::quality::Quality;
use crate::relocalize::Relocalizer;
use crate::search::Search;
use crate::update::{Update, View};
use crate::wall_hold::{WallHold, is_wide};
use groma_geometry::Se2;
use groma_models::bounds::{COORDINATE, STAMP, VARIANCE};
use groma_models::{LandmarkKind, LandmarkMap, LaserScan};
use nalgebra::{Matrix3, SMatrix};
use std::sync::Arc;

/// Standard deviations of a pose that is not known [m], [rad].
const UNKNOWN: (f64, f64) = (1e3, 3.0);

/// What is known before the first motion.
#[derive(Clone, Debug)]
pub struct Start {
    /// Time [s].
    pub stamp: f64,
    /// The pose and the covariance of its right perturbation; none where it is not known.
    pub pose: Option<(Se2, Matrix3<f64>)>,
    /// `T_base_laser`.
    pub mount: Se2,
    /// Covariance of the calibration, where it is to be considered.
    pub calibration: Option<CalibrationCovariance>,
}

/// A vehicle on a map.
#[derive(Clone, Debug)]
pub struct Localizer {
    filter: LandmarkFilter,
    /// `T_base_laser`.
    mount: Se2,
    history: History,
    odometer: Odometer,
    integrity: Integrity,
    wall_hold: WallHold,
    /// Looks for the place while it is lost.
    search: Option<Search>,
}

impl Localizer {
    /// A vehicle at its start.
    ///
    /// # Errors
    /// A setting out of range, a map or a start that cannot be used.
    pub fn new(map: LandmarkMap, start: &Start, options: Options) -> Result<Self, Error> {
        options.validate()?;
        let map = Arc::new(StaticMap::new(map)?);
        let mount = start.mount.to_vector();
        if !(STAMP.holds(start.stamp) && mount.iter().all(|v| COORDINATE.holds(*v))) {
            return Err(Error::Unusable { what: "the time of the start or the mount of the laser" });
        }
        if start.calibration.as_ref().is_some_and(|c| !is_covariance(c)) {
            return Err(Error::Unusable { what: "the calibration" });
        }
        let (pose, covariance) = start.pose.unwrap_or((Se2::IDENTITY, unknown()));
        check_pose(&pose, &covariance)?;
        let joint = Joint::new(pose, &covariance, start.calibration.as_ref());
        let mut localizer = Self {
            filter: LandmarkFilter::new(joint, map, options),
            mount: start.mount,
            history: History::new(start.stamp),
            odometer: Odometer::default(),
            integrity: Integrity::new(start.pose.is_some(), &options.lost),
            wall_hold: WallHold::new(),
            search: None,
        };
        localizer.judge(&Support::none());
        Ok(localizer)
    }

    /// The same, standing at its start at another time [s]: for one that is made before the first message tells the time.
    #[must_use]
    pub fn starting_at(mut self, stamp: f64) -> Self {
        self.history = History::new(stamp);
        self
    }

    /// Lets the localizer look for its place on a map of its own accord while it is lost.
    #[must_use]
    pub fn with_relocalizer(mut self, relocalizer: Arc<Relocalizer>) -> Self {
        self.search = Some(Search::new(relocalizer));
        self
    }

    /// The vehicle has moved, until `stamp` [s].
    ///
    /// # Errors
    /// Time that goes back, or a motion that is not finite; nothing has changed then.
    pub fn predict(&mut self, stamp: f64, motion: &Motion) -> Result<(), Error> {
        let before = self.history.now();
        if stamp.is_nan() || stamp < before {
            return Err(Error::TimeGoesBack { stamp, before });
        }
        let sane = motion.motion.to_vector().iter().chain(motion.by_drive.iter()).all(|v| COORDINATE.holds(*v));
        if !(sane && STAMP.holds(stamp) && is_covariance(&motion.covariance)) {
            return Err(Error::Unusable { what: "the motion" });
        }
        let covariance = motion.covariance * self.wall_hold.motion_factor();
        self.filter.joint.predict(&Motion { covariance, ..*motion });
        self.history.push(stamp, &motion.motion);
        if let Some(search) = &mut self.search {
            search.advance(&motion.motion, self.integrity.is_lost());
        }
        self.odometer.advance(&motion.motion);
        self.integrity.measure(&self.filter.joint);
        Ok(())
    }

    /// The pose has been found another way.
    ///
    /// # Errors
    /// A pose that is not finite or a covariance that is none; nothing has changed then.
    pub fn relocate(&mut self, pose: Se2, covariance: &Matrix3<f64>) -> Result<(), Error> {
        check_pose(&pose, covariance)?;
        self.filter.relocate(pose, covariance);
        self.wall_hold.restart();
        self.integrity.restart();
        self.judge(&Support::none());
        Ok(())
    }

    /// The beams of a scan: while the vehicle is lost they help to find its place, else they are kept for the next update, where
    /// walls constrain the pose if landmarks do not.
    pub fn look(&mut self, scan: &LaserScan) {
        let (laser, end) = (self.laser_at(scan.stamp), scan.beam_stamp(scan.ranges.len()));
        let twist = self.history.twist(scan.stamp, end);
        let Some(search) = &mut self.search else { return };
        if self.integrity.is_lost() {
            search.look(scan, &laser, twist);
        } else if self.filter.options().mode.uses_walls() && search.walls().is_some() {
            self.wall_hold.keep(scan, &laser, twist, self.odometer.with_turns());
        }
    }

    /// Takes in the corners and reflectors of a scan.
    ///
    /// `view` tells which places the scan would show: without it no landmark is ever missed, only forgotten with time and
    /// distance. While the pose is not known nothing is learned.
    pub fn update(&mut self, observations: &[Observation], view: Option<View<'_>>) -> Update {
        let sighted = self.usable(observations);
        let relocated = self.find_place(&sighted);
        let mut update = Update { unusable: observations.len() - sighted.len(), relocated, ..Update::default() };
        if self.integrity.is_known() {
            if is_wide(&self.filter.joint) {
                self.take_in_walls();
            }
            let (mount, stamp, distance) = (self.mount, self.history.now(), self.odometer.distance());
            let learned = self.filter.update(&Scan { sighted: &sighted, view, mount, stamp, distance });
            self.take_in_walls();
            let (support, matched, nis) = self.filter.support(&learned, &sighted);
            self.integrity.see(sighted.len(), matched, nis, self.filter.expects_matches());
            self.judge(&support);
            (update.matches, update.begun, update.cut_short) = (learned.matches, learned.begun, learned.cut_short);
            (update.proven, update.forgotten) = (learned.changes.proven, learned.changes.forgotten);
        }
        Update { quality: self.integrity.quality(), ..update }
    }

    /// Observations with the place of their laser, by their place in the list.
    fn usable<'a>(&self, observations: &'a [Observation]) -> Vec<(usize, Sighted<'a>)> {
        let options = self.filter.options();
        let wanted = |o: &Observation| options.mode != Mode::Reflectors || o.kind == LandmarkKind::Reflector;
        let usable = observations.iter().enumerate();
        let usable = usable.filter(|(_, o)| o.is_usable() && o.polar.x <= options.range_max && wanted(o));
        let mut last = (f64::NAN, Se2::IDENTITY); // beams of one time share the place
        let mut laser = |stamp: f64| {
            if stamp != last.0 {
                last = (stamp, self.laser_at(stamp));
            }
            last.1
        };
        usable.map(|(k, o)| (k, Sighted { observation: o, laser: laser(o.stamp) })).collect()
    }

    /// Looks for the place while it is lost; the probability with which it was found.
    fn find_place(&mut self, sighted: &[(usize, Sighted<'_>)]) -> Option<f64> {
        let search = self.search.as_mut().filter(|_| self.integrity.is_lost())?;
        let seen: Vec<(Observation, Se2)> = sighted.iter().map(|(_, s)| (*s.observation, s.laser)).collect();
        let found = search.see(&seen)?;
        self.relocate(found.pose, &found.covariance).ok().map(|()| found.probability)
    }

    /// Takes in the scan that was kept for the walls.
    fn take_in_walls(&mut self) {
        let Some(walls) = self.search.as_ref().and_then(|s| s.walls()) else { return };
        let evidence = self.wall_hold.take_in(&mut self.filter.joint, &walls, self.odometer.with_turns());
        if let Some(log_ratio) = evidence {
            self.integrity.hear(log_ratio);
        }
    }

    /// Time of the last motion [s].
    #[must_use]
    pub fn stamp(&self) -> f64 {
        self.history.now()
    }

    /// `T_map_base`.
    #[must_use]
    pub fn pose(&self) -> Se2 {
        self.filter.joint.pose()
    }

    /// Covariance of the pose's right perturbation.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        self.filter.joint.pose_covariance()
    }

    /// Quality of the pose.
    #[must_use]
    pub fn quality(&self) -> Quality {
        self.integrity.quality()
    }

    /// Pose, calibration and landmarks in memory.
    #[must_use]
    pub fn joint(&self) -> &Joint {
        &self.filter.joint
    }

    /// Distance driven [m].
    #[must_use]
    pub fn distance(&self) -> f64 {
        self.odometer.distance()
    }

    /// How many landmarks were found during the drive.
    #[must_use]
    pub fn found(&self) -> FoundCount {
        self.filter.found()
    }

    fn judge(&mut self, support: &Support) {
        self.integrity.judge(&self.filter.joint, support, self.wall_hold.constrains());
    }

    /// From where a beam was fired at `stamp`: the laser, seen from the vehicle now.
    fn laser_at(&self, stamp: f64) -> Se2 {
        self.history.since(stamp) * self.mount
    }
}

fn unknown() -> Matrix3<f64> {
    Matrix3::from_diagonal(&nalgebra::Vector3::new(UNKNOWN.0.powi(2), UNKNOWN.0.powi(2), UNKNOWN.1.powi(2)))
}

fn check_pose(pose: &Se2, covariance: &Matrix3<f64>) -> Result<(), Error> {
    let sane = pose.to_vector().iter().all(|v| COORDINATE.holds(*v));
    if sane && is_covariance(covariance) { Ok(()) } else { Err(Error::Unusable { what: "the pose" }) }
}

/// Whether a matrix is finite, symmetric and has no negative variance.
fn is_covariance<const N: usize>(c: &SMatrix<f64, N, N>) -> bool {
    let scale = c.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let symmetric = (c - c.transpose()).iter().all(|v| v.abs() <= 1e-9 * scale);
    c.iter().all(|v| VARIANCE.holds(*v)) && symmetric && (0..N).all(|i| c[(i, i)] >= 0.0)
}

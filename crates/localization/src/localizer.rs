//! The localizer: predict with every motion of the wheels, update with every scan.
//!
//! Time is that of the last motion. Observations carry the time of their beam; each is taken from where the vehicle was, or
//! will be, at that time. The pose is `T_map_base`, its covariance that of the right perturbation.

use crate::error::Error;
use crate::gates::Gates;
use crate::history::History;
use crate::hold::{Glance, way_of};
use crate::joint::{CalibrationCovariance, Joint, Motion};
use crate::map::StaticMap;
use crate::memory::Memory;
use crate::options::Options;
use crate::quality::{Monitor, Quality, Status, weakest};
use crate::relocalize::Relocalizer;
use crate::search::Search;
use groma_geometry::{Se2, largest_sigma};
use groma_models::LandmarkMap;
use groma_models::bounds::{COORDINATE, STAMP, VARIANCE};
use nalgebra::{Matrix3, SMatrix, Vector2};
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
    pub(crate) options: Options,
    /// Shared: the states of a filter that is set back and goes on anew have the same map.
    pub(crate) map: Arc<StaticMap>,
    pub(crate) mount: Se2,
    pub(crate) joint: Joint,
    pub(crate) memory: Memory,
    pub(crate) history: History,
    pub(crate) monitor: Monitor,
    pub(crate) quality: Quality,
    /// Whether the pose was ever known.
    pub(crate) known: bool,
    /// chi2(2 k, p) of k pairings.
    pub(crate) gates: Gates,
    /// Way driven [m] and scans seen.
    pub(crate) way: f64,
    pub(crate) scans: u64,
    /// Looks for the place while it is lost.
    pub(crate) search: Option<Search>,
    /// A scan for the walls, and way and turn when the last was taken.
    pub(crate) glance: Option<Glance>,
    pub(crate) glanced: f64,
    /// Way and turn driven, one radian a metre.
    pub(crate) stir: f64,
    /// Factor on the covariance of motions, learned.
    pub(crate) motion_factor: f64,
    /// Whether walls held the pose when they were last asked.
    pub(crate) held: bool,
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
        let memory = Memory::new(map.landmarks().len());
        let mut localizer = Self {
            options,
            map,
            mount: start.mount,
            joint,
            memory,
            history: History::new(start.stamp),
            monitor: Monitor::new(&options.lost),
            quality: Quality::default(),
            known: start.pose.is_some(),
            gates: Gates::new(options.gate),
            way: 0.0,
            scans: 0,
            search: None,
            glance: None,
            glanced: f64::NEG_INFINITY,
            stir: 0.0,
            motion_factor: 1.0,
            held: false,
        };
        localizer.judge(&Matrix3::zeros(), 0.0);
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
        self.joint.predict(&Motion { covariance: motion.covariance * self.motion_factor, ..*motion });
        self.history.push(stamp, &motion.motion);
        if let Some(search) = &mut self.search {
            search.advance(&motion.motion, self.quality.status == Status::Lost);
        }
        self.way += motion.motion.translation.norm();
        self.stir += way_of(&motion.motion);
        self.quality.sigma_position = self.sigma_position();
        self.quality.sigma_heading = self.joint.pose_covariance().m33.sqrt();
        Ok(())
    }

    /// The pose has been found another way.
    ///
    /// # Errors
    /// A pose that is not finite or a covariance that is none; nothing has changed then.
    pub fn relocate(&mut self, pose: Se2, covariance: &Matrix3<f64>) -> Result<(), Error> {
        check_pose(&pose, covariance)?;
        self.memory.clear(&mut self.joint);
        self.joint.replace_pose(pose, covariance);
        self.monitor.restart();
        (self.glanced, self.held, self.motion_factor) = (f64::NEG_INFINITY, false, 1.0);
        self.known = true;
        self.judge(&Matrix3::zeros(), 0.0);
        Ok(())
    }

    /// Time of the last motion [s].
    #[must_use]
    pub fn stamp(&self) -> f64 {
        self.history.now()
    }

    /// `T_map_base`.
    #[must_use]
    pub fn pose(&self) -> Se2 {
        self.joint.pose()
    }

    /// Covariance of the pose's right perturbation.
    #[must_use]
    pub fn covariance(&self) -> Matrix3<f64> {
        self.joint.pose_covariance()
    }

    /// What the pose is worth.
    #[must_use]
    pub fn quality(&self) -> Quality {
        self.quality
    }

    /// Pose, calibration and landmarks in memory.
    #[must_use]
    pub fn joint(&self) -> &Joint {
        &self.joint
    }

    /// Way driven [m].
    #[must_use]
    pub fn way(&self) -> f64 {
        self.way
    }

    /// Landmarks found on the way that hold the pose, and those that are on trial.
    #[must_use]
    pub fn found(&self) -> (usize, usize) {
        let proven = self.memory.all_found().filter(|(_, f)| f.proven).count();
        (proven, self.memory.all_found().count() - proven)
    }

    /// Sets the figures that follow from pose, scan and evidence.
    pub(crate) fn judge(&mut self, information: &Matrix3<f64>, distance: f64) {
        let sigma = self.sigma_position();
        let q = &mut self.quality;
        q.sigma_position = sigma;
        q.sigma_heading = self.joint.pose_covariance().m33.sqrt();
        q.geometry = weakest(information, distance);
        q.matched_share = self.monitor.share();
        q.lost_evidence = self.monitor.evidence();
        let lost = !self.known || self.monitor.is_lost() || sigma > self.options.lost.sigma_max;
        q.status = match lost {
            true => Status::Lost,
            false if q.matched == 0 && !self.held => Status::Coasting,
            false => Status::Tracking,
        };
    }

    /// Along the weakest direction [m].
    pub(crate) fn sigma_position(&self) -> f64 {
        largest_sigma(&self.joint.pose_covariance().fixed_view::<2, 2>(0, 0).into_owned())
    }

    /// From where a beam was fired at `stamp`: the laser, seen from the vehicle now.
    pub(crate) fn laser_at(&self, stamp: f64) -> Se2 {
        self.history.since(stamp) * self.mount
    }

    /// Range and bearing at which the laser would now see a place.
    #[must_use]
    pub fn sight(&self, place: Vector2<f64>) -> Vector2<f64> {
        let q = (self.joint.pose() * self.mount).inverse().act(place);
        Vector2::new(q.norm(), q.y.atan2(q.x))
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

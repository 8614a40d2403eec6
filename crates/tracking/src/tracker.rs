//! The front end: every scan is registered to the local map of the last metres.
//!
//! Two local maps are under construction, the younger begun when the older was half full. Scans are registered to the
//! older one, which holds between one and two halves of drive; when it is full it is finished, and the younger takes
//! its place. So there is always a well-grown map to match to, none grows without bound, and successive local maps
//! share half of their scans.
//!
//! A scan is first registered from the motion prior. If that fits badly, or the prior is too wide for it, a correlative search
//! around the prior, around the last pose and around the constant-velocity pose gives further starts (odometry may
//! stall and jump), and the alignment with the highest posterior wins.

use crate::directions::{weakest, without_traces};
use crate::extrapolation::Increment;
use crate::motion::MotionModel;
use crate::offset::Offset;
use crate::rivals::{RECENT, choose, starts, weigh_contradictions};
use crate::tracked::Tracked;
use groma_geometry::Se2;
use groma_registration::{Alignment, PolarView, Prior, SurfaceMap, align};
use nalgebra::{Matrix3, Vector3};
use std::collections::VecDeque;
use std::sync::Arc;

/// A new keyframe is due after this much motion [m], [rad].
const KEYFRAME: (f64, f64) = (0.2, 0.17);
/// Half a local map: at least this long [m] and this many keyframes, or that many however short.
const HALF: (f64, usize, usize) = (4.0, 10, 50);
/// A prior wider than this is searched [m], [rad].
const WIDE: (f64, f64) = (0.25, 0.15);
/// Share of the usual match below which a registration is doubted.
const DOUBT: f64 = 0.8;
/// Squared Mahalanobis distance from the prior beyond which a registration is doubted.
const SURPRISE: f64 = 16.0;
/// Share of a scan on the map below which, without odometry, nothing bridges the gap; and the standard deviations of
/// such a step [m], [rad].
const LOST: f64 = 0.35;
const TORN: (f64, f64) = (0.5, 0.8);
/// What a velocity that is taken to go on counts for, as a share of its information.
const GUESS: f64 = 0.05;
/// How likely it is that, of a scan and odometry that contradict each other, the scan is wrong.
const WRONG_WAY: f64 = 0.05;
/// Drift of registration to a local map that its own covariance does not tell: [m per sqrt m], [rad per sqrt m].
const DRIFT: (f64, f64) = (0.01, 0.003);

/// A local map under construction, in the frame of its anchor.
#[derive(Clone, Debug)]
pub struct Growing {
    /// Pose of the anchor in the tracked frame.
    pub anchor: Se2,
    /// Index of its first keyframe.
    pub first: usize,
    /// Surface points.
    pub surfaces: SurfaceMap,
    /// Path driven since it was begun [m].
    length: f64,
}

/// A local map that takes no more scans, and the keyframes it was built of.
pub struct Finished {
    /// The map.
    pub map: Growing,
    /// Indices of its keyframes.
    pub keyframes: std::ops::Range<usize>,
}

/// What one scan told.
pub struct Step {
    /// Pose in the tracked frame.
    pub pose: Se2,
    /// The scan as a keyframe, where it became one.
    pub keyframe: Option<Tracked>,
    /// A local map was finished.
    pub finished: Option<Finished>,
    /// What is to be learned of the odometry once it has come.
    pub lesson: Option<Lesson>,
}

/// What a scan that was registered well teaches about the odometry since the scan before.
#[derive(Clone, Debug)]
pub struct Lesson {
    last: Se2,
    found: Se2,
    information: Matrix3<f64>,
    coasting: Prior,
    /// Odometry had failed: the scan was registered without.
    alone: bool,
}

/// Scans for which there was odometry that failed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Overruled {
    /// How many.
    pub scans: usize,
    /// Stamps of the first and the last [s].
    pub stamps: (f64, f64),
}

/// The state of the front end.
#[derive(Clone, Default)]
pub struct Tracker {
    model: MotionModel,
    offset: Offset,
    growing: Vec<Growing>,
    pose: Option<Se2>,
    stamp: f64,
    /// Covariance gathered since the last keyframe.
    since: Matrix3<f64>,
    usual_share: f64,
    overruled: Option<Overruled>,
    /// The track was lost, with nothing to bridge the gap, since the last keyframe.
    torn: bool,
    /// Keyframes so far, and the last of them.
    count: usize,
    recent: VecDeque<Tracked>,
}

impl Tracker {
    /// The twist of the vehicle as last seen (body frame, per second), for deskewing.
    #[must_use]
    pub fn velocity(&self) -> Vector3<f64> {
        self.model.velocity()
    }

    /// What was learned of the laser's place against the odometry.
    #[must_use]
    pub fn offset(&self) -> &Offset {
        &self.offset
    }

    /// Scans that were registered without odometry though there was some: it failed.
    #[must_use]
    pub fn overruled(&self) -> Option<Overruled> {
        self.overruled
    }

    /// Covariance gathered since the last keyframe.
    #[must_use]
    pub fn since(&self) -> &Matrix3<f64> {
        &self.since
    }

    /// Registers a scan. `increment` is the odometry since the last scan, if there is odometry.
    pub fn step(&mut self, stamp: f64, view: PolarView, increment: Option<&Increment>) -> Step {
        let Some(last) = self.pose else {
            return self.begin(stamp, view);
        };
        let seconds = stamp - self.stamp;
        let (coasting, rolling) = self.priors(&last, seconds, increment);
        let alone = rolling.is_none() || self.model.odometry_fails();
        if alone && rolling.is_some() {
            self.overrule(stamp);
        }
        let prior = rolling.filter(|_| !alone).unwrap_or_else(|| coasting.clone());
        let found = self.register(&view, &prior, &last, seconds);
        let surprised = prior.distance_sq(&found.pose) > SURPRISE;
        let good = found.share > 0.5 * self.usual_share && found.matched >= 10;
        let mut lesson = None;
        if good {
            let learned = Lesson { last, found: found.pose, information: found.information, coasting, alone };
            match increment {
                Some(u) if u.is_complete => self.learn(&learned, &u.motion),
                Some(_) => lesson = Some(learned),
                None => self.model.learn(&prior, &found.pose, &found.information),
            }
            self.usual_share += 0.05 * (found.share - self.usual_share);
        }
        let torn = alone && found.share < LOST;
        self.advance(stamp, &found, &prior, surprised, alone);
        if torn {
            self.since += Matrix3::from_diagonal(&Vector3::new(TORN.0 * TORN.0, TORN.0 * TORN.0, TORN.1 * TORN.1));
            self.torn = true;
        }
        Step { lesson, ..self.keep(stamp, view, &found, surprised) }
    }

    /// The pose `seconds` after `last`, predicted as the vehicle moved, and by odometry.
    fn priors(&self, last: &Se2, seconds: f64, increment: Option<&Increment>) -> (Prior, Option<Prior>) {
        let rolling = increment.map(|u| self.model.from_odometry(last, &self.offset.apply(&u.motion), &u.excess));
        (self.model.from_velocity(last, seconds), rolling)
    }

    /// How the vehicle moves in `seconds` after the last scan, and the covariance of that.
    #[must_use]
    pub fn foretell(&self, seconds: f64, increment: Option<&Increment>) -> (Se2, Matrix3<f64>) {
        let (coasting, rolling) = self.priors(&self.pose.unwrap_or(Se2::IDENTITY), seconds, increment);
        let prior = rolling.filter(|_| !self.model.odometry_fails()).unwrap_or(coasting);
        let moved = self.pose.unwrap_or(Se2::IDENTITY).between(&prior.pose);
        (moved, prior.information.try_inverse().unwrap_or_else(Matrix3::zeros))
    }

    /// Learns from a scan and the odometry since the scan before, which may come later than the scan.
    pub fn learn(&mut self, lesson: &Lesson, increment: &Se2) {
        let Lesson { last, found, information, coasting, alone } = lesson;
        let rolling = self.model.from_odometry(last, &self.offset.apply(increment), &Vector3::zeros());
        self.model.learn(if *alone { coasting } else { &rolling }, found, information);
        self.model.compare(&rolling, coasting, found);
        self.offset.learn(increment, &last.between(found), weakest(information).0);
    }

    fn overrule(&mut self, stamp: f64) {
        let before = self.overruled.unwrap_or(Overruled { scans: 0, stamps: (stamp, stamp) });
        self.overruled = Some(Overruled { scans: before.scans + 1, stamps: (before.stamps.0, stamp) });
    }

    fn begin(&mut self, stamp: f64, view: PolarView) -> Step {
        self.pose = Some(Se2::IDENTITY);
        self.model.observe(stamp, &Se2::IDENTITY);
        self.stamp = stamp;
        self.usual_share = 0.7;
        self.growing.push(Growing { anchor: Se2::IDENTITY, first: 0, surfaces: SurfaceMap::default(), length: 0.0 });
        let keyframe = self.add(Tracked::at(stamp, Se2::IDENTITY, view));
        Step { pose: Se2::IDENTITY, keyframe: Some(keyframe), finished: None, lesson: None }
    }

    /// The best alignment of the scan, in the tracked frame.
    fn register(&self, view: &PolarView, prior: &Prior, last: &Se2, seconds: f64) -> Alignment {
        let scan = &view.scan;
        let map = &self.growing[0];
        let to_map = map.anchor.inverse();
        let local = Prior { pose: to_map * prior.pose, ..prior.clone() };
        let mut found = vec![align(scan, &map.surfaces, local.pose, Some(&local))];
        let wide = prior.information[(0, 0)] < WIDE.0.powi(-2) || prior.information[(2, 2)] < WIDE.1.powi(-2);
        let doubtful = found[0].share < DOUBT * self.usual_share || local.distance_sq(&found[0].pose) > SURPRISE;
        if wide || doubtful {
            let coasting = last.plus(self.velocity() * seconds.min(2.0));
            let starts = starts(scan, &map.surfaces, &[local.pose, to_map * *last, to_map * coasting], prior);
            found.extend(starts.iter().map(|start| align(scan, &map.surfaces, *start, Some(&local))));
            weigh_contradictions(&mut found, view, &map.anchor, &self.recent);
        }
        let mut best = choose(found);
        best.pose = map.anchor * best.pose;
        best
    }

    /// Takes the pose over. Of what the scan does not hold, odometry bears witness; a velocity that is taken to go on
    /// (`alone`) hardly does, and neither does the little that noise in the normals of a corridor seems to tell.
    fn advance(&mut self, stamp: f64, found: &Alignment, prior: &Prior, distrust: bool, alone: bool) {
        let last = self.pose.unwrap_or(Se2::IDENTITY);
        let moved = last.between(&found.pose);
        let believed = prior.information
            * if distrust {
                0.01
            } else if alone {
                GUESS
            } else {
                1.0
            };
        let seen = if alone { without_traces(&found.information) } else { found.information };
        let mut spread = (seen + believed).try_inverse().unwrap_or_else(Matrix3::zeros);
        if distrust {
            let e = prior.pose.minus(&found.pose);
            spread += e * e.transpose() * WRONG_WAY;
        }
        let d = moved.translation.norm() + 0.3 * moved.theta().abs();
        let drift = Vector3::new(DRIFT.0 * DRIFT.0 * d, DRIFT.0 * DRIFT.0 * d, DRIFT.1 * DRIFT.1 * d);
        let ad = moved.inverse().adjoint();
        self.since = ad * self.since * ad.transpose() + spread + Matrix3::from_diagonal(&drift);
        for map in &mut self.growing {
            map.length += moved.translation.norm();
        }
        self.model.observe(stamp, &found.pose);
        self.pose = Some(found.pose);
        self.stamp = stamp;
    }

    fn keep(&mut self, stamp: f64, view: PolarView, found: &Alignment, surprised: bool) -> Step {
        let step = Step { pose: found.pose, keyframe: None, finished: None, lesson: None };
        let Some(last) = self.recent.back() else { return step };
        let moved = last.pose.between(&found.pose);
        if moved.translation.norm() < KEYFRAME.0 && moved.theta().abs() < KEYFRAME.1 {
            return step;
        }
        let keyframe = self.add(Tracked {
            stamp,
            pose: found.pose,
            view: Arc::new(view),
            step: self.since,
            weakest: weakest(&found.information),
            share: found.share,
            surprised,
            torn: self.torn,
        });
        Step { finished: self.turn_over(&keyframe), keyframe: Some(keyframe), ..step }
    }

    /// Adds a keyframe to the local maps under construction.
    fn add(&mut self, keyframe: Tracked) -> Tracked {
        for map in &mut self.growing {
            map.surfaces.insert(&keyframe.view.scan, &map.anchor.between(&keyframe.pose));
        }
        (self.since, self.torn) = (Matrix3::zeros(), false);
        self.count += 1;
        if self.recent.len() == RECENT {
            self.recent.pop_front();
        }
        self.recent.push_back(keyframe.clone());
        keyframe
    }

    /// Begins a local map at the last keyframe when the younger one is half full; finishes the older.
    fn turn_over(&mut self, last: &Tracked) -> Option<Finished> {
        let youngest = self.growing.last()?;
        let count = self.count - youngest.first;
        if !((youngest.length >= HALF.0 && count >= HALF.1) || count >= HALF.2) {
            return None;
        }
        let finished = (self.growing.len() > 1).then(|| self.growing.remove(0));
        let mut surfaces = SurfaceMap::default();
        surfaces.insert(&last.view.scan, &Se2::IDENTITY);
        self.growing.push(Growing { anchor: last.pose, first: self.count - 1, surfaces, length: 0.0 });
        finished.map(|map| Finished { keyframes: map.first..self.count, map })
    }

    /// The local map that still grows; its younger one, which contains nothing else, is left out.
    #[must_use]
    pub fn rest(&self) -> Option<Finished> {
        let map = self.growing.first()?.clone();
        Some(Finished { keyframes: map.first..self.count, map })
    }
}

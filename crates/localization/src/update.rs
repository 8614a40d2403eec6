//! What a scan does to the localizer.
//!
//! 1. Observations that cannot be used are left out; each other gets the place of its beam.
//! 2. Gates, and slots for the landmarks of the map that pass them.
//! 3. Association, the pose alone learning.
//! 4. Where the pose moved far, the pairings are linearised anew at the better pose; where landmarks learn as well, the
//!    scan is taken again with all gains: `r = z - h(x_1) + H Jr(d) d`, `x_1 = x exp(d)`.
//! 5. Landmarks found on the way live on: seen, missed, begun, proven, forgotten.

use crate::associate::{Association, Open, Pairing};
use crate::gating::{Gating, Sighted, linearize};
use crate::joint::{Gain, Linear};
use crate::localizer::Localizer;
use crate::measurement::Viewpoint;
use crate::memory::{Changes, Found};
use crate::observation::Observation;
use crate::options::Mode;
use crate::quality::{Quality, Status};
use groma_geometry::{Se2, wrap};
use groma_models::LandmarkKind;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// A pose that moves by more than this is linearised at anew [m], [rad].
const FAR: (f64, f64) = (0.02, 0.004);
/// In mixed mode landmarks are begun where so many of the map hold the pose.
const ANCHORS: usize = 2;

/// Whether a place at range and bearing of the laser would be seen.
pub type View<'a> = &'a dyn Fn(Vector2<f64>) -> bool;

/// An observation and the landmark it was taken for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Place in the list of observations.
    pub observation: usize,
    /// The landmark: its place in the map, or a number beyond for one found on the way.
    pub landmark: usize,
    /// Whether it holds the pose.
    pub holds: bool,
    /// Range [m] and bearing [rad], measured less predicted.
    pub innovation: Vector2<f64>,
    /// Its covariance.
    pub covariance: Matrix2<f64>,
}

/// What a scan has brought.
#[derive(Clone, Debug, PartialEq)]
pub struct Update {
    /// Pairings.
    pub matches: Vec<Match>,
    /// Landmarks begun.
    pub begun: usize,
    /// Landmarks that hold the pose from now on.
    pub proven: usize,
    /// Landmarks forgotten.
    pub forgotten: usize,
    /// Observations that could not be used: not finite, without range or covariance, or out of range.
    pub unusable: usize,
    /// Whether the joint search met its cap and nearest neighbours were taken.
    pub cut_short: bool,
    /// The probability with which the place was found anew, where it was.
    pub relocated: Option<f64>,
    /// What the pose is worth now.
    pub quality: Quality,
}

impl Localizer {
    /// Takes in the corners and reflectors of a scan.
    ///
    /// `view` tells which places the scan would show: without it no landmark is ever missed, only forgotten with time and
    /// way. While the pose is not known nothing is learned.
    pub fn update(&mut self, observations: &[Observation], view: Option<View<'_>>) -> Update {
        let sighted = self.usable(observations);
        let unusable = observations.len() - sighted.len();
        self.scans += 1;
        let relocated = self.find_place(&sighted);
        if !self.known {
            let (matches, quality) = (Vec::new(), self.quality);
            return Update {
                matches,
                begun: 0,
                proven: 0,
                forgotten: 0,
                unusable,
                cut_short: false,
                relocated,
                quality,
            };
        }
        if self.is_wide() {
            self.hold_by_walls();
        }
        self.memory.limit(&mut self.joint, self.options.memory);
        let open = self.open(&sighted);
        let (pairings, cut_short) = self.learn(open, &sighted);
        let matches = self.matches(&pairings);
        self.record(&pairings, &sighted);
        let creates = self.options.mode.creates();
        let Changes { proven, forgotten } = if creates { self.live_on(&pairings, view) } else { Changes::default() };
        let begun = if creates { self.begin(&pairings, &sighted) } else { 0 };
        self.hold_by_walls();
        self.assess(&matches, &pairings, &sighted);
        Update { matches, begun, proven, forgotten, unusable, cut_short, relocated, quality: self.quality }
    }

    /// Looks for the place while it is lost; the probability with which it was found.
    fn find_place(&mut self, sighted: &[(usize, Sighted<'_>)]) -> Option<f64> {
        let search = self.search.as_mut().filter(|_| self.quality.status == Status::Lost)?;
        let seen: Vec<(Observation, Se2)> = sighted.iter().map(|(_, s)| (*s.observation, s.laser)).collect();
        let found = search.see(&seen)?;
        self.relocate(found.pose, &found.covariance).ok().map(|()| found.probability)
    }

    /// Observations with the place of their laser, by their place in the list.
    fn usable<'a>(&self, observations: &'a [Observation]) -> Vec<(usize, Sighted<'a>)> {
        let wanted = |o: &Observation| self.options.mode != Mode::Reflectors || o.kind == LandmarkKind::Reflector;
        let usable = observations.iter().enumerate();
        let usable = usable.filter(|(_, o)| o.is_usable() && o.polar.x <= self.options.range_max && wanted(o));
        let mut last = (f64::NAN, Se2::IDENTITY); // beams of one time share the place
        let mut laser = |stamp: f64| {
            if stamp != last.0 {
                last = (stamp, self.laser_at(stamp));
            }
            last.1
        };
        usable.map(|(k, o)| (k, Sighted { observation: o, laser: laser(o.stamp) })).collect()
    }

    /// What each observation may be; every landmark that one may be has a slot.
    fn open(&mut self, sighted: &[(usize, Sighted<'_>)]) -> Vec<Open> {
        let gating = Gating {
            joint: &self.joint,
            map: &self.map,
            memory: &self.memory,
            options: &self.options,
            gate: self.gates.of(1),
        };
        let candidates = sighted.iter().enumerate().map(|(observation, (_, s))| {
            let first = s.observation.kind == LandmarkKind::Reflector;
            Open { observation, first, candidates: gating.candidates(s) }
        });
        let mut open: Vec<Open> = candidates.filter(|o| !o.candidates.is_empty()).collect();
        for o in &mut open {
            for c in o.candidates.iter_mut().filter(|c| c.linear.landmark.is_none()) {
                let slot = self.slot(c.landmark);
                let view = Viewpoint { pose: self.joint.pose(), laser: sighted[o.observation].1.laser };
                let sight = view.sight(self.joint.points()[slot]).map(|s| s.by_landmark);
                c.linear.landmark = sight.map(|j| (slot, j));
                c.linear.noise = sighted[o.observation].1.observation.covariance;
            }
        }
        open
    }

    /// The slot of a landmark of the map, given now if it had none.
    fn slot(&mut self, landmark: usize) -> usize {
        self.memory.slot_of(landmark).unwrap_or_else(|| {
            let known = &self.map.landmarks()[landmark];
            let slot = self.joint.insert(known.position, &known.covariance);
            self.memory.remember(slot, landmark, self.scans);
            slot
        })
    }

    /// Associates, and moves the pose and the landmarks that learn.
    fn learn(&mut self, open: Vec<Open>, sighted: &[(usize, Sighted<'_>)]) -> (Vec<Pairing>, bool) {
        let before = self.joint.save_pose();
        let (memory, map) = (&self.memory, self.map.landmarks().len());
        let holds = |landmark: usize| landmark < map || memory.all_found().any(|(_, f)| f.id == landmark && f.proven);
        let (joint, options, gates) = (&mut self.joint, &self.options, &self.gates);
        let mut association = Association { joint, options, gates, holds, taken: Vec::new(), cut_short: false };
        association.run(open);
        let Association { taken: pairings, cut_short, .. } = association;
        let gains: Vec<Gain> = pairings.iter().map(|p| self.gain(p)).collect();
        let moved = self.joint.pose_shift();
        let far = moved.xy().norm() > FAR.0 || moved.z.abs() > FAR.1;
        if far || gains.iter().any(|g| *g != Gain::Pose) {
            self.joint.restore_pose(&before);
            for (pairing, gain) in pairings.iter().zip(gains) {
                let linear =
                    if far { self.anew(pairing, &sighted[pairing.observation].1, moved) } else { pairing.linear };
                self.joint.update(&linear, gain, f64::INFINITY);
            }
        }
        self.joint.settle();
        (pairings, cut_short)
    }

    /// What moves by a pairing.
    fn gain(&self, pairing: &Pairing) -> Gain {
        let found = pairing.linear.landmark.and_then(|(slot, _)| self.memory.found(slot));
        match (found, self.options.mode) {
            (Some(f), _) if !f.proven => Gain::Landmark,
            (_, Mode::Slam) => Gain::All,
            (Some(f), _) if f.hits < self.options.dynamic.refined => Gain::PoseAndLandmark,
            _ => Gain::Pose,
        }
    }

    /// A pairing, linearised where the pose has moved to.
    fn anew(&self, pairing: &Pairing, sighted: &Sighted<'_>, moved: Vector3<f64>) -> Linear {
        let view = Viewpoint { pose: self.joint.pose().plus(moved), laser: sighted.laser };
        let at_slot = pairing.linear.landmark.map(|(slot, _)| (slot, self.joint.points()[slot]));
        let linear = at_slot
            .and_then(|(slot, point)| linearize(&view, sighted.observation, point, Some(slot), &Matrix2::zeros()));
        linear.map_or(pairing.linear, |mut linear| {
            linear.by_pose *= Se2::right_jacobian(moved);
            linear.residual += linear.by_pose * moved;
            linear.residual.y = wrap(linear.residual.y);
            if let Some((offset, spread)) = pairing.doubt {
                linear.residual += offset;
                linear.noise += spread;
            }
            linear
        })
    }

    fn matches(&self, pairings: &[Pairing]) -> Vec<Match> {
        let to_match = |p: &Pairing| Match {
            observation: p.observation,
            landmark: p.landmark,
            holds: self.gain(p) != Gain::Landmark,
            innovation: p.linear.residual,
            covariance: p.covariance,
        };
        pairings.iter().map(to_match).collect()
    }

    /// Writes down who was seen.
    fn record(&mut self, pairings: &[Pairing], sighted: &[(usize, Sighted<'_>)]) {
        let (way, stamp, scan) = (self.way, self.history.now(), self.scans);
        for pairing in pairings {
            let Some((slot, _)) = pairing.linear.landmark else { continue };
            self.memory.touch(slot, scan);
            if let Some(found) = self.memory.found_mut(slot) {
                found.hits += 1;
                found.visible += 1;
                (found.misses, found.way, found.stamp) = (0, way, stamp);
                let descriptor = sighted[pairing.observation].1.observation.descriptor;
                found.descriptor = found.descriptor.or(descriptor);
            }
        }
    }

    /// Landmarks found on the way that were missed, proven, forgotten.
    fn live_on(&mut self, pairings: &[Pairing], view: Option<View<'_>>) -> Changes {
        if let Some(view) = view {
            for slot in 0..self.memory.slots().len() {
                let seen = pairings.iter().any(|p| p.linear.landmark.is_some_and(|(s, _)| s == slot));
                let sight = self.sight(self.joint.points()[slot]);
                let in_view = !seen && sight.x <= self.options.range_max && view(sight);
                if let Some(found) = self.memory.found_mut(slot).filter(|_| in_view) {
                    found.visible += 1;
                    found.misses += 1;
                }
            }
        }
        self.memory.review(&mut self.joint, self.way, self.history.now(), &self.options.dynamic)
    }

    /// Begins landmarks where nothing was known; their number.
    fn begin(&mut self, pairings: &[Pairing], sighted: &[(usize, Sighted<'_>)]) -> usize {
        let on_map = pairings.iter().filter(|p| p.landmark < self.map.landmarks().len()).count();
        let p = self.joint.pose_covariance();
        let sure = (p.m11 + p.m22).sqrt() < self.options.dynamic.anchor_sigma;
        if self.options.mode == Mode::Mixed && on_map < ANCHORS && !sure {
            return 0;
        }
        let room = self.options.dynamic.count_max.saturating_sub(self.memory.all_found().count());
        let paired = |k: usize| pairings.iter().any(|p| p.observation == k);
        let strange = sighted.iter().enumerate().filter(|(k, _)| !paired(*k)).map(|(_, (_, s))| s);
        let mut begun = 0;
        for s in strange {
            if begun < room && s.observation.identity.is_none() && self.begin_one(s) {
                begun += 1;
            }
        }
        begun
    }

    /// Begins a landmark, if none is near.
    fn begin_one(&mut self, sighted: &Sighted<'_>) -> bool {
        let view = Viewpoint { pose: self.joint.pose(), laser: sighted.laser };
        let begun = view.begin(sighted.observation.polar);
        let separation = self.options.dynamic.separation;
        let close = |p: &Vector2<f64>| (p - begun.position).norm() < separation;
        let mut known = self.joint.points().iter().any(close);
        if self.options.mode.uses_map() {
            self.map.near(begun.position, separation, |_, _| known = true);
        }
        if known {
            return false;
        }
        self.joint.begin(&begun, &sighted.observation.covariance);
        let heading = (view.pose * view.laser).theta();
        self.memory.begin(Found {
            id: 0,
            kind: sighted.observation.kind,
            orientation: sighted.observation.orientation.map(|o| wrap(heading + o)),
            descriptor: sighted.observation.descriptor,
            hits: 1,
            visible: 1,
            misses: 0,
            proven: self.options.dynamic.hits <= 1,
            way: self.way,
            stamp: self.history.now(),
        });
        true
    }

    /// Evidence and figures of the scan.
    fn assess(&mut self, matches: &[Match], pairings: &[Pairing], sighted: &[(usize, Sighted<'_>)]) {
        let holding = || matches.iter().zip(pairings).filter(|(m, _)| m.holds).map(|(_, p)| p);
        let n = holding().count();
        let information = |p: &Pairing| {
            let noise = p.linear.noise.try_inverse().unwrap_or_else(Matrix2::zeros);
            p.linear.by_pose.transpose() * noise * p.linear.by_pose
        };
        let sum: Matrix3<f64> = holding().map(information).sum();
        let distance = holding().map(|p| sighted[p.observation].1.observation.polar.x).sum::<f64>() / n.max(1) as f64;
        self.quality.observed = sighted.len();
        self.quality.matched = n;
        self.quality.nis = holding().map(|p| p.distance_sq).sum();
        self.quality.dof = 2 * n;
        if self.expects_matches() {
            self.monitor.see(n, sighted.len());
        }
        self.judge(&sum, distance);
    }

    /// Whether there are landmarks that could be matched at all.
    fn expects_matches(&self) -> bool {
        let on_map = self.options.mode.uses_map() && !self.map.landmarks().is_empty();
        on_map || self.memory.all_found().any(|(_, f)| f.proven)
    }
}

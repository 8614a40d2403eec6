//! The landmarks of the filter: what a scan teaches it.
//!
//! 1. Gates, and slots for the landmarks of the map that pass them.
//! 2. Association, the pose alone learning.
//! 3. Where the pose moved far, the pairings are linearised again at the better pose; where landmarks learn as well, the
//!    scan is taken again with all gains: `r = z - h(x_1) + H Jr(d) d`, `x_1 = x exp(d)`.
//! 4. Landmarks found during the drive are seen, missed, begun, proven, forgotten.

use crate::associate::{Association, Open, Pairing};
use crate::gates::Gates;
use crate::gating::{Gating, Sighted, linearize};
use crate::integrity::Support;
use crate::joint::{Gain, Joint, Linear};
use crate::map::StaticMap;
use crate::measurement::Viewpoint;
use crate::memory::{Changes, Found, Memory};
use crate::options::{Mode, Options};
use crate::update::{Match, View};
use groma_geometry::{Se2, wrap};
use groma_models::LandmarkKind;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::sync::Arc;

/// A pose that moves by more than this is linearised again [m], [rad].
const FAR: (f64, f64) = (0.02, 0.004);
/// In mixed mode landmarks are begun where so many of the map update the pose.
const ANCHORS: usize = 2;

/// Landmarks found during the drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FoundCount {
    /// Those that update the pose.
    pub proven: usize,
    /// Those that do not yet.
    pub on_trial: usize,
}

/// Observations of a scan, and from where they were made.
pub(crate) struct Scan<'a> {
    /// The observations that can be used, with their place in the list.
    pub sighted: &'a [(usize, Sighted<'a>)],
    /// Which places the scan would show, where that is known.
    pub view: Option<View<'a>>,
    /// `T_base_laser`.
    pub mount: Se2,
    /// Time of the last motion [s].
    pub stamp: f64,
    /// Distance driven [m].
    pub distance: f64,
}

/// What a scan has changed.
pub(crate) struct Learned {
    pairings: Vec<Pairing>,
    pub matches: Vec<Match>,
    pub changes: Changes,
    pub begun: usize,
    pub cut_short: bool,
}

/// The joint state of pose and landmarks, the map, and which landmarks are remembered.
#[derive(Clone, Debug)]
pub(crate) struct LandmarkFilter {
    pub joint: Joint,
    options: Options,
    /// Shared: the states of a filter that is set back and continues have the same map.
    map: Arc<StaticMap>,
    memory: Memory,
    /// chi2(2 k, p) of k pairings.
    gates: Gates,
    scans: u64,
}

impl LandmarkFilter {
    /// Nothing remembered yet.
    pub fn new(joint: Joint, map: Arc<StaticMap>, options: Options) -> Self {
        let memory = Memory::new(map.landmarks().len());
        Self { joint, options, map, memory, gates: Gates::new(options.gate), scans: 0 }
    }

    /// The settings.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// How many landmarks were found during the drive.
    pub fn found(&self) -> FoundCount {
        let proven = self.memory.all_found().filter(|(_, f)| f.proven).count();
        FoundCount { proven, on_trial: self.memory.all_found().count() - proven }
    }

    /// The pose has been found another way: nothing else is remembered.
    pub fn relocate(&mut self, pose: Se2, covariance: &Matrix3<f64>) {
        self.memory.clear(&mut self.joint);
        self.joint.replace_pose(pose, covariance);
    }

    /// Associates a scan, and moves the pose and the landmarks that learn.
    pub fn update(&mut self, scan: &Scan<'_>) -> Learned {
        self.scans += 1;
        self.memory.limit(&mut self.joint, self.options.memory);
        let open = self.open(scan.sighted);
        let (pairings, cut_short) = self.learn(open, scan.sighted);
        let matches = self.matches(&pairings, scan.sighted);
        self.record(&pairings, scan);
        let creates = self.options.mode.creates();
        let changes = if creates { self.live_on(&pairings, scan) } else { Changes::default() };
        let begun = if creates { self.begin(&pairings, scan) } else { 0 };
        Learned { pairings, matches, changes, begun, cut_short }
    }

    /// How the landmarks of a scan constrain the pose, their number, and the sum of their squared innovations.
    pub fn support(&self, learned: &Learned, sighted: &[(usize, Sighted<'_>)]) -> (Support, usize, f64) {
        let pairs = learned.matches.iter().zip(&learned.pairings);
        let holding: Vec<&Pairing> = pairs.filter(|(m, _)| m.holds).map(|(_, p)| p).collect();
        let information = |p: &&Pairing| {
            let noise = p.linear.noise.try_inverse().unwrap_or_else(Matrix2::zeros);
            p.linear.by_pose.transpose() * noise * p.linear.by_pose
        };
        let range = |p: &&Pairing| sighted[p.observation].1.observation.polar.x;
        let distance = holding.iter().map(range).sum::<f64>() / holding.len().max(1) as f64;
        let nis = holding.iter().map(|p| p.distance_sq).sum();
        (Support { information: holding.iter().map(information).sum(), distance }, holding.len(), nis)
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

    fn matches(&self, pairings: &[Pairing], sighted: &[(usize, Sighted<'_>)]) -> Vec<Match> {
        let to_match = |p: &Pairing| Match {
            observation: sighted[p.observation].0,
            landmark: p.landmark,
            holds: self.gain(p) != Gain::Landmark,
            innovation: p.linear.residual,
            covariance: p.covariance,
        };
        pairings.iter().map(to_match).collect()
    }

    /// Writes down who was seen.
    fn record(&mut self, pairings: &[Pairing], scan: &Scan<'_>) {
        for pairing in pairings {
            let Some((slot, _)) = pairing.linear.landmark else { continue };
            self.memory.touch(slot, self.scans);
            if let Some(found) = self.memory.found_mut(slot) {
                found.hits += 1;
                found.visible += 1;
                (found.misses, found.distance, found.stamp) = (0, scan.distance, scan.stamp);
                let descriptor = scan.sighted[pairing.observation].1.observation.descriptor;
                found.descriptor = found.descriptor.or(descriptor);
            }
        }
    }

    /// Landmarks found during the drive that were missed, proven, forgotten.
    fn live_on(&mut self, pairings: &[Pairing], scan: &Scan<'_>) -> Changes {
        if let Some(view) = scan.view {
            let to_laser = (self.joint.pose() * scan.mount).inverse();
            for slot in 0..self.memory.slots().len() {
                let seen = pairings.iter().any(|p| p.linear.landmark.is_some_and(|(s, _)| s == slot));
                let q = to_laser.act(self.joint.points()[slot]);
                let sight = Vector2::new(q.norm(), q.y.atan2(q.x));
                let in_view = !seen && sight.x <= self.options.range_max && view(sight);
                if let Some(found) = self.memory.found_mut(slot).filter(|_| in_view) {
                    found.visible += 1;
                    found.misses += 1;
                }
            }
        }
        self.memory.review(&mut self.joint, scan.distance, scan.stamp, &self.options.dynamic)
    }

    /// Begins landmarks where nothing was known; their number.
    fn begin(&mut self, pairings: &[Pairing], scan: &Scan<'_>) -> usize {
        let on_map = pairings.iter().filter(|p| p.landmark < self.map.landmarks().len()).count();
        let p = self.joint.pose_covariance();
        let sure = (p.m11 + p.m22).sqrt() < self.options.dynamic.anchor_sigma;
        if self.options.mode == Mode::Mixed && on_map < ANCHORS && !sure {
            return 0;
        }
        let room = self.options.dynamic.count_max.saturating_sub(self.memory.all_found().count());
        let paired = |k: usize| pairings.iter().any(|p| p.observation == k);
        let strange = scan.sighted.iter().enumerate().filter(|(k, _)| !paired(*k)).map(|(_, (_, s))| s);
        let mut begun = 0;
        for s in strange {
            if begun < room && s.observation.identity.is_none() && self.begin_one(s, scan) {
                begun += 1;
            }
        }
        begun
    }

    /// Begins a landmark, if none is near.
    fn begin_one(&mut self, sighted: &Sighted<'_>, scan: &Scan<'_>) -> bool {
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
            distance: scan.distance,
            stamp: scan.stamp,
        });
        true
    }

    /// Whether there are landmarks that could be matched at all.
    pub fn expects_matches(&self) -> bool {
        let on_map = self.options.mode.uses_map() && !self.map.landmarks().is_empty();
        on_map || self.memory.all_found().any(|(_, f)| f.proven)
    }
}

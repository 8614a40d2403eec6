//! Places seen before, found by their corners alone: no odometry, no first guess, no graph.
//!
//! ```text
//! track      every scan is registered to the last metres (`tracker`); keyframes have FALKO corners
//! describe   every `step` of drive, a local map of the last `length`: surfaces, corners, GLAROT signature
//! retrieve   the most similar of the local maps that ended at least `gap` of drive before
//! associate  the corners of both: motions that pair most of them
//! verify     the motions with most pairs: registration of the surfaces, and what the views say of them (`verify`)
//! decide     one closure at most for a local map; accepted when a second agrees (`decide`)
//! ```
//!
//! Every step uses what was seen up to the local map and no more. Each is a call of its own, so that it can be timed and
//! its outcome looked at. It is the loop closure of [`mapper`](crate::mapper) without what the graph knows: how far corners
//! alone get, and the measure of a detector.
//!
//! Source of the two steps: Kallasi, Rizzini, IROS 2016. Verification by views and confirmation by a second closure are
//! our own.

mod decide;
mod options;

pub use decide::{Loop, Verdict};
pub use options::Options;

use crate::corners::Corners;
use crate::keyframe::Keyframe;
use crate::local_map::LocalMap;
use crate::verify::{Check, check};
use groma_features::association::associate_facing;
use groma_features::glarot::{Candidate, Index};
use groma_geometry::Se2;
use groma_models::{Cancelled, LaserScan, Token};
use groma_registration::PolarView;
use groma_tracking::{Tracker, has_enough_hits};
use rayon::prelude::*;

/// A motion between two local maps that the corners suggest.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// The earlier local map.
    pub place: usize,
    /// `T_place_query`.
    pub motion: Se2,
    /// Corners paired.
    pub pairs: usize,
}

/// A proposal shown to the surfaces and views of both.
#[derive(Clone, Debug)]
pub struct Verified {
    /// What was proposed.
    pub proposal: Proposal,
    /// What became of it.
    pub check: Check,
}

/// A scan, and the keyframe its pose depends on.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Time of the scan [s].
    pub stamp: f64,
    /// Pose of the vehicle in the tracked frame.
    pub tracked: Se2,
    /// The last keyframe up to the scan.
    pub keyframe: usize,
}

/// Finds places again.
pub struct Recognizer {
    options: Options,
    tracker: Tracker,
    corners: Corners,
    keyframes: Vec<Keyframe>,
    /// Path up to each keyframe [m].
    driven: Vec<f64>,
    /// First keyframe of the stretch that each belongs to, within which the track is taken to hold.
    unbroken: Vec<usize>,
    scans: Vec<Placed>,
    /// In the frame of their last keyframe.
    maps: Vec<LocalMap>,
    index: Index,
}

impl Recognizer {
    /// Nothing seen yet; the options are assumed valid.
    #[must_use]
    pub fn new(options: Options) -> Self {
        Self {
            corners: Corners::new(options.corners),
            options,
            tracker: Tracker::default(),
            keyframes: Vec::new(),
            driven: Vec::new(),
            unbroken: Vec::new(),
            scans: Vec::new(),
            maps: Vec::new(),
            index: Index::new(),
        }
    }

    /// Tracks a scan of a laser mounted at `t_base_laser`; false, and nothing changed, if its stamp does not rise or it has too
    /// few hits.
    pub fn push_scan(&mut self, scan: &LaserScan, t_base_laser: &Se2) -> bool {
        let late = scan.validate().is_err() || self.scans.last().is_some_and(|s| scan.stamp <= s.stamp);
        if late || !has_enough_hits(scan) {
            return false;
        }
        let sweep = self.tracker.velocity();
        let view = PolarView::new(scan, t_base_laser, sweep);
        let step = self.tracker.step(scan.stamp, view, None);
        if let Some(tracked) = step.keyframe {
            let corners = self.corners.find(scan, &tracked.view);
            self.keyframes.push(Keyframe { corners, ..Keyframe::from(tracked) });
            let leapt = self.scans.last().is_some_and(|s| {
                let d = s.tracked.between(&step.pose);
                d.translation.norm() > self.options.leap || d.theta().abs() > self.options.leap_turn
            });
            self.advance(leapt);
        }
        self.scans.push(Placed { stamp: scan.stamp, tracked: step.pose, keyframe: self.keyframes.len() - 1 });
        true
    }

    /// Takes note of the way to the last keyframe, and whether the track may be wrong there.
    fn advance(&mut self, leapt: bool) {
        let last = self.keyframes.len() - 1;
        let way = match &self.keyframes[..] {
            [.., before, last] => before.tracked.pose.between(&last.tracked.pose).translation.norm(),
            _ => 0.0,
        };
        self.driven.push(self.driven.last().unwrap_or(&0.0) + way);
        let before = self.unbroken.last().copied().unwrap_or(0);
        self.unbroken.push(if leapt || self.keyframes[last].tracked.torn { last } else { before });
    }

    /// The scans taken, in order of time.
    #[must_use]
    pub fn scans(&self) -> &[Placed] {
        &self.scans
    }

    /// Path up to the keyframe of a scan [m].
    #[must_use]
    pub fn driven(&self, scan: &Placed) -> f64 {
        self.driven[scan.keyframe]
    }

    /// The local maps described so far.
    #[must_use]
    pub fn maps(&self) -> &[LocalMap] {
        &self.maps
    }

    /// Makes the local maps and their signatures.
    ///
    /// # Errors
    /// When `token` is cancelled; nothing has changed then. So it is with all that follows.
    pub fn describe(&mut self, token: &Token) -> Result<(), Cancelled> {
        let stretches = self.stretches();
        let of = |&(first, last): &(usize, usize)| {
            token.check()?;
            Ok(LocalMap::of_stretch(first..last + 1, self.keyframes[last].tracked.pose, &self.keyframes))
        };
        self.maps = stretches.par_iter().map(of).collect::<Result<_, Cancelled>>()?;
        self.index = Index::new();
        for map in &self.maps {
            self.index.add(&map.signature);
        }
        Ok(())
    }

    /// First and last keyframe of every local map.
    fn stretches(&self) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        let (mut first, mut due) = (0, self.options.step);
        for (last, way) in self.driven.iter().enumerate().filter(|(_, way)| **way > 0.0) {
            while self.driven[first] < way - self.options.length {
                first += 1;
            }
            first = first.max(self.unbroken[last]);
            if *way >= due {
                found.push((first, last));
                due = way + self.options.step;
            }
        }
        found
    }

    /// Last keyframe of a local map.
    #[must_use]
    pub fn end(&self, map: usize) -> usize {
        self.maps[map].keyframes.end - 1
    }

    fn is_earlier(&self, place: usize, query: usize) -> bool {
        self.driven[self.end(query)] - self.driven[self.end(place)] >= self.options.gap
    }

    /// For every local map, the earlier ones that look most like it.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn retrieve(&self, token: &Token) -> Result<Vec<Vec<Candidate>>, Cancelled> {
        let query = |n: usize| {
            token.check()?;
            let ranked = self
                .index
                .query(&self.maps[n].signature, 10 * self.options.candidates, |m| m < n && self.is_earlier(m, n));
            Ok(self.spaced(ranked))
        };
        (0..self.maps.len()).into_par_iter().map(query).collect()
    }

    /// The best of candidates that end some metres of drive apart.
    fn spaced(&self, ranked: Vec<Candidate>) -> Vec<Candidate> {
        let way = |c: &Candidate| self.driven[self.end(c.index)];
        let mut kept: Vec<Candidate> = Vec::new();
        for c in ranked {
            if kept.len() < self.options.candidates
                && kept.iter().all(|k| (way(k) - way(&c)).abs() >= self.options.spacing)
            {
                kept.push(c);
            }
        }
        kept
    }

    /// For every local map, the motions that pair most corners with those of its candidates.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn associate(&self, candidates: &[Vec<Candidate>], token: &Token) -> Result<Vec<Vec<Proposal>>, Cancelled> {
        let of = |(n, candidates): (usize, &Vec<Candidate>)| {
            token.check()?;
            let mut proposals: Vec<Proposal> = candidates.iter().flat_map(|c| self.proposals(c.index, n)).collect();
            proposals.sort_by_key(|p| std::cmp::Reverse(p.pairs));
            proposals.truncate(self.options.verified);
            Ok(proposals)
        };
        candidates.par_iter().enumerate().map(of).collect()
    }

    fn proposals(&self, place: usize, query: usize) -> impl Iterator<Item = Proposal> {
        let of = |n: usize| (&self.maps[n].corners[..], &self.maps[n].facing[..]);
        let found = associate_facing(of(place), of(query), &self.options.association, self.options.facing);
        found.into_iter().map(move |h| Proposal { place, motion: h.transform, pairs: h.pairs.len() })
    }

    /// Every proposal with what surfaces and views say of it.
    ///
    /// # Errors
    /// When `token` is cancelled.
    pub fn verify(&self, proposals: &[Vec<Proposal>], token: &Token) -> Result<Vec<Vec<Verified>>, Cancelled> {
        let verified = |n: usize, p: &Proposal| {
            token.check()?;
            let check = check(&self.maps[p.place], &self.maps[n], p.motion, &self.keyframes);
            Ok(Verified { check, proposal: p.clone() })
        };
        let of = |(n, all): (usize, &Vec<Proposal>)| all.iter().map(|p| verified(n, p)).collect();
        proposals.par_iter().enumerate().map(of).collect()
    }

    /// What is made of it: one closure at most for every local map.
    #[must_use]
    pub fn decide(&self, verified: &[Vec<Verified>]) -> Vec<Loop> {
        decide::decide(verified, &self.maps, &self.options)
    }
}

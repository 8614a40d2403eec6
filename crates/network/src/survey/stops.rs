//! Where the robot stood, what the cameras saw there, and how it drove from one stop to the next.
//!
//! Detections whose odometry has not moved since the first of them belong to one stop; so do all that carry the number of
//! one stop, whatever the clocks say. Between two stops the odometry is taken sample by sample.

use super::{Detection, Survey};
use crate::Error;
use crate::odometry::Motion;
use crate::options::Options;
use crate::standstill::is_still;
use crate::view::{Corner, average};
use groma_geometry::Se2;
use groma_models::Token;
use std::collections::BTreeMap;

/// A stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Halt {
    /// Mean time of what was seen [s].
    pub stamp: f64,
    /// Odometry there.
    pub pose: Se2,
    /// The steps of the odometry from the stop before; none for the first stop, which is the origin of the world.
    pub steps: Vec<Se2>,
    /// The motion that they make up.
    pub motion: Motion,
    /// What each camera saw, by its number.
    pub seen: Vec<Seen>,
}

/// What one camera saw at a stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Number of the camera.
    pub camera: usize,
    /// Images in which it saw the target.
    pub images: usize,
    /// Its corners, averaged.
    pub corners: Vec<Corner>,
}

/// The stops in order of time.
pub(super) fn halts(survey: &Survey, options: &Options, token: &Token) -> Result<Vec<Halt>, Error> {
    let track = track(survey);
    if track.len() < 2 {
        return Err(Error::NoData("there is no odometry: the network hangs together by it".into()));
    }
    let groups = groups(&detections(survey), &track);
    if groups.is_empty() {
        return Err(Error::NoData("no camera saw the target while the odometry ran: compare their clocks".into()));
    }
    let mut at = None;
    let mut halts = Vec::with_capacity(groups.len());
    for group in &groups {
        token.check()?;
        let stamp = group.iter().map(|d| d.stamp).sum::<f64>() / group.len() as f64;
        let Some(pose) = interpolated(&track, stamp) else { continue };
        let steps = at.map_or(vec![], |at| steps(&track, at, (stamp, pose)));
        let motion = steps.iter().fold(Motion::default(), |m, step| m.then(step, &options.odometry));
        halts.push(Halt { stamp, pose, steps, motion, seen: seen(survey, group, options) });
        at = Some((stamp, pose));
    }
    Ok(halts)
}

/// Odometry by stamp, each stamp once.
fn track(survey: &Survey) -> Vec<(f64, Se2)> {
    let mut track = survey.odometry.clone();
    let key = |p: &Se2| p.to_vector();
    track.sort_by(|a, b| {
        let (p, q) = (key(&a.1), key(&b.1));
        a.0.total_cmp(&b.0).then_with(|| {
            (0..3).map(|k| p[k].total_cmp(&q[k])).find(|o| o.is_ne()).unwrap_or(std::cmp::Ordering::Equal)
        })
    });
    track.dedup_by_key(|sample| sample.0);
    track
}

/// Detections in an order that does not depend on that of their arrival, each once.
fn detections(survey: &Survey) -> Vec<&Detection> {
    let mut all: Vec<&Detection> = survey.detections.iter().collect();
    let pixels = |d: &Detection| d.pixels.iter().flat_map(|p| [p.x.to_bits(), p.y.to_bits()]).collect::<Vec<_>>();
    all.sort_by(|a, b| {
        a.stamp
            .total_cmp(&b.stamp)
            .then_with(|| (a.camera, a.panel, a.stop, &a.ids).cmp(&(b.camera, b.panel, b.stop, &b.ids)))
            .then_with(|| pixels(a).cmp(&pixels(b)))
    });
    all.dedup_by(|a, b| a == b);
    all
}

/// Detections of one stop, in order of time; those outside the odometry's time belong to none.
fn groups<'a>(all: &[&'a Detection], track: &[(f64, Se2)]) -> Vec<Vec<&'a Detection>> {
    let mut groups: Vec<Vec<&Detection>> = vec![];
    let mut numbered: BTreeMap<u64, usize> = BTreeMap::new();
    let mut open: Option<(usize, Se2)> = None;
    for &detection in all {
        let Some(pose) = interpolated(track, detection.stamp) else { continue };
        if let Some(&group) = detection.stop.and_then(|stop| numbered.get(&stop)) {
            groups[group].push(detection);
            continue;
        }
        let labelled = detection.stop.is_some();
        match open.filter(|(_, at)| !labelled && is_still(at, &pose)) {
            Some((group, _)) => groups[group].push(detection),
            None => {
                groups.push(vec![detection]);
                let group = groups.len() - 1;
                open = (!labelled).then_some((group, pose));
                if let Some(stop) = detection.stop {
                    numbered.insert(stop, group);
                }
            }
        }
    }
    let mean = |g: &Vec<&Detection>| g.iter().map(|d| d.stamp).sum::<f64>() / g.len() as f64;
    groups.sort_by(|a, b| mean(a).total_cmp(&mean(b)));
    groups
}

fn interpolated(track: &[(f64, Se2)], stamp: f64) -> Option<Se2> {
    let after = track.partition_point(|(t, _)| *t < stamp);
    let next = track.get(after)?;
    if next.0 == stamp {
        return Some(next.1);
    }
    let last = track.get(after.checked_sub(1)?)?;
    let share = (stamp - last.0) / (next.0 - last.0);
    let moved = last.1.between(&next.1);
    Some(last.1 * Se2::exp(moved.log() * share))
}

/// The steps from one moment to another, sample by sample; steps of no length are left out.
fn steps(track: &[(f64, Se2)], from: (f64, Se2), to: (f64, Se2)) -> Vec<Se2> {
    let (first, end) = (track.partition_point(|s| s.0 <= from.0), track.partition_point(|s| s.0 < to.0));
    let between = track.get(first..end).unwrap_or(&[]).iter().map(|sample| sample.1);
    let mut steps = vec![];
    let mut last = from.1;
    for pose in between.chain([to.1]) {
        let step = last.between(&pose);
        if step.translation.norm() > 0.0 || step.theta() != 0.0 {
            steps.push(step);
        }
        last = pose;
    }
    steps
}

fn seen(survey: &Survey, group: &[&Detection], options: &Options) -> Vec<Seen> {
    let mut by_camera: BTreeMap<usize, Vec<&Detection>> = BTreeMap::new();
    for detection in group {
        by_camera.entry(detection.camera).or_default().push(detection);
    }
    let averaged = |(camera, all): (usize, Vec<&Detection>)| {
        let panels = all.iter().map(|d| (d.panel, d.ids.as_slice(), d.pixels.as_slice(), d.sigmas.as_slice()));
        let (corners, _) = average(&survey.target, panels);
        let mut stamps: Vec<u64> = all.iter().map(|d| d.stamp.to_bits()).collect();
        stamps.sort_unstable();
        stamps.dedup();
        Seen { camera, images: stamps.len(), corners }
    };
    by_camera.into_iter().map(averaged).filter(|seen| seen.corners.len() >= options.corners).collect()
}

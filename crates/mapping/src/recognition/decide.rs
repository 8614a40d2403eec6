//! Which of the verified motions is a closure.
//!
//! The motion with the largest overlap times share is taken; it is refused where views disagree, there is too little to judge
//! by, another pose of the same place does as well, or it slides along an unconstrained direction. Two
//! closures `(a, b)`, `(c, d)` within some metres of drive of b and d agree when
//!
//! ```text
//! T_a_b T_b_d = T_a_c T_c_d     to within the agreement,     T_a_c and T_b_d as tracked
//! ```
//!
//! and both are then accepted. Where the drive from a to c is longer than that of the local maps, tracking cannot tell
//! and they do not confirm each other.

use super::{Options, Verified};
use crate::closure::invert;
use crate::local_map::LocalMap;
use groma_geometry::Se2;

/// What became of a closure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// A second closure agrees.
    Accepted,
    /// None has agreed yet.
    Unconfirmed,
    /// The views disagree.
    NoOverlap,
    /// There is too little in common view to tell.
    TooLittle,
    /// It fits in two places.
    Ambiguous,
    /// Some direction is unconstrained.
    Slides,
}

/// A closure that was considered.
#[derive(Clone, Debug)]
pub struct Loop {
    /// The earlier local map.
    pub from: usize,
    /// The later one.
    pub to: usize,
    /// What was found.
    pub verified: Verified,
    /// What became of it.
    pub verdict: Verdict,
}

pub(super) fn decide(verified: &[Vec<Verified>], maps: &[LocalMap], options: &Options) -> Vec<Loop> {
    let best = |(to, all): (usize, &Vec<Verified>)| choose(to, all, options);
    let mut loops: Vec<Loop> = verified.iter().enumerate().filter_map(best).collect();
    confirm(&mut loops, maps, options);
    loops
}

fn merit(v: &Verified) -> f64 {
    v.check.overlap * v.check.share
}

fn choose(to: usize, all: &[Verified], options: &Options) -> Option<Loop> {
    let best = all.iter().max_by(|x, y| merit(x).total_cmp(&merit(y)))?;
    let verdict = judge(best, all, options);
    Some(Loop { from: best.proposal.place, to, verified: best.clone(), verdict })
}

fn judge(best: &Verified, all: &[Verified], options: &Options) -> Verdict {
    let check = &best.check;
    if check.overlap < options.overlap {
        return Verdict::NoOverlap;
    }
    if check.share < options.support || check.common < options.support {
        return Verdict::TooLittle;
    }
    let elsewhere = |o: &&Verified| {
        let d = check.pose.between(&o.check.pose);
        o.proposal.place == best.proposal.place && (d.translation.norm() > 0.3 || d.theta().abs() > 0.1)
    };
    let rivals = all.iter().filter(elsewhere);
    if rivals.into_iter().any(|o| o.check.overlap > check.overlap - options.rival && o.check.share > check.share * 0.85)
    {
        return Verdict::Ambiguous;
    }
    let covariance = invert(&check.information);
    let weakest = covariance.fixed_view::<2, 2>(0, 0).into_owned().symmetric_eigenvalues().max();
    if covariance == nalgebra::Matrix3::zeros() || weakest > options.slides * options.slides {
        return Verdict::Slides;
    }
    Verdict::Unconfirmed
}

/// Accepts the closures that a second one agrees with.
fn confirm(loops: &mut [Loop], maps: &[LocalMap], options: &Options) {
    let waiting: Vec<usize> = (0..loops.len()).filter(|k| loops[*k].verdict == Verdict::Unconfirmed).collect();
    let mut confirmed = vec![false; loops.len()];
    for (n, &later) in waiting.iter().enumerate() {
        for &earlier in waiting[..n].iter().rev() {
            let way = driven(maps, loops[earlier].to, loops[later].to);
            if way > options.confirmed_within {
                break;
            }
            if way >= options.confirmed_from && agree(&loops[earlier], &loops[later], maps, options) {
                (confirmed[earlier], confirmed[later]) = (true, true);
            }
        }
    }
    loops.iter_mut().zip(confirmed).filter(|(_, c)| *c).for_each(|(l, _)| l.verdict = Verdict::Accepted);
}

/// Path between the ends of two local maps, `a` before `b` [m].
fn driven(maps: &[LocalMap], a: usize, b: usize) -> f64 {
    let path: Vec<Se2> = maps[a..=b].iter().map(|m| m.anchor).collect();
    path.windows(2).map(|w| w[0].between(&w[1]).translation.norm()).sum()
}

fn agree(x: &Loop, y: &Loop, maps: &[LocalMap], options: &Options) -> bool {
    let (first, last) = (x.from.min(y.from), x.from.max(y.from));
    if driven(maps, first, last) > options.length {
        return false;
    }
    let tracked = |a: usize, b: usize| maps[a].anchor.between(&maps[b].anchor);
    let one = x.verified.check.pose * tracked(x.to, y.to);
    let other = tracked(x.from, y.from) * y.verified.check.pose;
    let apart = one.between(&other);
    apart.translation.norm() <= options.agreement && apart.theta().abs() <= options.agreement_turn
}

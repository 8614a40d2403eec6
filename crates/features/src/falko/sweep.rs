//! Which beams have a corner's triangle with their furthest neighbours, for as many beams side by side as a vector holds.
//!
//! The triangle needs the first and the last neighbour only, so the sweep goes from the farthest beams that can be
//! neighbours inwards until all have found theirs; nearly all beams end here. The same operations are done for every beam
//! whatever the width of the vectors, so the outcome is the same to the last bit.

use super::layout::{Layout, PaddedRanges};
use super::neighbourhood::LANES;
use pulp::Simd;

/// Steps of the sweep after which it is asked whether all have found their neighbours.
const STRIDE: usize = 4;

/// A beam with a corner's triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Triangle {
    pub index: usize,
    /// Radius of the neighbourhood [m].
    pub radius: f64,
    /// Index distance of the farther of the first and the last neighbour.
    pub reach: usize,
}

/// Where beams are looked for.
pub(super) struct Sweep<'a> {
    pub ranges: &'a PaddedRanges,
    pub layout: &'a Layout,
    /// Of every beam, 0 where it cannot be a corner, with lanes to spare.
    pub radius: &'a [f64],
    pub beta: f64,
}

/// Beams that are swept side by side.
#[derive(Clone, Copy)]
struct Group<S: Simd> {
    rho: S::f64s,
    radius: S::f64s,
    /// 2 rho, and r^2 - rho^2; the latter minus infinity where the beam cannot be a corner.
    twice: S::f64s,
    slack: S::f64s,
}

/// Furthest neighbour of each beam of a group on one side.
#[derive(Clone, Copy)]
struct Furthest<S: Simd> {
    /// Index distance, 0 where there is none.
    distance: S::f64s,
    /// Where it is, in the frame of the beam: along it from the scanner, and across it.
    along: S::f64s,
    across: S::f64s,
}

#[inline(always)]
fn load<S: Simd>(values: &[f64]) -> S::f64s {
    S::as_simd_f64s(values).0[0]
}

#[inline(always)]
fn any<S: Simd>(simd: S, mask: S::m64s) -> bool {
    simd.first_true_m64s(mask) < S::F64_LANES
}

impl Sweep<'_> {
    /// Replace `out` by the beams that have a corner's triangle.
    #[inline(always)]
    pub fn triangles<S: Simd>(&self, simd: S, out: &mut Vec<Triangle>) {
        out.clear();
        for first in (0..self.layout.beams).step_by(S::F64_LANES) {
            let rho = load::<S>(self.ranges.at_and_after(first));
            let group = Group::new(simd, rho, load::<S>(&self.radius[first..]));
            let reach = self.layout.reach_at(group.steepest(simd));
            if reach > 0 {
                let (left, right) = self.furthest(simd, first, &group, reach);
                self.judge(simd, first, &group, &left, &right, out);
            }
        }
    }

    /// The furthest neighbours of a group, from index distance `reach` inwards.
    #[inline(always)]
    fn furthest<S: Simd>(&self, simd: S, first: usize, group: &Group<S>, reach: usize) -> (Furthest<S>, Furthest<S>) {
        let zero = simd.splat_f64s(0.0);
        let none = Furthest { distance: zero, along: zero, across: zero };
        let (mut left, mut right) = (none, none);
        let (ahead, behind) = (self.ranges.at_and_after(first), self.ranges.before(first + S::F64_LANES));
        let start = behind.len() - S::F64_LANES;
        let mut k = reach;
        while k > 0 {
            let next = k.saturating_sub(STRIDE);
            while k > next {
                let at = (k as f64, self.layout.cos[k], self.layout.sin[k]);
                right.offer(simd, at, load::<S>(&ahead[k..]), group);
                left.offer(simd, at, load::<S>(&behind[start - k..]), group);
                k -= 1;
            }
            let lacks = simd.equal_f64s(simd.mul_f64s(left.distance, right.distance), zero);
            if !any(simd, simd.and_m64s(lacks, simd.less_than_f64s(zero, group.radius))) {
                break;
            }
        }
        (left, right)
    }

    /// Append the beams of which base and height of the triangle (first, own, last) reach r / beta: squared, so without a root.
    #[inline(always)]
    fn judge<S: Simd>(
        &self,
        simd: S,
        first: usize,
        group: &Group<S>,
        left: &Furthest<S>,
        right: &Furthest<S>,
        out: &mut Vec<Triangle>,
    ) {
        let (mul, sub) = (|a, b| simd.mul_f64s(a, b), |a, b| simd.sub_f64s(a, b));
        let (left_x, right_x) = (sub(left.along, group.rho), sub(right.along, group.rho));
        let (x, y) = (sub(right_x, left_x), simd.add_f64s(right.across, left.across));
        let base_sq = simd.add_f64s(mul(x, x), mul(y, y));
        let twice_area = simd.add_f64s(mul(right_x, left.across), mul(right.across, left_x));
        let least = simd.div_f64s(group.radius, simd.splat_f64s(self.beta));
        let least_sq = mul(least, least);
        let wide = simd.less_than_or_equal_f64s(least_sq, base_sq);
        let high = simd.less_than_or_equal_f64s(mul(least_sq, base_sq), mul(twice_area, twice_area));
        let both = simd.less_than_f64s(simd.splat_f64s(0.0), mul(left.distance, right.distance));
        let corner = simd.and_m64s(both, simd.and_m64s(wide, high));
        if any(simd, corner) {
            let farther = simd.less_than_f64s(left.distance, right.distance);
            let reach = simd.select_f64s(farther, right.distance, left.distance);
            let mut lanes = [0.0; LANES];
            let chosen = simd.select_f64s(corner, reach, simd.splat_f64s(0.0));
            simd.partial_store_f64s(&mut lanes[..S::F64_LANES], chosen);
            for (index, reach) in (first..).zip(lanes).filter(|(_, reach)| *reach > 0.0) {
                out.push(Triangle { index, radius: self.radius[index], reach: reach as usize });
            }
        }
    }
}

impl<S: Simd> Group<S> {
    #[inline(always)]
    fn new(simd: S, rho: S::f64s, radius: S::f64s) -> Self {
        let slack = simd.sub_f64s(simd.mul_f64s(radius, radius), simd.mul_f64s(rho, rho));
        let can = simd.less_than_f64s(simd.splat_f64s(0.0), radius);
        let slack = simd.select_f64s(can, slack, simd.splat_f64s(f64::NEG_INFINITY));
        Self { rho, radius, twice: simd.add_f64s(rho, rho), slack }
    }

    /// Largest ratio of radius and range; 0 where no beam can be a corner.
    #[inline(always)]
    fn steepest(&self, simd: S) -> f64 {
        let (ratio, zero) = (simd.div_f64s(self.radius, self.rho), simd.splat_f64s(0.0));
        simd.reduce_max_f64s(simd.select_f64s(simd.less_than_f64s(zero, ratio), ratio, zero))
    }
}

impl<S: Simd> Furthest<S> {
    /// Take the neighbours at one index distance where no further one was found; `at` is the distance, and cosine and sine of
    /// its angle.
    #[inline(always)]
    fn offer(&mut self, simd: S, (k, cos, sin): (f64, f64, f64), rho: S::f64s, group: &Group<S>) {
        let (cos, sin) = (simd.splat_f64s(cos), simd.splat_f64s(sin));
        let short = simd.sub_f64s(rho, simd.mul_f64s(group.twice, cos));
        let near = simd.less_than_or_equal_f64s(simd.mul_f64s(rho, short), group.slack);
        let new = simd.and_m64s(near, simd.equal_f64s(self.distance, simd.splat_f64s(0.0)));
        self.distance = simd.select_f64s(new, simd.splat_f64s(k), self.distance);
        self.along = simd.select_f64s(new, simd.mul_f64s(rho, cos), self.along);
        self.across = simd.select_f64s(new, simd.mul_f64s(rho, sin), self.across);
    }
}

//! Histograms of half the bins, in bytes: their differences bound those of the whole from below, at an eighth of the cost.
//!
//! Two bins that are neighbours in length have the sum h; q = min(floor(h / 2), 255). Floor and minimum bring no two numbers
//! farther apart, so
//!
//! ```text
//! sum | g - f |  >=  sum | h_g - h_f |  >=  2 sum | q_g - q_f | - (number of q)
//! ```
//!
//! Eight histograms lie side by side, eight bytes of each in turn, so that one instruction (`psadbw`) sums eight differences for
//! as many histograms as a vector has lanes, for every shift in turn. Without such an instruction the sums are the same, and slower.

use super::difference::Doubled;
use pulp::{Arch, NullaryFnOnce, Scalar, Simd};

/// Histograms side by side.
pub(super) const GROUP: usize = 8;
/// Shifts that are summed in registers at a time.
const TILE: usize = 4;

/// Eight bytes of one histogram.
type Word = u64;

/// The words of a histogram of rows of `row` bins, zeros after the last of a row.
pub(super) fn words(bins: &[u16], row: usize) -> Vec<Word> {
    let byte = |pair: &[u16]| (pair.iter().map(|&b| u32::from(b)).sum::<u32>() / 2).min(255) as u8;
    let word = |bins: &[u16]| bins.chunks(2).map(byte).rev().fold(0, |word, byte| word << 8 | u64::from(byte));
    bins.chunks(row).flat_map(|row| row.chunks(16).map(word)).collect()
}

/// Words of a row of `row` bins.
pub(super) fn words_per_row(row: usize) -> usize {
    row.div_ceil(16)
}

/// Histograms in groups of eight.
#[derive(Clone, Debug, Default)]
pub(super) struct Halves {
    /// One word of each histogram of a group, then the next.
    words: Vec<[Word; GROUP]>,
    /// Words of a histogram.
    length: usize,
}

impl Halves {
    /// Put a histogram at a place; those between are zeros.
    pub fn set(&mut self, place: usize, words: &[Word]) {
        self.length = words.len();
        let group = place / GROUP * self.length;
        self.words.resize(self.words.len().max(group + self.length), [0; GROUP]);
        for (all, word) in self.words[group..].iter_mut().zip(words) {
            all[place % GROUP] = *word;
        }
    }

    /// The bounds of a group's differences from `query`, one row of the group for each of `shifts` shifts.
    pub fn bounds(&self, group: usize, query: &Doubled<Word>, out: &mut [[u16; GROUP]]) {
        let words = &self.words[group * self.length..][..self.length];
        match Arch::new() {
            #[cfg(target_arch = "x86_64")]
            Arch::V4(simd) => simd.vectorize(Bounds { simd, words, query, out }),
            #[cfg(target_arch = "x86_64")]
            Arch::V3(simd) => simd.vectorize(Bounds { simd, words, query, out }),
            _ => Bounds { simd: Scalar, words, query, out }.call(),
        }
    }
}

/// Sums of absolute differences of bytes, eight bytes a lane.
trait Sad: Simd {
    fn sad(self, a: Self::u64s, b: Self::u64s) -> Self::u64s;
}

impl Sad for Scalar {
    #[inline(always)]
    fn sad(self, a: u64, b: u64) -> u64 {
        a.to_le_bytes().iter().zip(b.to_le_bytes()).map(|(a, b)| u64::from(a.abs_diff(b))).sum()
    }
}

#[cfg(target_arch = "x86_64")]
impl Sad for pulp::x86::V3 {
    #[inline(always)]
    fn sad(self, a: Self::u64s, b: Self::u64s) -> Self::u64s {
        pulp::bytemuck::cast(self.avx2._mm256_sad_epu8(pulp::bytemuck::cast(a), pulp::bytemuck::cast(b)))
    }
}

#[cfg(target_arch = "x86_64")]
impl Sad for pulp::x86::V4 {
    #[inline(always)]
    fn sad(self, a: Self::u64s, b: Self::u64s) -> Self::u64s {
        pulp::bytemuck::cast(self.avx512bw._mm512_sad_epu8(pulp::bytemuck::cast(a), pulp::bytemuck::cast(b)))
    }
}

/// The bounds of one group.
struct Bounds<'a, S> {
    simd: S,
    words: &'a [[Word; GROUP]],
    query: &'a Doubled<Word>,
    out: &'a mut [[u16; GROUP]],
}

impl<S: Sad> NullaryFnOnce for Bounds<'_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { simd, words, query, out } = self;
        let (shifts, slack) = (out.len(), 8 * words.len() as u64);
        for first in (0..shifts).step_by(TILE) {
            // The last tile repeats shifts rather than to be narrower.
            let tile: [&[Word]; TILE] = std::array::from_fn(|k| query.shifted((first + k).min(shifts - 1)));
            for lane in (0..GROUP).step_by(S::U64_LANES) {
                let mut sums = [simd.splat_u64s(0); TILE];
                for (k, eight) in words.iter().enumerate() {
                    let theirs = S::as_simd_u64s(&eight[lane..]).0[0];
                    for (sum, own) in sums.iter_mut().zip(tile) {
                        *sum = simd.add_u64s(*sum, simd.sad(theirs, simd.splat_u64s(own[k])));
                    }
                }
                for (sum, bounds) in sums.iter().zip(&mut out[first..]) {
                    let mut lanes = [0_u64; GROUP];
                    simd.partial_store_u64s(&mut lanes[..S::U64_LANES], *sum);
                    for (bound, sum) in bounds[lane..].iter_mut().zip(&lanes[..S::U64_LANES]) {
                        *bound = (2 * sum).saturating_sub(slack).min(u64::from(u16::MAX)) as u16;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::glarot::difference::{l1, lines, to_lines};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn bound_the_whole_whatever_the_instructions(
            bins in prop::collection::vec(prop::collection::vec(0..900_u16, 42), 11), row in 1_usize..43
        ) {
            let rows = 42 / row;
            let bins: Vec<&[u16]> = bins.iter().map(|b| &b[..rows * row]).collect();
            let mut halves = Halves::default();
            bins.iter().enumerate().for_each(|(place, b)| halves.set(place, &words(b, row)));
            let query = Doubled::new(&words(bins[0], row), words_per_row(row));
            let whole = Doubled::new(&to_lines(bins[0], row), lines(row));
            for group in 0..2 {
                let (mut fast, mut plain) = (vec![[0; GROUP]; rows], vec![[0; GROUP]; rows]);
                halves.bounds(group, &query, &mut fast);
                let words = &halves.words[group * halves.length..][..halves.length];
                Bounds { simd: Scalar, words, query: &query, out: &mut plain }.call();
                prop_assert_eq!(&fast, &plain);
                for (place, b) in bins.iter().enumerate().filter(|(place, _)| place / GROUP == group) {
                    for (shift, bounds) in fast.iter().enumerate() {
                        prop_assert!(bounds[place % GROUP] <= l1(whole.shifted(shift), &to_lines(b, row)));
                    }
                }
            }
        }
    }
}

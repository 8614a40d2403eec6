//! How far two histograms are apart: the sum of absolute differences, the inner loop of the signatures.
//!
//! It is a plain loop over whole numbers below 2^15, a line of memory at a time: inside a dispatch to an instruction set it becomes
//! its vectors, and the sum is the same whatever their width.

/// Bins of a line of memory.
const LINE: usize = 32;

/// Bins that lie in one line of memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(64))]
pub(super) struct Line([u16; LINE]);

impl Line {
    pub const ZERO: Self = Self([0; LINE]);
}

/// Lines that hold `bins` bins.
pub(super) fn lines(bins: usize) -> usize {
    bins.div_ceil(LINE)
}

/// Rows of `row` bins in whole lines, zeros after the last.
pub(super) fn to_lines(bins: &[u16], row: usize) -> Vec<Line> {
    let line = |chunk: &[u16]| {
        let mut line = Line::ZERO;
        line.0[..chunk.len()].copy_from_slice(chunk);
        line
    };
    bins.chunks(row).flat_map(|row| row.chunks(LINE).map(line)).collect()
}

/// Sum of absolute differences, where it is below 2^16.
#[inline(always)]
pub(super) fn l1(a: &[Line], b: &[Line]) -> u16 {
    l1_in_parts([(a, b)])
}

/// The same over histograms in parts.
#[inline(always)]
pub(super) fn l1_in_parts<const N: usize>(parts: [(&[Line], &[Line]); N]) -> u16 {
    let mut sums = [0_u16; LINE];
    for (a, b) in parts {
        for (a, b) in a.iter().zip(b) {
            for ((sum, a), b) in sums.iter_mut().zip(&a.0).zip(&b.0) {
                let difference = (*a as i16).wrapping_sub(*b as i16).wrapping_abs();
                *sum = sum.wrapping_add(difference as u16);
            }
        }
    }
    sums.iter().fold(0, |all, sum| all.wrapping_add(*sum))
}

/// A histogram twice over, so that every shift of its rows is one stretch.
pub(super) struct Doubled<T> {
    values: Vec<T>,
    row: usize,
}

impl<T: Copy> Doubled<T> {
    /// Rows of `row` values.
    pub fn new(values: &[T], row: usize) -> Self {
        Self { values: values.repeat(2), row }
    }

    /// Values of the histogram.
    #[inline(always)]
    pub fn len(&self) -> usize {
        self.values.len() / 2
    }

    /// The histogram with row b at b + shift.
    #[inline(always)]
    pub fn shifted(&self, shift: usize) -> &[T] {
        &self.values[self.len() - shift * self.row..][..self.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn sums_over_shifted_rows(pairs in prop::collection::vec((0..900_u16, 0..900_u16), 72), row in 1_usize..73, shift in 0_usize..9) {
            let rows = 72 / row;
            let (a, b): (Vec<_>, Vec<_>) = pairs[..rows * row].iter().copied().unzip();
            let shift = shift % rows;
            let doubled = Doubled::new(&to_lines(&a, row), lines(row));
            let expected = (0..rows * row).map(|i| a[i].abs_diff(b[(i + shift * row) % (rows * row)])).sum::<u16>();
            prop_assert_eq!(l1(doubled.shifted(shift), &to_lines(&b, row)), expected);
        }
    }
}

//! A symmetric matrix that grows and shrinks at its end, stored whole, row by row.
//!
//! Both triangles are kept so that a row is one slice: the filter's work is sums of rows. The first `HEAD` rows, those of the
//! pose, change with every sighting; their mirror image is not kept up: what stands there in the other rows is void, and
//! [`Symmetric::at`] does not read it. Growing keeps the stride until it is full, then doubles it, so that a filter in steady
//! state allocates nothing.

use nalgebra::{Matrix3, Vector3};

/// Rows whose mirror image is void.
pub(crate) const HEAD: usize = 3;

/// A symmetric matrix of changing size.
#[derive(Clone, Debug, Default)]
pub(crate) struct Symmetric {
    size: usize,
    stride: usize,
    data: Vec<f64>,
}

impl Symmetric {
    /// The zero matrix of a size.
    pub fn zeros(size: usize) -> Self {
        let mut matrix = Self::default();
        matrix.grow(size);
        matrix
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// One entry.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        if j < HEAD { self.data[j * self.stride + i] } else { self.data[i * self.stride + j] }
    }

    /// Sets an entry and its mirror image.
    pub fn set(&mut self, i: usize, j: usize, value: f64) {
        self.data[i * self.stride + j] = value;
        self.data[j * self.stride + i] = value;
    }

    /// A row; below the head its first `HEAD` entries are void.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.stride..i * self.stride + self.size]
    }

    /// A row to be changed: the caller owes the mirror image.
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.stride..i * self.stride + self.size]
    }

    /// Copies row `i` into column `i`, the head left out.
    pub fn mirror(&mut self, i: usize) {
        for j in HEAD..self.size {
            self.data[j * self.stride + i] = self.data[i * self.stride + j];
        }
    }

    /// The head beyond its own columns becomes `by` times itself, and gains `gain` times the row of each of `more`.
    pub fn mix_head(&mut self, by: &Matrix3<f64>, more: &[(usize, Vector3<f64>)]) {
        let (head, rest) = self.data.split_at_mut(HEAD * self.stride);
        let (first, others) = head.split_at_mut(self.stride);
        let (second, third) = others.split_at_mut(self.stride);
        let columns = HEAD..self.size;
        let rows = [first, second, third].map(|row| &mut row[columns.clone()]);
        let [first, second, third] = rows;
        for ((a, b), c) in first.iter_mut().zip(second.iter_mut()).zip(third.iter_mut()) {
            let (x, y, z) = (*a, *b, *c);
            *a = by.m11 * x + by.m12 * y + by.m13 * z;
            *b = by.m21 * x + by.m22 * y + by.m23 * z;
            *c = by.m31 * x + by.m32 * y + by.m33 * z;
        }
        for (row, gain) in more {
            let begin = (row - HEAD) * self.stride;
            let row = &rest[begin + HEAD..begin + self.size];
            for (k, head) in [&mut *first, &mut *second, &mut *third].into_iter().enumerate() {
                head.iter_mut().zip(row).for_each(|(h, r)| *h += gain[k] * r);
            }
        }
    }

    /// Appends `more` rows and columns of zeros.
    pub fn grow(&mut self, more: usize) {
        let size = self.size + more;
        if size > self.stride {
            self.widen(size.next_power_of_two().max(16));
        }
        for i in 0..size {
            let from = if i < self.size { self.size } else { 0 };
            self.data[i * self.stride + from..i * self.stride + size].fill(0.0);
        }
        self.size = size;
    }

    fn widen(&mut self, stride: usize) {
        let mut data = vec![0.0; stride * stride];
        for i in 0..self.size {
            data[i * stride..i * stride + self.size].copy_from_slice(self.row(i));
        }
        (self.stride, self.data) = (stride, data);
    }

    /// Removes `count` rows and columns at `start`: the last ones take their place.
    pub fn swap_remove(&mut self, start: usize, count: usize) {
        let last = self.size - count;
        for k in 0..if start == last { 0 } else { count } {
            let (to, from) = (start + k, last + k);
            // The row first, then its image; what belongs to the removed rows is overwritten or cut off.
            self.data.copy_within(from * self.stride..from * self.stride + self.size, to * self.stride);
            (0..HEAD).for_each(|h| self.data[h * self.stride + to] = self.data[h * self.stride + from]);
            let own = self.at(from, from);
            self.mirror(to);
            self.data[to * self.stride + to] = own;
            for j in 0..k {
                let between = self.at(from, last + j);
                self.set(to, start + j, between);
            }
        }
        self.size = last;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbered(size: usize) -> Symmetric {
        let mut m = Symmetric::zeros(size);
        for i in 0..size {
            (0..=i).for_each(|j| m.set(i, j, (10 * i + j) as f64));
        }
        m
    }

    #[test]
    fn grows_by_zeros_and_keeps_what_it_has() {
        let mut m = numbered(15);
        m.grow(5);
        assert_eq!((m.size(), m.at(14, 3), m.at(3, 14), m.at(19, 0), m.at(2, 19)), (20, 143.0, 143.0, 0.0, 0.0));
    }

    #[test]
    fn the_head_is_mixed_with_itself_and_with_other_rows() {
        let (before, mut m) = (numbered(11), numbered(11));
        let by = Matrix3::new(1.0, 2.0, -1.0, 0.5, 1.0, 3.0, 0.0, 0.0, 1.0);
        let gains = [(4, Vector3::new(1.0, -2.0, 0.0)), (10, Vector3::new(0.0, 0.0, 7.0))];
        m.mix_head(&by, &gains);
        for i in 0..HEAD {
            for j in HEAD..11 {
                let own: f64 = (0..HEAD).map(|k| by[(i, k)] * before.at(k, j)).sum();
                let others: f64 = gains.iter().map(|(row, gain)| gain[i] * before.at(*row, j)).sum();
                assert!((m.at(i, j) - own - others).abs() < 1e-9, "{i} {j}");
            }
        }
        assert!((HEAD..11).all(|i| (0..11).all(|j| j < HEAD || m.at(i, j) == before.at(i, j))));
        assert!((0..HEAD).all(|i| (0..HEAD).all(|j| m.at(i, j) == before.at(i, j))), "its own columns stay");
    }

    #[test]
    fn removal_moves_the_last_into_the_hole() {
        let mut m = numbered(9);
        m.swap_remove(3, 2);
        assert_eq!(m.at(1, 3), m.at(3, 1));
        // 7 and 8 now stand at 3 and 4.
        let old = [0, 1, 2, 7, 8, 5, 6];
        let before = numbered(9);
        for i in 0..7 {
            for j in 0..7 {
                assert_eq!(m.at(i, j), before.at(old[i], old[j]), "{i} {j}");
            }
        }
        m.swap_remove(5, 2);
        assert_eq!((m.size(), m.at(4, 3)), (5, before.at(8, 7)));
        m.grow(2);
        assert!((0..7).all(|j| m.at(6, j) == 0.0 && m.at(j, 6) == 0.0) && m.at(4, 3) == before.at(8, 7));
    }
}

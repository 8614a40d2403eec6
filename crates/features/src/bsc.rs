//! BSC, binary shape context: which cells of a polar grid around a keypoint hold points of the scan.
//!
//! ```text
//! bit (ring, sector) = any point falls in it            distance = number of bits that differ
//! ```
//!
//! over the 8 rings and 16 sectors of [`Surroundings`], which turn with the keypoint.
//!
//! Source: Kallasi, Rizzini, Caselli, RA-L 2016; after the shape context of Belongie, Malik, Puzicha, PAMI 2002.

use crate::Surroundings;

/// The 8 x 16 cells, a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bsc {
    cells: u128,
}

impl Bsc {
    /// The descriptor of a keypoint with these surroundings.
    #[must_use]
    pub fn of(around: &Surroundings) -> Self {
        Self { cells: around.cells }
    }

    /// Cells that one has and the other has not, 0 to 128.
    #[must_use]
    pub fn distance(&self, other: &Self) -> u32 {
        (self.cells ^ other.cells).count_ones()
    }

    /// The cells as 16 bytes, ring by ring, the lowest bit of the first byte first.
    #[must_use]
    pub fn to_bytes(self) -> [u8; 16] {
        self.cells.to_le_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surroundings::test_scene::{corner, moved};
    use groma_geometry::Se2;
    use nalgebra::Vector2;

    #[test]
    fn bins_by_ring_and_sector() {
        let (keypoint, _) = corner();
        let at = |d: f64, angle: f64| keypoint.point + Vector2::new(angle.cos(), angle.sin()) * d;
        let theta = keypoint.orientation;
        let of = |points: &[Vector2<f64>]| Bsc::of(&Surroundings::of(points.iter().copied(), &keypoint, 0.8)).cells;
        assert_eq!(of(&[at(0.05, theta + 0.1)]), 1);
        assert_eq!(of(&[at(0.05, theta - 0.1)]), 1 << 15);
        assert_eq!(of(&[at(0.15, theta + 0.5)]), 1 << 17);
        assert_eq!(of(&[at(0.7999, theta + 0.1)]), 1 << 112);
        assert_eq!(of(&[at(0.9, theta), keypoint.point]), 0);
    }

    #[test]
    fn turns_with_the_scan() {
        let (keypoint, points) = corner();
        let before = Bsc::of(&Surroundings::of(points.clone(), &keypoint, 0.4));
        assert!(before.cells.count_ones() > 6);
        for k in 0..50 {
            let motion = Se2::new(0.3 * f64::from(k), -2.0, 0.37 * f64::from(k));
            let (keypoint, points) = moved(&keypoint, &points, &motion);
            assert_eq!(Bsc::of(&Surroundings::of(points, &keypoint, 0.4)), before);
        }
    }

    #[test]
    fn distance_counts_cells() {
        let (a, b) = (Bsc { cells: 0b1011 }, Bsc { cells: 0b0110 | 1 << 100 });
        assert_eq!((a.distance(&b), b.distance(&a), a.distance(&a)), (4, 4, 0));
    }
}

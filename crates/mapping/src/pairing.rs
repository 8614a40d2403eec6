//! Which marks of two landmark maps are one: like with like, nearest first.
//!
//! Two marks may be one when they are of the same kind, lie within the gate of a landmark map of each other and open into
//! directions that differ by less than its limit ([`crate::landmarks`]); a mark without orientation is alike to any. Of
//! all pairs that may be one the closest is taken first, each mark once.
//!
//! The marks of one map lie in a hash of square cells as wide as the gate, so memory and time grow with the number of marks
//! and of pairs within the gate, not with the product of the numbers. Assumes that both maps are in one frame.

use crate::landmarks::{GATE, cell, face_alike};
use groma_models::Landmark;
use std::collections::HashMap;

/// Pairs of places in `a` and `b` that are one mark, closest first.
#[must_use]
pub fn pairs(a: &[Landmark], b: &[Landmark]) -> Vec<(usize, usize)> {
    let mut candidates = candidates(a, b);
    candidates.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let (mut free_a, mut free_b) = (vec![true; a.len()], vec![true; b.len()]);
    let mut pairs = Vec::new();
    for (_, i, j) in candidates {
        if free_a[i] && free_b[j] {
            (free_a[i], free_b[j]) = (false, false);
            pairs.push((i, j));
        }
    }
    pairs
}

/// Squared distance and places of all marks that may be one.
fn candidates(a: &[Landmark], b: &[Landmark]) -> Vec<(f64, usize, usize)> {
    let mut cells: HashMap<(i64, i64), Vec<usize>> = HashMap::new();
    for (j, mark) in b.iter().enumerate() {
        cells.entry(cell(mark.position)).or_default().push(j);
    }
    let near = |(i, mark): (usize, &Landmark)| {
        let around = neighbours(cell(mark.position)).into_iter().filter_map(|c| cells.get(&c)).flatten();
        let alike = around.filter(|j| may_be_one(mark, &b[**j]));
        alike.map(|j| ((mark.position - b[*j].position).norm_squared(), i, *j)).collect::<Vec<_>>()
    };
    a.iter().enumerate().flat_map(near).collect()
}

/// A cell and those around it, each once.
fn neighbours((column, row): (i64, i64)) -> Vec<(i64, i64)> {
    let around = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (column.saturating_add(i), row.saturating_add(j))));
    let mut cells: Vec<_> = around.collect();
    cells.sort_unstable();
    cells.dedup();
    cells
}

fn may_be_one(a: &Landmark, b: &Landmark) -> bool {
    a.kind == b.kind
        && (a.position - b.position).norm_squared() < GATE * GATE
        && face_alike(a.orientation, b.orientation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_models::LandmarkKind;
    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn mark((x, y, angle, reflector): (f64, f64, f64, bool)) -> Landmark {
        Landmark {
            kind: if reflector { LandmarkKind::Reflector } else { LandmarkKind::Corner },
            position: Vector2::new(x, y),
            covariance: Matrix2::identity() * 1e-4,
            orientation: (!reflector).then_some(angle),
            descriptor: None,
            seen: 10,
            visible: 10,
        }
    }

    fn corners(points: &[(f64, f64)]) -> Vec<Landmark> {
        points.iter().map(|&(x, y)| mark((x, y, 0.0, false))).collect()
    }

    /// Again and again the closest two that are left, by looking at all.
    fn plain(a: &[Landmark], b: &[Landmark]) -> Vec<(usize, usize)> {
        let mut left: Vec<(usize, usize)> = (0..a.len()).flat_map(|i| (0..b.len()).map(move |j| (i, j))).collect();
        left.retain(|&(i, j)| may_be_one(&a[i], &b[j]));
        let distance = |&(i, j): &(usize, usize)| (a[i].position - b[j].position).norm();
        let mut pairs = Vec::new();
        while let Some(best) = left.iter().copied().min_by(|p, q| distance(p).total_cmp(&distance(q))) {
            left.retain(|&(i, j)| i != best.0 && j != best.1);
            pairs.push(best);
        }
        pairs
    }

    #[test]
    fn the_nearest_goes_first_whatever_the_order() {
        let map = corners(&[(0.0, 0.0), (0.15, 0.0)]);
        assert_eq!(pairs(&map, &corners(&[(0.12, 0.0)])), [(1, 0)]);
        assert_eq!(pairs(&map, &corners(&[(0.06, 0.0), (0.01, 0.0)])), [(0, 1), (1, 0)]);
        let (one, around) = (corners(&[(0.0, 0.0)]), corners(&[(0.1, 0.0), (-0.1, 0.0)]));
        assert_eq!(
            (pairs(&one, &around), pairs(&around, &one)),
            (vec![(0, 0)], vec![(0, 0)]),
            "of two as near the first"
        );
    }

    #[test]
    fn marks_a_hand_apart_may_be_one_and_half_a_metre_apart_are_not() {
        let map = corners(&[(-0.05, 7.0)]);
        for (x, found) in [(0.05, 1), (0.45, 0), (-0.55, 0)] {
            assert_eq!(pairs(&map, &corners(&[(x, 7.0)])).len(), found, "{x}");
        }
    }

    #[test]
    fn corners_that_open_at_a_right_angle_are_two_and_across_half_a_turn_the_angle_is_small() {
        let turned = |angle| vec![mark((3.0, 3.0, angle, false))];
        assert_eq!(pairs(&turned(0.0), &turned(0.5)).len(), 1);
        assert_eq!(pairs(&turned(PI - 0.1), &turned(-PI + 0.1)).len(), 1);
        assert_eq!(pairs(&turned(0.0), &turned(PI / 2.0)), []);
        assert_eq!(pairs(&turned(0.0), &turned(-PI / 2.0)), []);
    }

    #[test]
    fn a_reflector_is_no_corner() {
        let (corner, reflector) = (mark((1.0, 1.0, 0.0, false)), mark((1.0, 1.0, 0.0, true)));
        assert_eq!(pairs(&[corner], std::slice::from_ref(&reflector)), []);
        assert_eq!(pairs(std::slice::from_ref(&reflector), std::slice::from_ref(&reflector)), [(0, 0)]);
    }

    #[test]
    fn places_without_number_or_end_are_no_pair() {
        let far = corners(&[(f64::NAN, 0.0), (f64::INFINITY, 0.0), (1e300, 1e300), (-1e300, 0.0)]);
        assert_eq!(pairs(&far[..2], &far), []);
        assert_eq!(pairs(&far[2..], &far[2..]).len(), 2);
    }

    proptest! {
        #[test]
        fn equals_the_search_of_all_pairs(
            a in prop::collection::vec((-0.7..0.7_f64, -0.7..0.7_f64, -4.0..4.0_f64, any::<bool>()), 0..30),
            b in prop::collection::vec((-0.7..0.7_f64, -0.7..0.7_f64, -4.0..4.0_f64, any::<bool>()), 0..30),
        ) {
            let (a, b): (Vec<_>, Vec<_>) = (a.into_iter().map(mark).collect(), b.into_iter().map(mark).collect());
            prop_assert_eq!(pairs(&a, &b), plain(&a, &b));
        }
    }
}

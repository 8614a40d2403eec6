//! Which of many motions agree with many others: votes on a grid of motions.
//!
//! A motion votes for the cell of (where it puts the middle of b, how it turns b). Taking the middle of b, not its
//! origin, keeps the cells of motions with slightly different turns together. Turns are binned by the pseudo-angle
//! `1 - c` (upper half) or `3 + c` (lower) scaled by `|s| + |c|`, which grows with the angle and needs no arc tangent.

use groma_geometry::Se2;
use nalgebra::Vector2;

/// Side of a cell [m], doubled until the grid fits [`MOST_CELLS`].
const SIDE: f64 = 0.5;
/// Turns in a full circle.
const TURNS: usize = 64;
const MOST_CELLS: f64 = 2e6;

/// Indices of about `most` motions with the most votes: all of equal votes are in or out together, in the given order.
pub(super) fn elect(motions: &[Se2], middle: Vector2<f64>, most: usize) -> Vec<usize> {
    let cells = cells(motions, middle);
    let mut votes = vec![0_u16; cells.iter().max().map_or(0, |&c| c as usize + 1)];
    for &cell in &cells {
        votes[cell as usize] = votes[cell as usize].saturating_add(1);
    }
    let least = least_votes(&cells, &votes, most);
    (0..motions.len()).filter(|&k| votes[cells[k] as usize] >= least).collect()
}

/// The number of votes from which on at most `most` motions are left; the top cells in any case.
fn least_votes(cells: &[u32], votes: &[u16], most: usize) -> u16 {
    let highest = votes.iter().copied().max().unwrap_or(0);
    let mut with = vec![0_usize; usize::from(highest) + 1];
    for &cell in cells {
        with[usize::from(votes[cell as usize])] += 1;
    }
    let mut total = 0;
    let fits = |&v: &u16| {
        total += with[usize::from(v)];
        total <= most
    };
    (0..=highest).rev().take_while(fits).last().unwrap_or(highest)
}

/// The cell of every motion.
fn cells(motions: &[Se2], middle: Vector2<f64>) -> Vec<u32> {
    let landed = || motions.iter().map(|m| m.act(middle));
    let low = landed().fold(Vector2::repeat(f64::INFINITY), |low, p| low.inf(&p));
    let high = landed().fold(Vector2::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p));
    let mut side = SIDE;
    let bins = |extent: f64, side: f64| (extent / side) as usize + 1;
    while bins(high.x - low.x, side) as f64 * bins(high.y - low.y, side) as f64 * TURNS as f64 > MOST_CELLS {
        side *= 2.0;
    }
    let columns = bins(high.x - low.x, side);
    let cell = |(m, p): (&Se2, Vector2<f64>)| {
        let bin = ((p - low) / side).map(|x| x as usize);
        ((bin.y * columns + bin.x) * TURNS + turn(m)) as u32
    };
    motions.iter().zip(landed()).map(cell).collect()
}

/// Bin of the rotation.
fn turn(motion: &Se2) -> usize {
    let (c, s) = (motion.rotation.cos, motion.rotation.sin);
    let share = c / (c.abs() + s.abs());
    let quarters = if s >= 0.0 { 1.0 - share } else { 3.0 + share };
    ((quarters * 0.25 * TURNS as f64) as usize).min(TURNS - 1)
}

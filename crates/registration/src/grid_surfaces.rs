//! The surfaces of an occupancy grid: points with normals, for registration to a map of which only the grid is left.
//!
//! ```text
//! side(c)   mean direction from the occupied cell c to the free cells within SIDE cells of it
//! line(c)   total least squares through the occupied cells within RADIUS whose side agrees with that of c
//! point     the centre of c, moved onto the line; normal: across the line, to the free side
//! ```
//!
//! A wall one cell thick has free cells on both sides: its cells give a point for each. A cell whose neighbourhood is no line
//! (a pole, clutter) gives none.
//!
//! Fitting a line evens out what the cells cut off: a straight wall is met to a few millimetres with cells of 5 cm, if its
//! cells are those that its readings fall in.

use crate::surface_scan::SurfaceScan;
use groma_models::{Cell, Grid};
use nalgebra::{Matrix2, Vector2};

/// Half the edge of the square in which free cells tell the side [cells].
const SIDE: i64 = 2;
/// Radius of the neighbourhood of a line: this [m], but at least so many cells.
const RADIUS: (f64, f64) = (0.12, 2.5);
/// Cosine of the largest angle between the sides of cells of one surface.
const SAME_SIDE: f64 = 0.6;
/// Mean length of the directions to free cells below which a cell has free cells all round.
const BOTH_SIDES: f64 = 0.3;
/// Cells that a line needs.
const LEAST_CELLS: usize = 4;
/// Largest ratio of the spread across a line to that along it.
const MAX_THINNESS: f64 = 0.4;

/// An occupied cell next to free ones.
#[derive(Clone, Copy)]
struct Border {
    /// Its centre in the map [m].
    center: Vector2<f64>,
    /// Where it is free: shorter than `BOTH_SIDES` if that is all round.
    side: Vector2<f64>,
}

/// Surface points of a grid, in its frame.
#[must_use]
pub fn grid_surfaces(grid: &Grid) -> SurfaceScan {
    let borders: Vec<Option<Border>> = (0..grid.cells.len()).map(|k| border(grid, k)).collect();
    let mut out = SurfaceScan::default();
    for (k, border) in borders.iter().enumerate() {
        let Some((point, normal)) = border.and_then(|b| line(grid, &borders, k, &b)) else { continue };
        let side = border.map_or_else(Vector2::zeros, |b| b.side);
        let both = side.norm() < BOTH_SIDES;
        for normal in
            if both { [Some(normal), Some(-normal)] } else { [Some(normal * side.dot(&normal).signum()), None] }
                .into_iter()
                .flatten()
        {
            out.points.push(point);
            out.normals.push(normal);
        }
    }
    out
}

/// Column and row of a cell.
fn place(grid: &Grid, k: usize) -> (i64, i64) {
    ((k % grid.width) as i64, (k / grid.width) as i64)
}

/// The cells within `reach` of a cell, the cell itself left out.
fn around(grid: &Grid, k: usize, reach: i64) -> impl Iterator<Item = (usize, Vector2<f64>)> {
    let ((x, y), (width, height)) = (place(grid, k), (grid.width as i64, grid.height as i64));
    let square = (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| (dx, dy)));
    square
        .filter(move |&(dx, dy)| {
            (dx, dy) != (0, 0) && (0..width).contains(&(x + dx)) && (0..height).contains(&(y + dy))
        })
        .map(move |(dx, dy)| (((y + dy) * width + x + dx) as usize, Vector2::new(dx as f64, dy as f64)))
}

fn border(grid: &Grid, k: usize) -> Option<Border> {
    if grid.cells[k] != Cell::Occupied {
        return None;
    }
    let free = around(grid, k, SIDE).filter(|(j, _)| grid.cells[*j] == Cell::Free);
    let (count, sum) = free.fold((0.0, Vector2::zeros()), |(n, s), (_, d)| (n + 1.0, s + d.normalize()));
    let (x, y) = place(grid, k);
    let center = grid.origin + Vector2::new(x as f64 + 0.5, y as f64 + 0.5) * grid.resolution;
    (count > 0.0).then(|| Border { center, side: sum / count })
}

/// The point of a border cell on its line, and a normal of either direction.
fn line(grid: &Grid, borders: &[Option<Border>], k: usize, own: &Border) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let cells = (RADIUS.0 / grid.resolution).max(RADIUS.1);
    let near = around(grid, k, cells as i64).filter(|(_, d)| d.norm() <= cells);
    let alike = near.filter_map(|(j, _)| borders[j].filter(|b| is_one_surface(own, b))).map(|b| b.center - own.center);
    let offsets: Vec<Vector2<f64>> = alike.chain([Vector2::zeros()]).collect();
    if offsets.len() < LEAST_CELLS {
        return None;
    }
    let mean = offsets.iter().sum::<Vector2<f64>>() / offsets.len() as f64;
    let scatter: Matrix2<f64> = offsets.iter().map(|o| (o - mean) * (o - mean).transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let across = usize::from(eigen.eigenvalues[1] < eigen.eigenvalues[0]);
    let thinness = (eigen.eigenvalues[across].max(0.0) / eigen.eigenvalues[1 - across]).sqrt();
    let normal = eigen.eigenvectors.column(across).into_owned();
    (thinness <= MAX_THINNESS).then(|| (own.center + normal * normal.dot(&mean), normal))
}

fn is_one_surface(a: &Border, b: &Border) -> bool {
    let (one, other) = (a.side.norm(), b.side.norm());
    one < BOTH_SIDES || other < BOTH_SIDES || a.side.dot(&b.side) >= SAME_SIDE * one * other
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Free inside a circle or a polygon's half-planes, occupied where the surface runs, unknown beyond.
    fn grid(resolution: f64, size: f64, cell: impl Fn(Vector2<f64>) -> Cell) -> Grid {
        let n = (size / resolution) as usize;
        let at = |k: usize| Vector2::new((k % n) as f64 + 0.5, (k / n) as f64 + 0.5) * resolution;
        Grid {
            resolution,
            origin: Vector2::zeros(),
            width: n,
            height: n,
            cells: (0..n * n).map(|k| cell(at(k))).collect(),
        }
    }

    #[test]
    fn a_slanted_wall_is_met_to_millimetres() {
        let (normal, distance) = (Vector2::new(-0.6_f64.sin(), 0.6_f64.cos()), 2.0);
        let wall = grid(0.05, 6.0, |p| match normal.dot(&p) - distance {
            d if d.abs() <= 0.025 => Cell::Occupied,
            d if d < 0.0 => Cell::Free,
            _ => Cell::Unknown,
        });
        let found = grid_surfaces(&wall);
        assert!(found.points.len() > 60);
        let errors = found.points.iter().map(|p| normal.dot(p) - distance);
        let rms = (errors.map(|e| e * e).sum::<f64>() / found.points.len() as f64).sqrt();
        assert!(rms < 0.006, "{rms}");
        let worst = found.normals.iter().map(|n| n.dot(&normal)).fold(-1.0, f64::max);
        assert!(worst < -0.975, "{worst}"); // 13 degrees: a line is of five cells or so
    }

    #[test]
    fn the_two_faces_of_a_wall_are_two_surfaces() {
        let thick = grid(0.05, 3.0, |p| match (p.x - 1.5).abs() {
            d if d < 0.1 => Cell::Unknown,
            d if d < 0.15 => Cell::Occupied,
            _ => Cell::Free,
        });
        let found = grid_surfaces(&thick);
        for (p, n) in found.points.iter().zip(&found.normals) {
            assert!((p.x - 1.5).abs() > 0.12 && n.x * (p.x - 1.5).signum() > 0.99, "{p} {n}");
        }
        let thin = grid(0.05, 3.0, |p| if (p.x - 1.5).abs() < 0.03 { Cell::Occupied } else { Cell::Free });
        let sides = grid_surfaces(&thin).normals.iter().filter(|n| n.x > 0.9).count();
        assert_eq!(2 * sides, grid_surfaces(&thin).normals.len());
    }

    #[test]
    fn poles_and_empty_grids_have_no_surface() {
        let pole =
            grid(0.05, 2.0, |p| if (p - Vector2::new(1.0, 1.0)).norm() < 0.04 { Cell::Occupied } else { Cell::Free });
        assert!(grid_surfaces(&pole).points.is_empty());
        assert!(grid_surfaces(&grid(0.05, 2.0, |_| Cell::Occupied)).points.is_empty());
        let none = Grid { resolution: 0.05, origin: Vector2::zeros(), width: 0, height: 0, cells: Vec::new() };
        assert!(grid_surfaces(&none).points.is_empty());
    }
}

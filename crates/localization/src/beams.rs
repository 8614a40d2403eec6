//! Evidence of the beams for a pose on an occupancy grid: a log-likelihood ratio against chance.
//!
//! Each beam is cast through the grid from where the pose puts its laser. What it read agrees with the first occupied cell,
//! ends before it (something that is not on the map), or goes through it (a wall that is not there):
//!
//! ```text
//! l = n_eff sum over beams of ln( p(case | right) / p(case | chance) ) / n,    n_eff = length of the walls seen / INDEPENDENT
//! ```
//!
//! Beams that meet one wall share its reasons, in one scan and in the next. And rooms are alike: one that is not on the map
//! may equal one that is, wall by wall. So evidence grows with the length of different walls in view, not with scans. A laser
//! that would stand in a wall or off the map, or a beam that meets only unknown cells, says what chance says: nothing.

use groma_geometry::Se2;
use groma_models::{Cell, Grid, LaserScan};
use nalgebra::Vector2;

/// Beams kept of a scan, at most.
pub(crate) const BEAMS: usize = 90;
/// A reading agrees with an occupied cell within this, plus a share of the range [m].
const AGREES: (f64, f64) = (0.15, 0.01);
/// Probabilities of agreeing, ending before, going through: on the right place and by chance.
const RIGHT: [f64; 3] = [0.72, 0.23, 0.05];
const CHANCE: [f64; 3] = [0.12, 0.44, 0.44];
/// Length of wall that counts as one independent beam [m].
const INDEPENDENT: f64 = 1.5;
/// Independent beams of a view, at most.
const MOST_INDEPENDENT: f64 = 24.0;

/// A beam in the frame of the vehicle that made it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    /// Where the laser stood [m].
    pub from: Vector2<f64>,
    /// Its direction.
    pub direction: Vector2<f64>,
    /// What it read [m].
    pub range: f64,
}

/// Some of the beams of a scan.
pub(crate) fn beams(scan: &LaserScan, laser: &Se2) -> Vec<Beam> {
    let hits = scan.ranges.iter().enumerate().filter(|(_, r)| scan.geometry.is_hit(**r));
    let stride = scan.ranges.len().div_ceil(BEAMS).max(1);
    let beam = |(k, range): (usize, &f64)| {
        let (sin, cos) = scan.geometry.bearing(k).sin_cos();
        Beam { from: laser.translation, direction: laser.rotation.act(Vector2::new(cos, sin)), range: *range }
    };
    hits.step_by(stride).map(beam).collect()
}

/// The evidence of the beams of several scans, each with the pose that it would be seen from; `length` of different walls is in view [m].
pub(crate) fn evidence<'a>(scans: impl Iterator<Item = (Se2, &'a [Beam])>, length: f64, grid: &Grid) -> f64 {
    let (n, sum) =
        scans.fold((0, 0.0), |(n, sum), (pose, beams)| (n + beams.len(), sum + log_ratio(&pose, beams, grid)));
    if n == 0 { 0.0 } else { (length / INDEPENDENT).min(MOST_INDEPENDENT) * sum / n as f64 }
}

/// The sum over the beams of a scan of what each would say were it alone.
pub(crate) fn log_ratio(pose: &Se2, beams: &[Beam], grid: &Grid) -> f64 {
    beams.iter().filter_map(|beam| case(pose, beam, grid)).map(|k| (RIGHT[k] / CHANCE[k]).ln()).sum()
}

/// 0: agrees, 1: ends before, 2: goes through; none where the grid does not say.
fn case(pose: &Se2, beam: &Beam, grid: &Grid) -> Option<usize> {
    let (from, direction) = (pose.act(beam.from), pose.rotation.act(beam.direction));
    let slack = AGREES.0 + AGREES.1 * beam.range;
    let end = first_occupied(from, direction, beam.range + slack, grid);
    match end {
        Some(wall) if wall < beam.range - slack => Some(2),
        Some(_) => Some(0),
        None => (grid.at(from + direction * beam.range) == Cell::Free).then_some(1),
    }
}

/// Distance of the first occupied cell along a ray, up to `reach`: cell by cell (Amanatides, Woo 1987).
fn first_occupied(from: Vector2<f64>, direction: Vector2<f64>, reach: f64, grid: &Grid) -> Option<f64> {
    let start = (from - grid.origin) / grid.resolution;
    let mut cell = [start.x.floor() as i64, start.y.floor() as i64];
    let d = [direction.x, direction.y];
    let at = [start.x, start.y];
    let step = d.map(|v| if v > 0.0 { 1_i64 } else { -1 });
    let delta = d.map(|v| if v == 0.0 { f64::INFINITY } else { (1.0 / v).abs() });
    let mut next: [f64; 2] = std::array::from_fn(|k| {
        let edge = cell[k] as f64 + if step[k] > 0 { 1.0 } else { 0.0 };
        if d[k] == 0.0 { f64::INFINITY } else { ((edge - at[k]) / d[k]).abs() }
    });
    let (mut t, limit) = (0.0, reach / grid.resolution);
    while t <= limit {
        if occupied(grid, cell) {
            return Some(t * grid.resolution);
        }
        let k = usize::from(next[1] < next[0]);
        t = next[k];
        next[k] += delta[k];
        cell[k] += step[k];
    }
    None
}

fn occupied(grid: &Grid, [x, y]: [i64; 2]) -> bool {
    let inside = x >= 0 && y >= 0 && (x as usize) < grid.width && (y as usize) < grid.height;
    inside && grid.cells[y as usize * grid.width + x as usize] == Cell::Occupied
}

/// Area of the free cells [m^2].
pub(crate) fn free_area(grid: &Grid) -> f64 {
    grid.cells.iter().filter(|c| **c == Cell::Free).count() as f64 * grid.resolution * grid.resolution
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A room of 8 x 6 m with walls one cell thick and a pillar.
    fn room() -> Grid {
        let (width, height) = (160, 120);
        let cell = |x: usize, y: usize| {
            let wall = x == 0 || y == 0 || x == width - 1 || y == height - 1;
            let pillar = (100..110).contains(&x) && (50..60).contains(&y);
            if wall || pillar { Cell::Occupied } else { Cell::Free }
        };
        let cells = (0..height).flat_map(|y| (0..width).map(move |x| cell(x, y))).collect();
        Grid { resolution: 0.05, origin: Vector2::new(-1.0, -2.0), width, height, cells }
    }

    #[test]
    fn rays_end_at_the_first_wall() {
        let grid = room();
        let from = Vector2::new(1.0, 0.7);
        let cast = |angle: f64| first_occupied(from, Vector2::new(angle.cos(), angle.sin()), 20.0, &grid);
        assert!((cast(0.0).unwrap() - 3.0).abs() < 0.051, "{:?}", cast(0.0));
        assert!((cast(std::f64::consts::PI).unwrap() - 1.95).abs() < 0.051);
        assert!((cast(std::f64::consts::FRAC_PI_2).unwrap() - 3.25).abs() < 0.051);
        assert!(first_occupied(from, Vector2::x(), 2.0, &grid).is_none());
        assert!(first_occupied(Vector2::new(50.0, 50.0), Vector2::x(), 30.0, &grid).is_none());
    }

    #[test]
    fn the_right_place_has_more_evidence_than_others() {
        let grid = room();
        let truth = Se2::new(1.2, 0.3, 0.7);
        let beams: Vec<Beam> = (0..180)
            .filter_map(|k| {
                let a = f64::from(k) * 0.035;
                let direction = Vector2::new(a.cos(), a.sin());
                let range = first_occupied(truth.translation, truth.rotation.act(direction), 20.0, &grid)?;
                Some(Beam { from: Vector2::zeros(), direction, range: range + 0.025 })
            })
            .collect();
        let at = |pose: Se2| evidence(std::iter::once((pose, &beams[..])), 21.0, &grid);
        assert!(at(truth) > 10.0, "{}", at(truth));
        for wrong in [Se2::new(2.2, 0.3, 0.7), Se2::new(1.2, 0.3, 2.3), Se2::new(3.5, 2.0, -1.0)] {
            assert!(at(wrong) < at(truth) - 5.0, "{}", at(wrong));
        }
        assert_eq!(at(Se2::new(90.0, 0.0, 0.0)), 0.0);
        assert_eq!(evidence(std::iter::empty(), 21.0, &grid), 0.0);
    }
}

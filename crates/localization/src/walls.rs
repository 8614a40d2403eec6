//! The walls of a map as scans meet them: its occupancy grid, the surfaces of that, and a field to search it whole.
//!
//! Built once for a map, shared by the search for the place and by the filter.

use crate::beams::{Beam, log_ratio};
use groma_geometry::Se2;
use groma_models::{Cell, Grid};
use groma_registration::{Alignment, CorrelativeField, Prior, SurfaceMap, SurfaceScan, Window, align, grid_surfaces};
use nalgebra::{Matrix3, Vector2, Vector3};
use std::collections::HashSet;
use std::f64::consts::PI;

/// Cells of the field [m], and levels of its pyramid.
const FIELD: (f64, usize) = (0.1, 7);
/// Points of a view closer than this are one [m]; points of a view, at most.
const POINTS: (f64, usize) = (0.2, 160);
/// Score that a place must have, and share of the best score.
const SCORE: (f64, f64) = (0.4, 0.85);

/// Share of a scan on the walls from which it fits; else starts are searched for around [m], [rad], so many at most.
const FITS: f64 = 0.7;
const AROUND: (f64, f64) = (1.0, 0.5);
const STARTS: usize = 3;
/// Error of a grid: standard deviations of a pose on it [m], [rad].
const ERROR: (f64, f64) = (0.01, 0.002);

/// A map's walls.
#[derive(Clone, Debug)]
pub(crate) struct Walls {
    grid: Grid,
    surfaces: SurfaceMap,
    field: CorrelativeField,
    window: Window,
}

impl Walls {
    /// Gets a grid ready; none where it shows no surface.
    pub fn new(grid: Grid) -> Option<Self> {
        let scan = grid_surfaces(&grid);
        let first = *scan.points.first()?;
        let (low, high) = scan.points.iter().fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
        let mut surfaces = SurfaceMap::default();
        surfaces.insert(&scan, &Se2::IDENTITY);
        let field = CorrelativeField::new(surfaces.points(), FIELD.0, FIELD.1);
        let middle = 0.5 * (low + high);
        let window = Window { center: Se2::new(middle.x, middle.y, 0.0), reach: 0.5 * (high - low).max(), turn: PI };
        Some(Self { grid, surfaces, field, window })
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Where points in the frame of a vehicle lie on the walls of the map, best first.
    pub fn places(&self, scan: &SurfaceScan) -> Vec<Se2> {
        let peaks = self.field.search(&scan.points, &self.window, SCORE.0, SCORE.1);
        peaks.into_iter().map(|p| p.pose).filter(|p| self.grid.at(p.translation) != Cell::Unknown).collect()
    }

    /// What one beam of a scan says on average for the pose that it would be seen from: the logarithm of a likelihood ratio.
    pub fn log_ratio(&self, pose: &Se2, beams: &[Beam]) -> f64 {
        log_ratio(pose, beams, &self.grid) / beams.len().max(1) as f64
    }

    /// Registers a scan of which something is known: from there, and where that fits badly, from what fits best around.
    pub fn register(&self, scan: &SurfaceScan, prior: &Prior) -> Alignment {
        let found = self.align(scan, prior.pose, Some(prior));
        if found.share > FITS {
            return found;
        }
        let window = Window { center: prior.pose, reach: AROUND.0, turn: AROUND.1 };
        let peaks = self.field.search(&thinned(scan).points, &window, SCORE.0, SCORE.1);
        let others = peaks.iter().take(STARTS).map(|p| self.align(scan, p.pose, Some(prior)));
        others.fold(found, |best, other| if other.cost < best.cost { other } else { best })
    }

    /// Covariance of a pose that lies on the walls perfectly: they are drawn with cells.
    pub fn covariance(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(ERROR.0, ERROR.0, ERROR.1).map(|sigma| sigma * sigma))
    }

    /// Moves a scan onto the walls.
    pub fn align(&self, scan: &SurfaceScan, start: Se2, prior: Option<&Prior>) -> Alignment {
        align(scan, &self.surfaces, start, prior)
    }
}

/// Points of a scan in even distances, at most so many that a search stays short.
pub(crate) fn thinned(scan: &SurfaceScan) -> SurfaceScan {
    let cell = |p: &Vector2<f64>| ((p.x / POINTS.0).floor() as i64, (p.y / POINTS.0).floor() as i64);
    let mut taken = HashSet::new();
    let kept: Vec<usize> = (0..scan.points.len()).filter(|k| taken.insert(cell(&scan.points[*k]))).collect();
    let stride = kept.len().div_ceil(POINTS.1).max(1);
    let of = |all: &[Vector2<f64>]| kept.iter().step_by(stride).map(|k| all[*k]).collect();
    SurfaceScan { points: of(&scan.points), normals: of(&scan.normals) }
}

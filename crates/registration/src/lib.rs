//! Registration of laser scans: scan to scan and scan to local map.
//!
//! The pieces are orthogonal: [`surface_scan`] turns readings into points with normals, [`surface_map`] and
//! [`polar_view`] answer nearest-surface queries, [`correlative`] searches wide without a good start,
//! [`point_to_line`] refines to the optimum with a covariance, [`polar_view`] tells whether two views agree.
//! [`grid_surfaces`] makes surfaces of an occupancy grid.
//! Where every tenth of a millimetre counts, [`mutual`] registers the [`contour`]s of two scans to each other.

#[cfg(test)]
mod common_loop;
pub mod contour;
pub mod correlative;
pub mod grid_surfaces;
pub mod mutual;
pub mod point_to_line;
pub mod polar_view;
pub mod surface_map;
pub mod surface_scan;

pub use contour::Contour;
pub use correlative::{CorrelativeField, Peak, Window};
pub use grid_surfaces::grid_surfaces;
pub use mutual::{Mutual, align_mutually};
pub use point_to_line::{Alignment, Prior, Surfaces, align};
pub use polar_view::{PolarView, Visibility};
pub use surface_map::SurfaceMap;
pub use surface_scan::SurfaceScan;

//! The static map as the filter asks it.

use crate::point_index::PointIndex;
use groma_models::bounds::{COORDINATE, VARIANCE};
use groma_models::{Landmark, LandmarkMap};
use nalgebra::Vector2;
use thiserror::Error;

/// Why a map cannot be used.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum InvalidMap {
    /// A number is NaN or infinite.
    #[error("landmark {index} of the map: its position is not finite")]
    Position {
        /// Which one.
        index: usize,
    },
    /// A covariance is none.
    #[error("landmark {index} of the map: its covariance is not symmetric and positive definite")]
    Covariance {
        /// Which one.
        index: usize,
    },
}

/// Landmarks that do not move, found by place.
#[derive(Clone, Debug, Default)]
pub(crate) struct StaticMap {
    landmarks: Vec<Landmark>,
    index: PointIndex,
    /// Largest variance of a position, both axes together [m^2].
    pub variance_max: f64,
}

impl StaticMap {
    pub fn new(map: LandmarkMap) -> Result<Self, InvalidMap> {
        for (index, landmark) in map.landmarks.iter().enumerate() {
            let c = &landmark.covariance;
            if !landmark.position.iter().all(|v| COORDINATE.holds(*v)) {
                return Err(InvalidMap::Position { index });
            }
            let symmetric = (c.m12 - c.m21).abs() <= 1e-9 * (c.m11.abs() + c.m22.abs());
            if !(symmetric && c.m11 > 0.0 && c.determinant() > 0.0 && c.iter().all(|v| VARIANCE.holds(*v))) {
                return Err(InvalidMap::Covariance { index });
            }
        }
        let points: Vec<Vector2<f64>> = map.landmarks.iter().map(|l| l.position).collect();
        let variance_max = map.landmarks.iter().map(|l| l.covariance.trace()).fold(0.0, f64::max);
        Ok(Self { landmarks: map.landmarks, index: PointIndex::new(&points), variance_max })
    }

    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks
    }

    /// Calls `visit` with every landmark within `radius` of a place.
    pub fn near(&self, place: Vector2<f64>, radius: f64, mut visit: impl FnMut(usize, &Landmark)) {
        self.index.within(place, radius, |k, _| visit(k, &self.landmarks[k]));
    }
}

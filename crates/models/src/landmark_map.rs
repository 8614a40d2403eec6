//! Point landmarks in the map frame, with what is known of how well and how often each was seen.

use nalgebra::{Matrix2, Vector2};

/// What a landmark is: only like is paired with like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LandmarkKind {
    /// A corner of the building or of what stands in it.
    #[default]
    Corner,
    /// A retroreflective mark.
    Reflector,
}

impl LandmarkKind {
    /// The name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Corner => "corner",
            Self::Reflector => "reflector",
        }
    }

    /// The kind of a name in files.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Corner, Self::Reflector].into_iter().find(|kind| kind.name() == name)
    }
}

/// A corner feature or a reflector.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// What it is.
    pub kind: LandmarkKind,
    /// Position in the map frame [m].
    pub position: Vector2<f64>,
    /// Covariance of the position [m^2].
    pub covariance: Matrix2<f64>,
    /// Direction into which the corner opens, in the map frame [rad]; none where it was not measured.
    pub orientation: Option<f64>,
    /// 128 binary cells that describe its surroundings, turned by the orientation; compared by the cells that differ.
    pub descriptor: Option<u128>,
    /// Number of scans in which it was detected.
    pub seen: u32,
    /// Number of scans in which it was in view.
    pub visible: u32,
}

/// All landmarks of a map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LandmarkMap {
    /// In order of first sight.
    pub landmarks: Vec<Landmark>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back() {
        for kind in [LandmarkKind::Corner, LandmarkKind::Reflector] {
            assert_eq!(LandmarkKind::from_name(kind.name()), Some(kind));
        }
        assert_eq!(LandmarkKind::from_name("pole"), None);
    }
}

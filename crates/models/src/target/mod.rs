//! A target: one or several flat panels, rigid on a robot or held by hand.
//!
//! A [`Panel`] has a pattern ([`Pattern`]), whose corners are numbered and lie in the plane z = 0 of the panel's frame,
//! and a place on the robot, `T_robot_panel`. Calibration of a camera needs no place; mapping a network does.

mod pattern;

pub use pattern::{Charuco, Chessboard, Pattern, TagGrid};

use crate::bounds::COORDINATE;
use crate::error::ModelError;
use groma_geometry::{Se3, So3};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// A flat panel.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Its name.
    pub name: String,
    /// What is printed on it.
    pub pattern: Pattern,
    /// Origin of its frame seen from the robot [m].
    pub position: [f64; 3],
    /// Rotation of `T_robot_panel`: x, y, z, w.
    pub quaternion: [f64; 4],
}

/// Panels that can be distinguished.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// At least one.
    pub panels: Vec<Panel>,
}

impl Panel {
    /// The place of the panel on the robot.
    #[must_use]
    pub fn t_robot_panel(&self) -> Se3 {
        let [x, y, z, w] = self.quaternion;
        let quaternion = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
        Se3 { rotation: So3 { quaternion }, translation: Vector3::from(self.position) }
    }

    fn check(&self) -> Result<(), ModelError> {
        self.position.iter().try_for_each(|&v| COORDINATE.check("position", v))?;
        self.quaternion.iter().try_for_each(|&v| COORDINATE.check("quaternion", v))?;
        let length = self.quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
        crate::error::require("quaternion", length, length > 1e-9, "must have a length above 1e-9")?;
        self.pattern.check()
    }
}

impl Target {
    /// Refuses a target without panels, with senseless sizes, or with panels that look alike.
    ///
    /// # Errors
    /// [`ModelError`], which says what.
    pub fn check(&self) -> Result<(), ModelError> {
        if self.panels.is_empty() {
            return Err(ModelError::NoPanel);
        }
        for (k, panel) in self.panels.iter().enumerate() {
            panel.check()?;
            let alike = |other: &&Panel| other.name == panel.name || other.pattern.is_mistaken_for(&panel.pattern);
            if let Some(other) = self.panels[..k].iter().find(alike) {
                return Err(ModelError::SamePanels(other.name.clone(), panel.name.clone()));
            }
        }
        Ok(())
    }
}

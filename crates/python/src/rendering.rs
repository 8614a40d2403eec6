//! `groma.rendering`: images of panels, and of the scenes of a network.

use crate::border::{self, In3, Out};
use crate::camera::{invalid, parse};
use groma_geometry::{LieGroup, Se3, So3};
use groma_models::{Camera, Pattern, Target};
use groma_simulation::network::{NetworkRecording, NetworkScene, images};
use groma_simulation::render::{Appearance, Drawing, Shown, render};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use pyo3::prelude::*;

/// The default appearance as JSON.
#[pyfunction]
pub(crate) fn appearance_defaults() -> PyResult<String> {
    serde_json::to_string(&Appearance::default()).map_err(invalid)
}

/// The image of the panels of a target, at poses `T_camera_panel` (panels, 4, 4): pixels row by row.
#[pyfunction]
pub(crate) fn render_target<'py>(
    py: Python<'py>,
    camera: &str,
    target: &str,
    poses: In3<'py, f64>,
    appearance: &str,
    seed: u64,
) -> PyResult<border::Array1<u8>> {
    let (camera, target, appearance): (Camera, Target, Appearance) =
        (parse(camera)?, parse(target)?, parse(appearance)?);
    let drawings = drawings(&target)?;
    let poses = poses.as_array();
    let poses: Vec<Se3> = poses.outer_iter().map(|t| pose(|i, j| t[(i, j)])).collect();
    let panel = |(k, t): (usize, &Se3)| Shown {
        pattern: &target.panels[k].pattern,
        drawings: &drawings[k],
        t_camera_panel: *t,
    };
    let shown: Vec<_> = poses.iter().enumerate().take(target.panels.len()).map(panel).collect();
    let pixels = py.detach(|| render(&camera, &shown, &appearance, seed)).map_err(invalid)?;
    Ok(pixels.out(py))
}

/// What the cameras of a simulated network see at the stops of the robot.
#[pyclass(frozen, module = "groma._core")]
pub(crate) struct NetworkRenderer {
    scene: NetworkScene,
    recording: NetworkRecording,
    drawings: Vec<Vec<Drawing>>,
    appearance: Appearance,
}

#[pymethods]
impl NetworkRenderer {
    #[new]
    fn new(scene: &str, appearance: &str) -> PyResult<Self> {
        let (scene, appearance): (NetworkScene, Appearance) = (parse(scene)?, parse(appearance)?);
        let recording = groma_simulation::network::simulate(&scene).map_err(invalid)?;
        let drawings = drawings(&scene.target)?;
        Ok(Self { scene, recording, drawings, appearance })
    }

    /// Begin and end of each stop [s].
    fn stops(&self) -> Vec<(f64, f64)> {
        self.recording.stops.iter().map(|stop| (stop.from, stop.to)).collect()
    }

    /// The image of a camera at a stop, row by row; nothing when no panel would be in view.
    fn image<'py>(&self, py: Python<'py>, stop: usize, camera: usize) -> PyResult<Option<border::Array1<u8>>> {
        let image = || images::image(&self.scene, &self.recording, (stop, camera), &self.drawings, &self.appearance);
        Ok(py.detach(image).map_err(invalid)?.map(|pixels| pixels.out(py)))
    }
}

fn drawings(target: &Target) -> PyResult<Vec<Vec<Drawing>>> {
    let of_panel = |pattern: &Pattern| match pattern {
        Pattern::TagGrid(grid) => groma_vision::tag_drawings(grid).map_err(invalid),
        _ => Ok(vec![]),
    };
    target.panels.iter().map(|panel| of_panel(&panel.pattern)).collect()
}

/// A pose from the entries of its (4, 4) matrix.
pub fn pose(at: impl Fn(usize, usize) -> f64) -> Se3 {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_fn(&at));
    let quaternion = UnitQuaternion::from_rotation_matrix(&rotation);
    Se3 { rotation: So3 { quaternion }, translation: Vector3::from_fn(|i, _| at(i, 3)) }
}

/// The entries of the (4, 4) matrix of a pose, row by row.
pub fn entries(pose: &Se3) -> [f64; 16] {
    let (x, y, z, t) = (Vector3::x(), Vector3::y(), Vector3::z(), pose.translation);
    let [x, y, z] = [x, y, z].map(|axis| pose.rotation.act(&axis));
    [x.x, y.x, z.x, t.x, x.y, y.y, z.y, t.y, x.z, y.z, z.z, t.z, 0.0, 0.0, 0.0, 1.0]
}

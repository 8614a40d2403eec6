//! `groma.survey`: poses and scans pushed in order of time, a map at these poses as arrays.

use crate::border::{In1, In2};
use crate::findings::{Row, to_rows};
use crate::gate::{self, Beams};
use crate::mapping::{GridArrays, LandmarkArrays, grid, landmarks, laser_scan, settings};
use crate::token::{Token, interruptible};
use groma_pipeline::message::StartPose;
use groma_pipeline::{MapAtPoses as Core, Message};
use nalgebra::Matrix3;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

type Pose = (f64, f64, f64);

/// A map at known poses.
#[pyclass(frozen, get_all, module = "groma._core")]
pub(crate) struct KnownPosesMap {
    landmarks: Py<LandmarkArrays>,
    grid: Py<GridArrays>,
    scans: usize,
    keyframes: usize,
    findings: Vec<Row>,
}

/// Builds a map from scans at known poses; `finish` may be called once.
#[pyclass(module = "groma._core")]
pub(crate) struct MapAtPoses(Option<Core>);

impl MapAtPoses {
    fn core(&mut self) -> PyResult<&mut Core> {
        self.0.as_mut().ok_or_else(finished)
    }
}

#[pymethods]
impl MapAtPoses {
    /// `mount` is `T_base_laser`; messages up to `lateness` seconds late are put into order.
    #[new]
    #[pyo3(signature = (options, mount, lateness=0.0))]
    fn new(options: &str, mount: Pose, lateness: f64) -> PyResult<Self> {
        Ok(Self(Some(Core::new(settings(options)?, gate::pose(mount)?, lateness))))
    }

    /// `T_map_base` at a time, with the covariance (3, 3) of its perturbation on the right.
    fn push_pose(&mut self, stamp: f64, pose: Pose, covariance: In2<'_, f64>) -> PyResult<()> {
        let (pose, covariance) = (gate::pose(pose)?, covariance.as_array());
        if covariance.dim() != (3, 3) {
            return Err(PyValueError::new_err(format!("covariance: must be 3 x 3, not {:?}", covariance.dim())));
        }
        let covariance = Matrix3::from_fn(|i, j| covariance[(i, j)]);
        self.core()?.push(Message::StartPose(StartPose { stamp, pose, covariance }));
        Ok(())
    }

    fn push_scan(
        &mut self,
        py: Python<'_>,
        stamp: f64,
        ranges: In1<'_, f64>,
        intensities: In1<'_, f64>,
        beams: Beams,
    ) -> PyResult<()> {
        let scan = laser_scan(stamp, &ranges, &intensities, beams)?;
        let core = self.core()?;
        py.detach(|| core.push(Message::Scan { scanner: 0, scan }));
        Ok(())
    }

    /// Scans that came, that were used and that wait for a pose.
    fn state(&mut self) -> PyResult<(usize, usize, usize)> {
        let state = self.core()?.state();
        Ok((state.scans, state.keyframes, state.waiting))
    }

    /// The map.
    #[pyo3(signature = (token=None))]
    fn finish(&mut self, py: Python<'_>, token: Option<&Token>) -> PyResult<KnownPosesMap> {
        let core = self.0.take().ok_or_else(finished)?;
        let result = interruptible(py, token, None, |token| core.finish(token))?;
        let result = result.map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
        Ok(KnownPosesMap {
            landmarks: Py::new(py, landmarks(py, &result.landmarks))?,
            grid: Py::new(py, grid(py, &result.grid))?,
            scans: result.state.scans,
            keyframes: result.state.keyframes,
            findings: to_rows(&result.findings),
        })
    }
}

fn finished() -> PyErr {
    PyValueError::new_err("this map is finished")
}

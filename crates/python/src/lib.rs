//! Bindings of the Rust core: arrays in, arrays out, the GIL released. No logic lives here.

mod calibrate_pipeline;
mod calibration;
mod camera;
mod camera_calibration;
mod camera_plan;
mod exploration;
mod features;
mod findings;
mod gate;
mod localization;
mod localize;
mod map_at_poses;
mod mapping;
mod network;
mod pose_graph;
mod poses;
mod promotion;
mod recognition;
mod rendering;
mod simulation;
mod token;
mod vehicle;
mod vehicle_plan;
mod vision;
mod wheels;

use pyo3::prelude::*;

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    camera::register(m)?;
    camera_calibration::register(m)?;
    camera_plan::register(m)?;
    calibrate_pipeline::register(m)?;
    calibration::register(m)?;
    exploration::register(m)?;
    features::register(m)?;
    findings::register(m)?;
    gate::register(m)?;
    token::register(m)?;
    localization::register(m)?;
    localize::register(m)?;
    map_at_poses::register(m)?;
    mapping::register(m)?;
    network::register(m)?;
    pose_graph::register(m)?;
    poses::register(m)?;
    promotion::register(m)?;
    recognition::register(m)?;
    rendering::register(m)?;
    simulation::register(m)?;
    vehicle::register(m)?;
    vision::register(m)?;
    vehicle_plan::register(m)?;
    wheels::register(m)?;
    m.add("__version__", env!("CARGO_PKG_VERSION"))
}

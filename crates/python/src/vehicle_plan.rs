//! `groma.vehicle_plan`: which arcs calibrate a vehicle.

use crate::calibration::{parse, to_model};
use crate::gate;
use crate::pose_graph::estimation_error;
use crate::token::{Token, cancelled, interruptible};
use groma_calibration::vehicle::{Layout, Model, Vehicle};
use groma_geometry::Se2;
use groma_models::{Differential, Drive, Tricycle};
use groma_planning::vehicle::grid::grid;
use groma_planning::vehicle::plan::{choice, plan};
use groma_planning::vehicle::{Arc, Error, Floor, Footprint, Limits, Noise, Plan, Request};
use nalgebra::Vector2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::HashMap;

/// Steering, path of the wheel, speed, turn, path of the base, start x, y, heading of an arc.
type Row = (f64, f64, f64, f64, f64, f64, f64, f64);
/// Arcs, standard deviations by name, time, bound.
type Planned = (Vec<Row>, Vec<(String, f64)>, f64, f64);
/// Corners of the floor; front, rear, side of the outline.
type Room = Option<(Vec<(f64, f64)>, (f64, f64, f64))>;

/// Limits and noise as JSON.
#[pyfunction]
pub(crate) fn vehicle_plan_defaults() -> PyResult<(String, String)> {
    let json = |r: serde_json::Result<String>| r.map_err(|e| PyValueError::new_err(e.to_string()));
    Ok((json(serde_json::to_string(&Limits::default()))?, json(serde_json::to_string(&Noise::default()))?))
}

/// The plan of least time.
#[pyfunction]
#[pyo3(signature = (model, parameters, free, sigmas, noise, limits, room, token=None))]
#[expect(clippy::too_many_arguments, reason = "one argument a part of the request: Python names them")]
#[expect(clippy::needless_pass_by_value, reason = "Python hands over what it made")]
pub(crate) fn vehicle_plan(
    py: Python<'_>,
    model: &str,
    parameters: HashMap<String, f64>,
    free: Vec<String>,
    sigmas: HashMap<String, f64>,
    noise: &str,
    limits: &str,
    room: Room,
    token: Option<&Token>,
) -> PyResult<Planned> {
    let (layout, vehicle, sigmas) = wanted(model, &parameters, &free, &sigmas)?;
    let (noise, limits): (Noise, Limits) = (parse(noise)?, parse(limits)?);
    let floor = room.map(to_floor).transpose()?;
    let request = Request { vehicle, layout: &layout, sigmas: &sigmas, noise, limits, floor };
    let found = interruptible(py, token, None, |token| plan(&request, token))?.map_err(|e| raise(py, &e))?;
    Ok(to_planned(&vehicle, &layout, &found))
}

/// The grid of the thesis: arcs, and how many and how much time of it the wanted deviations take, in parts of arcs.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "one argument a part of the request: Python names them")]
#[expect(clippy::needless_pass_by_value, reason = "Python hands over what it made")]
pub(crate) fn vehicle_grid(
    model: &str,
    parameters: HashMap<String, f64>,
    free: Vec<String>,
    sigmas: HashMap<String, f64>,
    noise: &str,
    limits: &str,
    count: usize,
    turn: f64,
) -> PyResult<Grid> {
    let (layout, vehicle, sigmas) = wanted(model, &parameters, &free, &sigmas)?;
    let (noise, limits): (Noise, Limits) = (parse(noise)?, parse(limits)?);
    noise.validate().and(limits.validate()).map_err(gate::refused)?;
    let arcs = grid(&vehicle, count, turn, &limits);
    let request = Request { vehicle, layout: &layout, sigmas: &sigmas, noise, limits, floor: None };
    let choice = choice(&request, &arcs);
    let scaled = choice.scaled(&vec![1.0; arcs.len()]);
    let rows = arcs.iter().map(|arc| row(&vehicle, arc, &Se2::IDENTITY)).collect();
    Ok((rows, scaled.map(|w| (w.iter().sum(), choice.total(&w)))))
}

/// The arcs; their number and time.
type Grid = (Vec<Row>, Option<(f64, f64)>);
type Wanted = (Layout, Vehicle, Vec<Option<f64>>);

fn wanted(
    model: &str,
    parameters: &HashMap<String, f64>,
    free: &[String],
    sigmas: &HashMap<String, f64>,
) -> PyResult<Wanted> {
    let model = to_model(Some(model))?.unwrap_or(Model::Tricycle);
    let free: Vec<&str> = free.iter().map(String::as_str).collect();
    let layout = Layout::new(model, &free).map_err(|e| PyValueError::new_err(e.to_string()))?;
    let names = layout.names();
    if let Some(name) = sigmas.keys().find(|name| !names.contains(&name.as_str())) {
        let known = names.join(", ");
        return Err(PyValueError::new_err(format!("tolerance of {name}: the free parameters are {known}")));
    }
    let sigmas = names.iter().map(|name| sigmas.get(*name).copied()).collect();
    Ok((layout, to_vehicle(model, parameters)?, sigmas))
}

fn to_vehicle(model: Model, parameters: &HashMap<String, f64>) -> PyResult<Vehicle> {
    let get = |name: &str| {
        let value = parameters.get(name).copied().filter(|v| v.is_finite());
        value.ok_or_else(|| PyValueError::new_err(format!("the vehicle has no {name}")))
    };
    let or = |name: &str, other: f64| parameters.get(name).copied().unwrap_or(other);
    let drive = if model == Model::Differential {
        let (left, right, axle) = (get("left_radius")?, get("right_radius")?, get("axle")?);
        Drive::Differential(Differential { left, right, axle })
    } else {
        let offset = or("steering_offset", 0.0);
        Drive::Tricycle(Tricycle {
            scale: get("drive_scale")?,
            wheelbase: get("wheelbase")?,
            gain: or("steering_gain", 1.0),
            offset_forward: or("steering_offset_forward", offset),
            offset_backward: or("steering_offset_backward", offset),
        })
    };
    let laser = Se2::new(get("laser_x")?, get("laser_y")?, get("laser_yaw")?);
    Ok(Vehicle { drive, laser, delay: 0.0 })
}

fn to_floor((corners, (front, rear, side)): (Vec<(f64, f64)>, (f64, f64, f64))) -> PyResult<(Floor, Footprint)> {
    let corners = corners.into_iter().map(|(x, y)| Vector2::new(x, y)).collect();
    let floor = Floor::new(corners);
    let why = "the floor must have three corners at least that are finite and enclose an area";
    Ok((floor.ok_or_else(|| PyValueError::new_err(why))?, Footprint { front, rear, side }))
}

fn to_planned(vehicle: &Vehicle, layout: &Layout, found: &Plan) -> Planned {
    let rows = found.arcs.iter().zip(&found.starts).map(|(arc, start)| row(vehicle, arc, start)).collect();
    let sigmas = layout.names().iter().map(ToString::to_string).zip(found.sigmas.iter().copied()).collect();
    (rows, sigmas, found.time, found.bound)
}

fn row(vehicle: &Vehicle, arc: &Arc, start: &Se2) -> Row {
    let u = arc.path_and_turn(vehicle);
    (arc.steering, arc.path, arc.speed, u.y, u.x, start.x(), start.y(), start.theta())
}

fn raise(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Cancelled(_) => cancelled(),
        Error::Sigma | Error::Number(_) => PyValueError::new_err(error.to_string()),
        _ => estimation_error(py, error.to_string()),
    }
}

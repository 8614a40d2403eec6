//! Prints how long the batch takes for a thousand cameras and twenty thousand views, and how much memory.
//!
//!     cargo bench -p groma-benches --bench network -- [cameras] [views a camera]

#![allow(clippy::disallowed_methods, clippy::print_stdout, clippy::unwrap_used)]

use groma_estimation::random::SplitMix64;
use groma_geometry::{LieGroup, Se2, Se3};
use groma_models::{Camera, Lens as Model};
use groma_network::batch::{Batch, BatchView, Lens, State};
use groma_network::odometry::Motion;
use groma_network::view::Corner;
use groma_network::{Floor, OdometryNoise};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};
use std::time::Instant;

const CORNERS: usize = 144;
/// Cameras in a row; the robot drives all rows to and fro, then all columns.
const ROW: usize = 40;
const SPACING: f64 = 5.0;
const SIGMA: f64 = 0.3;

/// A pose a little off.
fn off(draw: &mut SplitMix64, metres: f64, radians: f64) -> Se3 {
    Se3::exp(&Vector6::from_fn(|k, _| if k < 3 { metres } else { radians } * draw.normal()))
}

fn main() {
    let mut numbers = std::env::args().filter_map(|a| a.parse().ok());
    let (cameras, each) = (numbers.next().unwrap_or(1000), numbers.next().unwrap_or(20));
    let mut draw = SplitMix64::new(1);
    let (batch, start, truth) = problem(cameras, each, &mut draw);
    let begin = Instant::now();
    let solution = batch.solve(start, &groma_models::Token::new()).unwrap();
    let seconds = begin.elapsed().as_secs_f64();
    let error = |k: usize| (solution.state.places[k].translation - truth[k].translation).norm();
    let mean = (0..cameras).map(error).sum::<f64>() / cameras as f64;
    let (chi, count) = solution.residuals.views.iter().fold((0.0, 0), |s, v| (s.0 + v.0, s.1 + v.1));
    println!("{cameras} cameras, {} views, {} stops, {count} coordinates", batch.views.len(), batch.motions.len() + 1);
    println!(
        "{seconds:.1} s, {} of the processors, {} steps, converged: {}, chi-square/coordinates {:.3}, mean camera error {mean:.4} m, peak memory {}",
        on_processors(),
        solution.iterations,
        solution.converged,
        chi / count as f64,
        peak()
    );
}

/// Time of all threads since the start, that of making the problem included.
fn on_processors() -> String {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks: f64 = text.split_whitespace().skip(13).take(2).filter_map(|v| v.parse::<f64>().ok()).sum();
    format!("{:.1} s", ticks / 100.0)
}

fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("unknown");
    line.trim_start_matches("VmHWM:").trim().to_owned()
}

fn level(x: f64, y: f64, yaw: f64) -> Se3 {
    let turn = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, yaw));
    Se3 { translation: Vector3::new(x, y, 0.0), ..turn }
}

fn problem(cameras: usize, each: usize, draw: &mut SplitMix64) -> (Batch, State, Vec<Se3>) {
    let noise = OdometryNoise::default();
    let floor = Floor::default();
    let camera = Camera::centred(640, 480, Model::Pinhole, 600.0).unwrap();
    let mut basis = DMatrix::zeros(4, 1);
    (basis[(0, 0)], basis[(1, 0)]) = (1.2, 1.2);
    let place = |k: usize| {
        let (row, column) = (k / ROW, k % ROW);
        (SPACING * if row.is_multiple_of(2) { column } else { ROW - 1 - column } as f64, SPACING * row as f64)
    };
    let optical = Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, -std::f64::consts::FRAC_PI_2))
        * Se3::exp(&Vector6::new(0.0, 0.0, 0.0, -2.0, 0.0, 0.0));
    let truth: Vec<Se3> = (0..cameras)
        .map(|k| Se3 { translation: Vector3::new(place(k).0 - 3.0, place(k).1, 2.2), ..level(0.0, 0.0, 0.0) * optical })
        .collect();
    let (mut stops, mut motions, mut views): (Vec<Se3>, Vec<Motion>, Vec<BatchView>) = (vec![], vec![], vec![]);
    let mut last: Option<(f64, f64, f64)> = None;
    for pass in 0..2 {
        for k in order(cameras, pass) {
            for turn in 0..each / 2 {
                let (x, y) = place(k);
                let first = pass == 0 && k == 0 && turn == 0;
                let yaw = if first { 0.0 } else { 0.6 * (turn as f64 / (each / 2) as f64 - 0.5) + 0.2 * draw.normal() };
                let at = if first { (0.0, 0.0, 0.0) } else { (x + 0.2 * draw.normal(), y + 0.2 * draw.normal(), yaw) };
                let pose = level(at.0, at.1, at.2);
                if let Some(last) = last {
                    motions.push(motion(last, at, &noise, draw));
                }
                last = Some(at);
                let (h, t) = (floor.height, floor.tilt);
                let uneven = Vector6::new(0.0, 0.0, h * draw.normal(), t * draw.normal(), t * draw.normal(), 0.0);
                let pose = pose * Se3::exp(&uneven);
                views.push(BatchView {
                    stop: stops.len(),
                    place: k,
                    lens: k,
                    corners: seen(&camera, &truth[k], &pose, draw),
                });
                stops.push(pose);
            }
        }
    }
    let start = State {
        stops: stops.iter().map(|pose| *pose * off(draw, 0.01, 0.003)).collect(),
        places: truth.iter().map(|pose| *pose * off(draw, 0.02, 0.003)).collect(),
        calibrations: vec![DVector::zeros(1); cameras],
        mount: Se3::identity(),
    };
    let mount = Vector6::new(0.01, 0.01, 0.0, 0.017, 0.017, 0.017);
    let batch = Batch {
        motions,
        floor,
        lenses: vec![Lens { camera, basis }; cameras],
        views,
        mount: (Se3::identity(), Matrix6::from_diagonal(&mount.component_mul(&mount))),
        slack: [0.0, 0.0],
        iterations: 30,
    };
    (batch, start, truth)
}

/// Cameras in the order in which a pass comes by: by rows, then by columns, each to and fro.
fn order(cameras: usize, pass: usize) -> Vec<usize> {
    if pass == 0 {
        return (0..cameras).collect();
    }
    let along = |k: usize| if (k / ROW).is_multiple_of(2) { k % ROW } else { ROW - 1 - k % ROW };
    let mut order: Vec<usize> = (0..cameras).collect();
    order.sort_by_key(|&k| (along(k), if along(k).is_multiple_of(2) { k / ROW } else { cameras - k / ROW }));
    order
}

/// Odometry from one stop to the next: its noise, in one step.
fn motion(from: (f64, f64, f64), to: (f64, f64, f64), noise: &OdometryNoise, draw: &mut SplitMix64) -> Motion {
    let step = Se2::new(from.0, from.1, from.2).between(&Se2::new(to.0, to.1, to.2));
    let sigmas = noise.variances(&step).map(f64::sqrt);
    let w = Vector3::new(sigmas[0] * draw.normal(), sigmas[1] * draw.normal(), sigmas[2] * draw.normal());
    Motion::default().then(&(step * Se2::exp(w)), noise)
}

/// The corners of a grid of 12 x 12, 0.6 m wide, 0.9 m high on the robot, looking back.
fn seen(camera: &Camera, t_w_c: &Se3, robot: &Se3, draw: &mut SplitMix64) -> Vec<Corner> {
    let side = (CORNERS as f64).sqrt() as usize;
    let pose = t_w_c.between(robot);
    let corner = |k: usize| {
        let (u, v) = ((k % side) as f64 / (side - 1) as f64 - 0.5, (k / side) as f64 / (side - 1) as f64 - 0.5);
        let point = Vector3::new(-0.3, 0.6 * u, 0.9 + 0.6 * v);
        let pixel = camera.project(&pose.act(&point)).unwrap();
        let off = nalgebra::Vector2::new(draw.normal(), draw.normal()) * SIGMA;
        Corner { panel: 0, on_panel: Vector3::new(0.6 * u, 0.6 * v, 0.0), point, pixel: pixel + off, sigma: SIGMA }
    };
    (0..CORNERS).map(corner).collect()
}

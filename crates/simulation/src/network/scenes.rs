//! Networks that have a name.
//!
//! Cameras look along the corridor from 2.2 m, 640 x 480 pixels, f 600; the robot carries four panels of 6 x 6 tags, 0.6 m
//! wide, one to each side. In the view of each camera it stops and turns to six headings.

use super::{NetworkNoise, NetworkScene, SceneCamera, WalkNoise};
use crate::error::SimulationError;
use groma_geometry::wrap;
use groma_models::target::TagGrid;
use groma_models::{Camera, Lens, Panel, Pattern, Target};
use nalgebra::{UnitQuaternion, Vector2};
use std::f64::consts::{FRAC_PI_2, PI};

/// Names of the scenes.
pub const NETWORK_SCENES: [&str; 4] = ["corridor", "loop", "laps", "hallway"];

/// Headings in the view of a camera, against the course of the way [degrees].
const HEADINGS: [f64; 6] = [0.0, 20.0, 40.0, -40.0, -20.0, -5.0];
/// How far before the camera the robot stops [m].
const AHEAD: f64 = 3.0;
/// Height of the cameras [m].
const HIGH: f64 = 2.2;
/// How far below the horizon they look [rad].
const DOWN: f64 = 0.43;

pub(super) fn named(name: &str, seed: u64) -> Result<NetworkScene, SimulationError> {
    match name {
        "corridor" => scene(seed, &corridor(50.0, 7), [1, 0]),
        "loop" => scene(seed, &rectangle(15.0, 10.0, 8), [1, 0]),
        "laps" => scene(seed, &rectangle(15.0, 10.0, 8), [3, 0]),
        "hallway" => hallway(seed),
        _ => Err(SimulationError::UnknownScene { kind: "network", name: name.to_owned(), known: &NETWORK_SCENES }),
    }
}

/// A way through a building: places where a camera is passed, with the course there, and corners of the way.
struct Way {
    points: Vec<(Vector2<f64>, f64, bool)>,
    closed: bool,
}

fn corridor(length: f64, cameras: usize) -> Way {
    let step = (length - AHEAD) / (cameras - 1) as f64;
    let points = (0..cameras).map(|k| (Vector2::new(step * k as f64, 0.0), 0.0, true)).collect();
    Way { points, closed: false }
}

/// Once around a rectangle from its lower left corner, counter-clockwise, cameras evenly along it.
fn rectangle(width: f64, height: f64, cameras: usize) -> Way {
    let sides = [(width, 0.0), (height, FRAC_PI_2), (width, PI), (height, -FRAC_PI_2)];
    let length = 2.0 * (width + height);
    let places: Vec<f64> = (0..cameras).map(|k| length * k as f64 / cameras as f64).collect();
    let (mut points, mut start, mut travelled) = (vec![], Vector2::zeros(), 0.0);
    for (side, course) in sides {
        let direction = Vector2::new(course.cos(), course.sin());
        points.push((start, course, places.contains(&travelled)));
        let inner = places.iter().filter(|&&s| s > travelled && s < travelled + side);
        points.extend(inner.map(|s| (start + direction * (s - travelled), course, true)));
        start += direction * side;
        travelled += side;
    }
    Way { points, closed: true }
}

/// Ten laps, 500 m in all, with better wheels than usual: odometry ends off by about a metre.
fn hallway(seed: u64) -> Result<NetworkScene, SimulationError> {
    let mut scene = scene(seed, &rectangle(16.0, 9.0, 7), [1, 9])?;
    let walk = &mut scene.noise.odometry;
    for strength in [&mut walk.along, &mut walk.across, &mut walk.heading, &mut walk.turning] {
        *strength *= 0.35;
    }
    Ok(scene)
}

/// So many laps with all headings, and so many with two.
fn scene(seed: u64, way: &Way, laps: [usize; 2]) -> Result<NetworkScene, SimulationError> {
    let mut cameras = vec![];
    for (place, course, _) in way.points.iter().filter(|point| point.2) {
        cameras.push(camera(cameras.len(), place, *course)?);
    }
    let mut stops = vec![];
    for lap in 0..laps[0] + laps[1] {
        for (place, course, seen) in &way.points {
            let count = if lap < laps[0] { HEADINGS.len() } else { 2 };
            let headings = if *seen { &HEADINGS[..count] } else { &HEADINGS[..1] };
            stops.extend(headings.iter().map(|off| [place.x, place.y, wrap(course + off.to_radians())]));
        }
    }
    if way.closed {
        let again = stops[..HEADINGS.len()].to_vec();
        stops.extend(again);
    }
    Ok(NetworkScene {
        seed,
        cameras,
        target: four_panels(),
        stops,
        noise: NetworkNoise::usual(),
        frames: 1,
        bump: None,
    })
}

/// A camera ahead of a place, that looks back at it.
fn camera(number: usize, place: &Vector2<f64>, course: f64) -> Result<SceneCamera, SimulationError> {
    let at = place + AHEAD * Vector2::new(course.cos(), course.sin());
    let lens = Camera::centred(640, 480, Lens::Pinhole, 600.0).map_err(|e| SimulationError::Scene(e.to_string()))?;
    Ok(SceneCamera {
        name: format!("camera{}", number + 1),
        camera: lens,
        position: [at.x, at.y, HIGH],
        heading: wrap(course + PI),
        down: DOWN,
    })
}

/// Panels ahead, to the left, behind and to the right of the robot.
fn four_panels() -> Target {
    let names = ["ahead", "left", "behind", "right"];
    let panel = |(k, name): (usize, &&str)| {
        let heading = FRAC_PI_2 * k as f64;
        // z of the panel looks outward, y up; the grid is 0.6 m wide, so its origin is 0.3 m to the side.
        let turn = UnitQuaternion::from_euler_angles(FRAC_PI_2, 0.0, heading + FRAC_PI_2);
        let middle = nalgebra::Vector3::new(0.3 * heading.cos(), 0.3 * heading.sin(), 0.9);
        let corner = middle - turn * nalgebra::Vector3::new(0.3, 0.3, 0.0);
        let grid = TagGrid {
            family: "tag36h11".to_owned(),
            columns: 6,
            rows: 6,
            size: 0.08,
            spacing: 0.3,
            first_id: 36 * k as u32,
            border: 2,
        };
        let q = turn.coords;
        Panel {
            name: (*name).to_owned(),
            pattern: Pattern::TagGrid(grid),
            position: corner.into(),
            quaternion: [q.x, q.y, q.z, q.w],
        }
    };
    Target { panels: names.iter().enumerate().map(panel).collect() }
}

impl NetworkNoise {
    /// Wheels on a hard floor, a calibrated camera, a good detector: the set-up of the notes' section 8.
    #[must_use]
    pub fn usual() -> Self {
        let degree = 1f64.to_radians();
        Self {
            odometry: WalkNoise {
                along: 0.02,
                across: 0.01,
                heading: 0.5 * degree,
                turning: degree / 90f64.to_radians().sqrt(),
            },
            corner: 0.3,
            floor_height: 0.002,
            floor_tilt: 0.2 * degree,
            focal: 0.0,
            mount: 0.0,
            mount_turn: 0.0,
            view: [0.0, 0.0],
        }
    }
}

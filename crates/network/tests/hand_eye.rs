//! Robot-world / hand-eye: noise-free recovery, and what a robot in the plane cannot tell.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use groma_geometry::{LieGroup, Se3};
use groma_models::target::TagGrid;
use groma_models::{Camera, Lens as Model, Pattern};
use groma_network::batch::Lens;
use groma_network::hand_eye::{closed_form, in_words, place};
use groma_network::view::Corner;
use nalgebra::{Vector2, Vector3, Vector6};

fn turn(axis: usize, angle: f64) -> Se3 {
    Se3::exp(&Vector6::from_fn(|k, _| if k == 3 + axis { angle } else { 0.0 }))
}

fn at(x: f64, y: f64, z: f64) -> Se3 {
    Se3 { translation: Vector3::new(x, y, z), ..Se3::identity() }
}

/// A camera 3 m ahead, 2.2 m up, looking back and down; a panel on the robot's front.
fn truth() -> (Se3, Se3) {
    let half = std::f64::consts::FRAC_PI_2;
    let optical = turn(2, -half) * turn(0, -half);
    let camera = at(3.0, 0.2, 2.2) * turn(2, 3.0) * turn(1, 0.4) * optical;
    let mount = at(0.3, 0.1, 0.7) * turn(2, half + 0.1) * turn(0, half - 0.05);
    (camera, mount)
}

fn planar_robots() -> Vec<Se3> {
    (0..14)
        .map(f64::from)
        .map(|k| at(0.3 * (k * 1.3).sin(), 0.4 * (k * 0.7).cos(), 0.0) * turn(2, 0.6 * (k * 2.1).sin()))
        .collect()
}

fn tilted_robots() -> Vec<Se3> {
    let tilt = |k: usize| turn(0, 0.2 * (k as f64 * 0.9).sin()) * turn(1, 0.25 * (k as f64 * 1.7).cos());
    planar_robots()
        .iter()
        .enumerate()
        .map(|(k, robot)| at(0.0, 0.0, 0.1 * (k as f64).sin()) * *robot * tilt(k))
        .collect()
}

fn apart(a: &Se3, b: &Se3) -> f64 {
    a.minus(b).norm()
}

#[test]
fn full_motion_gives_camera_and_mount_back() {
    let ((camera, mount), robots) = (truth(), tilted_robots());
    let views: Vec<Se3> = robots.iter().map(|robot| camera.between(&(*robot * mount))).collect();
    let found = closed_form(&robots, &views, 0.0).unwrap();
    assert!(!found.planar && apart(&found.camera, &camera) < 1e-9 && apart(&found.mount, &mount) < 1e-9, "{found:?}");
}

#[test]
fn motion_in_the_plane_gives_all_but_the_height() {
    let ((camera, mount), robots) = (truth(), planar_robots());
    let views: Vec<Se3> = robots.iter().map(|robot| camera.between(&(*robot * mount))).collect();
    let found = closed_form(&robots, &views, mount.translation.z).unwrap();
    assert!(found.planar && apart(&found.camera, &camera) < 1e-9 && apart(&found.mount, &mount) < 1e-9, "{found:?}");
    let higher = closed_form(&robots, &views, mount.translation.z + 0.1).unwrap();
    assert!(apart(&higher.camera, &(at(0.0, 0.0, 0.1) * camera)) < 1e-9);
}

/// Corners of a grid of 6 x 6 tags with a disturbance that repeats.
fn corners(robots: &[Se3], noise: f64) -> (Lens, Vec<Vec<Corner>>) {
    let lens = Camera::centred(1280, 960, Model::Pinhole, 1000.0).unwrap();
    let grid =
        TagGrid { family: "tag36h11".into(), columns: 6, rows: 6, size: 0.08, spacing: 0.3, first_id: 0, border: 2 };
    let points = Pattern::TagGrid(grid).corners();
    let (camera, mount) = truth();
    let seen = |robot: &Se3| {
        let pose = camera.between(&(*robot * mount));
        let corner = |(k, point): (usize, &Vector3<f64>)| {
            let off =
                noise * Vector2::new((k as f64 * 12.9 + robot.translation.x * 77.0).sin(), (k as f64 * 4.1).cos());
            let pixel = lens.project(&pose.act(point)).unwrap() + off;
            Corner { panel: 0, on_panel: *point, point: *point, pixel, sigma: 1.0 }
        };
        points.iter().enumerate().map(corner).collect()
    };
    let all = robots.iter().map(seen).collect();
    (Lens { basis: nalgebra::DMatrix::zeros(lens.count(), 0), camera: lens }, all)
}

#[test]
fn the_fit_names_the_height_and_nothing_else() {
    let (lens, seen) = corners(&planar_robots(), 0.3);
    let (fit, planar) = place(&lens, &planar_robots(), &seen, 0.7).unwrap();
    assert!(planar && fit.converged);
    let words: Vec<String> = fit.weak.iter().map(in_words).collect();
    assert!(words.len() == 1 && words[0].contains("height of the target on the robot is unobservable"), "{words:?}");
    assert!(apart(&fit.estimate.0, &truth().0) < 0.02);
    let (lens, seen) = corners(&tilted_robots(), 0.3);
    let (fit, planar) = place(&lens, &tilted_robots(), &seen, 0.0).unwrap();
    assert!(!planar && fit.weak.is_empty() && apart(&fit.estimate.1, &truth().1) < 0.02);
}

#[test]
fn a_robot_that_never_turns_does_not_determine_the_mount() {
    let robots: Vec<Se3> = (0..5).map(|k| at(0.1 * f64::from(k), 0.0, 0.0)).collect();
    let error = closed_form(&robots, &robots, 0.0).unwrap_err();
    assert!(error.to_string().contains("never turned"));
    assert!(closed_form(&robots[..2], &robots[..2], 0.0).unwrap_err().to_string().contains("three views"));
}

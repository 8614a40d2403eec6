//! Corners of grids on rendered images: how near they come, whether their claims hold, what is left out.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // helpers of tests, and figures for BENCHMARKS.md

use groma_geometry::{LieGroup, Se3, So3};
use groma_models::target::{Panel, Pattern, TagGrid, Target};
use groma_models::{Camera, Lens};
use groma_simulation::render::{Appearance, Shown, render};
use groma_vision::{Family, Found, Gray, Options, detect_tags, find_panels, tag_drawings};
use nalgebra::{Vector2, Vector3};

fn grid(border: u32, spacing: f64) -> TagGrid {
    TagGrid { family: "tag36h11".to_owned(), columns: 6, rows: 6, size: 0.08, spacing, first_id: 0, border }
}

fn target(grid: &TagGrid) -> Target {
    let pattern = Pattern::TagGrid(grid.clone());
    Target {
        panels: vec![Panel { name: "a".to_owned(), pattern, position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] }],
    }
}

fn camera() -> Camera {
    let parameters = vec![600.0, 604.0, 321.0, 238.0, -0.25, 0.08, 0.001, -0.0005];
    Camera::new(640, 480, Lens::Radtan, parameters).unwrap()
}

/// The panel's middle on the optical axis, its print towards the camera, turned by a rotation vector.
fn pose(turn: [f64; 3], range: f64) -> Se3 {
    let rotation = So3::exp(&Vector3::from(turn)) * So3::exp(&Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    Se3 { rotation, translation: Vector3::new(0.0, 0.0, range) - rotation.act(&Vector3::new(0.29, 0.29, 0.0)) }
}

struct Trial {
    found: Found,
    errors: Vec<Vector2<f64>>,
}

fn trial(grid: &TagGrid, pose: &Se3, appearance: &Appearance, seed: u64) -> Trial {
    let (camera, target, drawings) = (camera(), target(grid), tag_drawings(grid).unwrap());
    let pattern = &target.panels[0].pattern;
    let shown = Shown { pattern, drawings: &drawings, t_camera_panel: *pose };
    let pixels = render(&camera, &[shown], appearance, seed).unwrap();
    let image = Gray::new(640, 480, &pixels).unwrap();
    let found = find_panels(&image, &target, &Options::default()).unwrap().remove(0).1;
    let truth = |id: u32| camera.project(&pose.act(&pattern.corner(id).unwrap())).unwrap();
    let errors = found.corners.iter().map(|c| c.pixel - truth(c.id)).collect();
    Trial { found, errors }
}

fn poses() -> Vec<Se3> {
    let turns = [[0.0, 0.0, 0.0], [0.5, 0.0, 0.1], [0.0, 0.6, -0.2], [-0.4, 0.3, 0.7], [0.3, -0.5, 1.8]];
    let ranges = [1.1, 1.3, 1.6];
    turns.iter().zip(ranges.iter().cycle()).map(|(turn, range)| pose(*turn, *range)).collect()
}

/// Root mean square of a coordinate, mean error (u, v), mean square in units of the claims.
fn figures(grid: &TagGrid, appearance: &Appearance) -> (f64, Vector2<f64>, f64) {
    let (mut sum, mut square, mut claimed, mut count) = (Vector2::zeros(), 0.0, 0.0, 0.0);
    for (seed, pose) in poses().iter().enumerate() {
        let trial = trial(grid, pose, appearance, seed as u64);
        for (corner, error) in trial.found.corners.iter().zip(&trial.errors) {
            sum += error;
            square += error.norm_squared();
            claimed += error.norm_squared() / (corner.sigma * corner.sigma);
            count += 1.0;
        }
        let (seen, unrefined) = (trial.found.corners.len(), trial.found.unrefined);
        assert!(seen >= 136, "pose {seed}: {seen} corners, {unrefined} not fitted");
    }
    ((0.5 * square / count).sqrt(), sum / count, 0.5 * claimed / count)
}

#[test]
fn corners_of_kalibr_grids_are_near() {
    let (rms, bias, claimed) = figures(&grid(2, 0.3), &Appearance::default());
    println!(
        "Kalibr grid, blur 0.7 px, noise 3: rms {rms:.4} px, bias {:.4} {:.4} px, claims {claimed:.2}",
        bias.x, bias.y
    );
    assert!(rms <= 0.08 && bias.amax() <= 0.02, "{rms} {bias}");
    assert!((0.5..1.6).contains(&claimed), "{claimed}");
}

#[test]
fn corners_of_plain_tags_are_near() {
    let (rms, bias, claimed) = figures(&grid(1, 0.25), &Appearance::default());
    println!(
        "plain tags, blur 0.7 px, noise 3: rms {rms:.4} px, bias {:.4} {:.4} px, claims {claimed:.2}",
        bias.x, bias.y
    );
    assert!(rms <= 0.08 && bias.amax() <= 0.02, "{rms} {bias}");
}

#[test]
fn the_detector_alone_is_farther_off_and_by_no_half_pixel() {
    let (grid, pose) = (grid(1, 0.3), pose([0.4, 0.2, 0.3], 1.2));
    let drawings = tag_drawings(&grid).unwrap();
    let pattern = Pattern::TagGrid(grid);
    let shown = Shown { pattern: &pattern, drawings: &drawings, t_camera_panel: pose };
    let pixels = render(&camera(), &[shown], &Appearance::default(), 1).unwrap();
    let tags = detect_tags(&Gray::new(640, 480, &pixels).unwrap(), Family::Tag36h11, 1).unwrap();
    let (mut sum, mut square) = (Vector2::zeros(), 0.0);
    for tag in &tags {
        for (j, corner) in tag.corners.iter().enumerate() {
            let point = pattern.corner(4 * tag.id + j as u32).unwrap();
            let error = corner - camera().project(&pose.act(&point)).unwrap();
            sum += error / 144.0;
            square += error.norm_squared() / 288.0;
        }
    }
    println!("detector alone: rms {:.4} px, bias {:.4} {:.4} px", square.sqrt(), sum.x, sum.y);
    assert!(tags.len() == 36 && sum.amax() < 0.1 && square.sqrt() < 0.4);
}

#[test]
fn blurred_and_far_panels_are_left_out_and_counted() {
    let blurred = Appearance { blur: 2.7, ..Appearance::default() };
    let trial_blurred = trial(&grid(1, 0.3), &pose([0.1, 0.0, 0.0], 0.75), &blurred, 1);
    let (left, blurred) = (trial_blurred.found.corners.len(), trial_blurred.found.blurred);
    assert!(left == 0 && blurred > 0, "{left} {blurred}");
    let far = trial(&grid(2, 0.3), &pose([0.1, 0.0, 0.0], 7.0), &Appearance { noise: 0.5, ..Appearance::default() }, 1);
    assert!(far.found.corners.is_empty());
    let near = trial(&grid(2, 0.3), &pose([0.0, 0.0, 0.0], 0.55), &Appearance::default(), 1);
    assert!(near.found.corners.len() < 144 && near.errors.iter().all(|e| e.norm() < 0.5));
}

#[test]
fn an_image_of_noise_has_no_tags() {
    let pixels: Vec<u8> = (0..320 * 240u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let image = Gray::new(320, 240, &pixels).unwrap();
    assert!(detect_tags(&image, Family::Tag36h11, 1).unwrap().is_empty());
    assert!(Gray::new(320, 240, &pixels[1..]).is_err() && Gray::new(0, 0, &[]).is_err());
    let tiny = [7u8; 6];
    assert!(detect_tags(&Gray::new(3, 2, &tiny).unwrap(), Family::Tag36h11, 1).unwrap().is_empty());
}

#[test]
fn families_have_names_and_borders() {
    assert_eq!(Family::named("36h11").unwrap(), Family::Tag36h11);
    assert!(Family::named("tag1").unwrap_err().to_string().contains("there are tag16h5, "));
    assert_eq!(Family::Tag36h11.modules(2).unwrap(), 10);
    assert!(Family::TagStandard41h12.modules(2).is_err() && Family::Tag36h11.modules(3).is_err());
    assert_eq!(Family::Tag36h11.drawing(587, 1).unwrap(), None);
}

//! The pose of a panel seen by a known camera.

use crate::scene::Scene;
use groma_calibration::camera::panel_pose;
use groma_geometry::LieGroup;
use groma_models::Lens;
use nalgebra::Vector6;

#[test]
fn is_exact_without_noise() {
    for lens in Lens::ALL {
        let mut scene = Scene::new(lens, 0.0, 1);
        for _ in 0..20 {
            let truth = scene.pose(0.5, 1.5);
            let view = scene.view(0, &truth);
            let found = panel_pose(&scene.camera, &view.corners).unwrap();
            assert!(found.pose.minus(&truth).norm() < 1e-8 && found.decided, "{lens:?}");
        }
    }
}

#[test]
fn its_covariance_holds() {
    let (mut scene, mut sum, runs) = (Scene::new(Lens::Radtan, 0.3, 2), 0.0, 300);
    for _ in 0..runs {
        let truth = scene.pose(0.5, 2.5);
        let view = scene.view(0, &truth);
        let found = panel_pose(&scene.camera, &view.corners).unwrap();
        let xi: Vector6<f64> = truth.minus(&found.pose);
        sum += xi.dot(&found.covariance.cholesky().unwrap().solve(&xi));
    }
    // Corners claim 0.3 px and get 0.1 px on top of it; chi-square 1800 over 300.
    let mean = sum / f64::from(runs);
    assert!((4.8..6.6).contains(&mean), "{mean}");
}

#[test]
fn its_sensitivity_is_that_of_a_changed_camera() {
    let mut scene = Scene::new(Lens::Radtan, 0.0, 3);
    let view = {
        let pose = scene.pose(0.5, 1.5);
        scene.view(0, &pose)
    };
    let found = panel_pose(&scene.camera, &view.corners).unwrap();
    for k in 0..scene.camera.count() {
        let step = if k < 4 { 1e-3 } else { 1e-6 };
        let moved = |by: f64| {
            let mut parameters = scene.camera.parameters().to_vec();
            parameters[k] += by;
            panel_pose(&scene.camera.with_parameters(parameters).unwrap(), &view.corners).unwrap().pose
        };
        let differences: Vector6<f64> =
            (moved(step).minus(&found.pose) - moved(-step).minus(&found.pose)) / (2.0 * step);
        let off = (found.sensitivity.column(k) - differences).norm();
        assert!(off < 1e-5 * (1e-3 + differences.norm()), "{k} {off} {differences}");
    }
}

#[test]
fn a_panel_far_away_and_facing_the_camera_has_two_poses() {
    let mut scene = Scene::new(Lens::Pinhole, 0.3, 4);
    let truth = scene.pose(0.2, 9.0);
    let view = scene.view(0, &truth);
    let found = panel_pose(&scene.camera, &view.corners).unwrap();
    assert!(!found.decided);
    let other = found.other.unwrap().0;
    assert!(found.pose.minus(&truth).norm().min(other.minus(&truth).norm()) < 0.25);
}

#[test]
fn corners_on_a_line_have_no_pose() {
    let mut scene = Scene::new(Lens::Radtan, 0.0, 5);
    let pose = scene.pose(0.5, 1.5);
    let mut view = scene.view(0, &pose);
    view.corners.retain(|corner| corner.point.y == 0.0);
    assert!(view.corners.len() > 4 && panel_pose(&scene.camera, &view.corners).is_none());
    assert!(panel_pose(&scene.camera, &view.corners[..2]).is_none());
}

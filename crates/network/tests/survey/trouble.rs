//! What goes wrong in a survey.

use crate::runs::{map, score, survey, true_settings};
use groma_models::Token;
use groma_network::survey::{Detection, Verdict};
use groma_network::{Options, Survey};
use groma_simulation::network::{Bump, NetworkScene, simulate};

#[test]
fn without_noise_the_map_is_the_truth() {
    let mut scene = NetworkScene::named("loop", 1).unwrap();
    let quiet = 1e-9;
    scene.noise.odometry.along = quiet;
    scene.noise.odometry.across = quiet;
    scene.noise.odometry.heading = quiet;
    scene.noise.odometry.turning = quiet;
    scene.noise.corner = 0.0;
    (scene.noise.floor_height, scene.noise.floor_tilt) = (0.0, 0.0);
    let (_, score) = map(&scene, &Options::default());
    assert!(score.worst.0 < 1e-6 && score.worst.1 < 1e-6, "{score:?}");
}

#[test]
fn a_bumped_camera_raises_an_alarm_and_is_mapped_anew_alone() {
    let mut scene = NetworkScene::named("laps", 3).unwrap();
    let motion = [0.05, 0.0, 0.02, 0.0, 0.05, 0.0];
    scene.bump = Some(Bump { camera: "camera4".into(), stop: 60, motion });
    let recording = simulate(&scene).unwrap();
    let map = survey(&scene, &recording).finish(&true_settings(&scene), &Token::new()).unwrap();
    assert_eq!(map.moved.iter().map(|moved| moved.camera).collect::<Vec<_>>(), [3]);
    assert!(map.slip.is_none());
    let after = score(&map, &recording);
    assert!(after.worst.0 < 0.15 && after.per_dof() < 2.0, "{after:?}");
    assert_eq!(map.cameras.iter().filter(|c| c.camera == 3).count(), 2);
    let others = map.judged.iter().filter(|v| v.camera != 3 && v.verdict == Verdict::Rejected).count();
    assert!(others <= 2, "{others}");
}

#[test]
fn order_and_repetition_of_messages_do_not_matter() {
    let scene = NetworkScene::named("corridor", 5).unwrap();
    let recording = simulate(&scene).unwrap();
    let straight = survey(&scene, &recording);
    let mut shuffled = Survey::new(scene.target.clone(), known(&scene)).unwrap();
    for seen in recording.seen.iter().rev().chain(&recording.seen) {
        let detection = Detection {
            stamp: seen.stamp,
            camera: seen.camera,
            panel: seen.panel,
            stop: None,
            ids: seen.ids.clone(),
            pixels: seen.pixels.clone(),
            sigmas: vec![0.3; seen.ids.len()],
        };
        shuffled.push_detection(detection);
    }
    for (stamp, pose) in recording.odometry.iter().rev() {
        shuffled.push_odometry(*stamp, *pose);
        shuffled.push_odometry(*stamp, *pose);
    }
    let options = true_settings(&scene);
    let (a, b) = (straight.finish(&options, &Token::new()).unwrap(), shuffled.finish(&options, &Token::new()).unwrap());
    assert_eq!(a.joint, b.joint);
    assert_eq!(a.cameras, b.cameras);
}

fn known(scene: &NetworkScene) -> Vec<groma_network::survey::KnownCamera> {
    let zero = |n| nalgebra::DMatrix::zeros(n, n);
    let known = |c: &groma_simulation::network::SceneCamera| groma_network::survey::KnownCamera {
        name: c.name.clone(),
        camera: c.camera.clone(),
        covariance: Some(zero(c.camera.count())),
    };
    scene.cameras.iter().map(known).collect()
}

#[test]
fn nothing_to_map_is_said_in_words() {
    let scene = NetworkScene::named("corridor", 5).unwrap();
    let empty = Survey::new(scene.target.clone(), known(&scene)).unwrap();
    assert!(empty.finish(&Options::default(), &Token::new()).unwrap_err().to_string().contains("odometry"));
    let mut unseen = empty.clone();
    unseen.push_odometry(0.0, groma_geometry::Se2::IDENTITY);
    unseen.push_odometry(1.0, groma_geometry::Se2::IDENTITY);
    assert!(unseen.finish(&Options::default(), &Token::new()).unwrap_err().to_string().contains("no camera saw"));
    let wrong = Options { gate: 1.5, ..Options::default() };
    assert!(unseen.finish(&wrong, &Token::new()).unwrap_err().to_string().starts_with("gate"));
    assert!(!unseen.push_odometry(f64::NAN, groma_geometry::Se2::IDENTITY));
}

#[test]
fn a_survey_that_is_cancelled_has_no_map() {
    let scene = NetworkScene::named("corridor", 1).unwrap();
    let recording = simulate(&scene).unwrap();
    let token = Token::new();
    token.cancel();
    let ended = survey(&scene, &recording).finish(&true_settings(&scene), &token).unwrap_err();
    assert_eq!(ended.to_string(), "interrupted");
}

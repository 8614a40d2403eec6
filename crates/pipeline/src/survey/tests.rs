//! Surveys of simulated networks, message by message.

use super::*;
use groma_geometry::Se2;
use groma_models::finding::{Code, Kind, verdict};
use groma_network::survey::result::errors;
use groma_simulation::network::{Bump, NetworkRecording, NetworkScene, simulate};

fn known(scene: &NetworkScene) -> Vec<KnownCamera> {
    let camera = |placed: &groma_simulation::network::SceneCamera| {
        let n = placed.camera.count();
        let covariance = Some(nalgebra::DMatrix::zeros(n, n));
        KnownCamera { name: placed.name.clone(), camera: placed.camera.clone(), covariance }
    };
    scene.cameras.iter().map(camera).collect()
}

/// The settings that say what is wrong with a scene.
fn settings(scene: &NetworkScene) -> Options {
    let (walk, noise) = (&scene.noise.odometry, &scene.noise);
    let mut options = Options::default();
    (options.odometry.along, options.odometry.across) = (walk.along, walk.across);
    (options.odometry.heading, options.odometry.turning) = (walk.heading, walk.turning);
    (options.floor.height, options.floor.tilt) = (noise.floor_height, noise.floor_tilt);
    (options.mount.position, options.mount.height, options.mount.rotation) = (0.0, 0.0, 0.0);
    (options.view.position, options.view.rotation) = (0.0, 0.0);
    options
}

/// All messages of a recording in order of time; sigmas of corners are those of the scene times `sigma`.
fn messages(scene: &NetworkScene, recording: &NetworkRecording, sigma: f64) -> Vec<Message> {
    let odometry = recording.odometry.iter().map(|&(stamp, pose)| Message::Odometry(Odometry { stamp, pose }));
    let seen = recording.seen.iter().map(|s| {
        let corner = |(id, p): (&u32, &Vector2<f64>)| (*id as usize, p.x, p.y, sigma * scene.noise.corner);
        let corners = s.ids.iter().zip(&s.pixels).map(corner).collect();
        Message::Detections(Detections { stamp: s.stamp, camera: s.camera, panel: s.panel, stop: None, corners })
    });
    let mut all: Vec<Message> = odometry.chain(seen).collect();
    all.sort_by(|a, b| a.stamp().total_cmp(&b.stamp()));
    all
}

fn fed(scene: &NetworkScene, messages: impl IntoIterator<Item = Message>) -> SurveyCameras {
    let mut machine = SurveyCameras::new(scene.target.clone(), known(scene)).unwrap();
    for message in messages {
        machine.push(message);
    }
    machine
}

fn codes(surveyed: &Surveyed) -> Vec<Code> {
    surveyed.findings.iter().map(|f| f.code).collect()
}

/// The simulated scene, surveyed.
fn surveyed(scene: &NetworkScene, sigma: f64) -> (Surveyed, NetworkRecording) {
    let recording = simulate(scene).unwrap();
    let machine = fed(scene, messages(scene, &recording, sigma));
    (machine.finish(&settings(scene), &Token::new()).unwrap(), recording)
}

#[test]
fn a_survey_places_its_cameras_and_has_nothing_to_object() {
    let scene = NetworkScene::named("corridor", 3).unwrap();
    let (result, recording) = surveyed(&scene, 1.0);
    assert_eq!(result.map.cameras.len(), scene.cameras.len());
    for camera in &result.map.cameras {
        let e = errors(&camera.pose, &recording.cameras[camera.camera]);
        assert!(e.fixed_rows::<3>(0).norm() < 5.0 * camera.sigma_position(), "{e}");
    }
    let grave = [Code::SigmaTooSmall, Code::CameraMoved, Code::OdometrySlipped, Code::CameraUnseen, Code::NotConverged];
    assert!(codes(&result).iter().all(|code| !grave.contains(code)), "{:?}", result.findings);
    assert_eq!(verdict(Kind::Network, &codes(&result)), "mapped");
}

#[test]
fn backwards_and_twice_the_messages_make_the_same_map() {
    let scene = NetworkScene::named("corridor", 5).unwrap();
    let recording = simulate(&scene).unwrap();
    let all = messages(&scene, &recording, 1.0);
    let straight = fed(&scene, all.clone()).finish(&settings(&scene), &Token::new()).unwrap();
    let twice = all.iter().rev().chain(&all).cloned();
    let again = fed(&scene, twice).finish(&settings(&scene), &Token::new()).unwrap();
    assert_eq!((straight.map.cameras, straight.map.joint), (again.map.cameras, again.map.joint));
    assert_eq!(straight.findings, again.findings);
}

#[test]
fn stops_are_counted_as_the_robot_makes_them_and_views_by_camera() {
    let scene = NetworkScene::named("corridor", 1).unwrap();
    let mut machine = fed(&scene, []);
    let stand = |machine: &mut SurveyCameras, from: f64, x: f64| {
        for k in 0..30 {
            let stamp = from + 0.05 * f64::from(k);
            machine.push(Message::Odometry(Odometry { stamp, pose: Se2::new(x, 0.0, 0.0) }));
        }
    };
    let look = |stamp: f64, camera: usize, panel: usize, stop: Option<u64>| {
        let corners = vec![(0, 100.0, 100.0, 0.3)];
        Message::Detections(Detections { stamp, camera, panel, stop, corners })
    };
    assert_eq!((machine.state().stop, machine.state().stops), (None, 0));
    stand(&mut machine, 0.0, 0.0);
    assert_eq!((machine.state().stop, machine.state().stops), (Some(0), 1));
    assert!(machine.push(look(1.0, 2, 0, None)) && machine.push(look(1.0, 2, 0, None)), "one image, sent twice");
    assert!(machine.push(look(1.1, 2, 0, None)));
    machine.push(Message::Odometry(Odometry { stamp: 1.6, pose: Se2::new(0.3, 0.0, 0.0) }));
    assert_eq!((machine.state().stop, machine.state().stops), (None, 1));
    stand(&mut machine, 2.0, 1.0);
    machine.push(look(2.9, 2, 0, None));
    machine.push(look(3.0, 0, 0, Some(17)));
    let state = machine.state();
    assert_eq!((state.stop, state.stops), (Some(1), 2));
    assert_eq!(state.views[2], Views { images: 3, stops: 2 });
    assert_eq!((state.views[0], state.views[1]), (Views { images: 1, stops: 1 }, Views::default()));
    machine.push(look(3.1, 2, 0, Some(0)));
    assert_eq!(machine.state().views[2], Views { images: 4, stops: 3 }, "numbers of others are no numbers of ours");
}

/// The sender of the stops decides what is one: here each is two, and the robot does not move from one to the other.
#[test]
fn what_carries_the_number_of_a_stop_belongs_to_it() {
    let scene = NetworkScene { frames: 2, ..NetworkScene::named("corridor", 2).unwrap() };
    let recording = simulate(&scene).unwrap();
    let number = |stamp: f64| {
        let k = recording.stops.iter().position(|stop| (stop.from..=stop.to).contains(&stamp)).unwrap();
        2 * k as u64 + u64::from(stamp > (recording.stops[k].from + recording.stops[k].to) / 2.0)
    };
    let numbered = messages(&scene, &recording, 1.0).into_iter().map(|message| match message {
        Message::Detections(d) => Message::Detections(Detections { stop: Some(number(d.stamp)), ..d }),
        other => other,
    });
    let stops: BTreeSet<_> = recording.seen.iter().map(|seen| number(seen.stamp)).collect();
    let result = fed(&scene, numbered).finish(&settings(&scene), &Token::new()).unwrap();
    assert_eq!(result.map.stamps.len(), stops.len());
}

#[test]
fn messages_that_make_no_sense_are_counted_and_found() {
    let scene = NetworkScene::named("corridor", 2).unwrap();
    let recording = simulate(&scene).unwrap();
    let mut machine = fed(&scene, messages(&scene, &recording, 1.0));
    let bad = |camera: usize, panel: usize, u: f64, sigma: f64| {
        let corners = vec![(0, u, 5.0, sigma)];
        Message::Detections(Detections { stamp: 1.0, camera, panel, stop: None, corners })
    };
    let wrong = [bad(99, 0, 5.0, 0.3), bad(0, 99, 5.0, 0.3), bad(0, 0, f64::NAN, 0.3), bad(0, 0, 5.0, 0.0)];
    assert!(wrong.into_iter().all(|m| !machine.push(m)));
    assert!(!machine.push(Message::Odometry(Odometry { stamp: f64::NAN, pose: Se2::IDENTITY })));
    let (odometry, detections) = (recording.odometry.len(), recording.seen.len());
    assert_eq!(machine.counts(), Counts { odometry, odometry_invalid: 1, detections, detections_invalid: 4 });
    let result = machine.finish(&settings(&scene), &Token::new()).unwrap();
    let found: Vec<f64> =
        result.findings.iter().filter(|f| f.code == Code::ValuesInvalid).map(|f| f.values[0].value).collect();
    assert_eq!(found, [1.0, 4.0]);
}

#[test]
fn sigmas_that_are_three_times_too_small_are_told_with_their_factor() {
    let scene = NetworkScene::named("corridor", 4).unwrap();
    let (result, _) = surveyed(&scene, 1.0 / 3.0);
    let found = result.findings.iter().find(|f| f.code == Code::SigmaTooSmall).unwrap();
    assert!((2.5..3.5).contains(&found.values[0].value), "{found:?}");
}

#[test]
fn a_camera_that_was_hit_is_found_with_how_far_and_where() {
    let mut scene = NetworkScene::named("laps", 3).unwrap();
    let motion = [0.05, 0.0, 0.02, 0.0, 0.05, 0.0];
    scene.bump = Some(Bump { camera: "camera4".into(), stop: 60, motion });
    let (result, recording) = surveyed(&scene, 1.0);
    let moved: Vec<_> = result.findings.iter().filter(|f| f.code == Code::CameraMoved).collect();
    let [only] = moved[..] else { panic!("{:?}", result.findings) };
    assert!(only.text.contains("camera4"));
    assert!((only.values[0].value - 0.054).abs() < 0.08 && (only.values[1].value - 0.05).abs() < 0.02, "{only:?}");
    let (at, truth) = (only.place.unwrap(), recording.cameras[3].translation);
    assert!((at[0] - truth.x).hypot(at[1] - truth.y) < 0.3);
    let (stamp, hit) = (only.span.unwrap().0, &recording.stops[60]);
    assert!(stamp >= hit.from, "{stamp} is before it was hit at {}", hit.from);
    assert_eq!(verdict(Kind::Network, &codes(&result)), "mapped");
}

#[test]
fn an_odometry_that_slipped_makes_a_result_that_must_not_be_relied_on() {
    let scene = NetworkScene::named("laps", 3).unwrap();
    let recording = simulate(&scene).unwrap();
    let slip = recording.stops[45].to + 1e-3;
    let slipped = messages(&scene, &recording, 1.0).into_iter().map(|message| match message {
        Message::Odometry(o) if o.stamp > slip => {
            Message::Odometry(Odometry { pose: Se2::new(3.0, 1.5, 0.3) * o.pose, ..o })
        }
        other => other,
    });
    let result = fed(&scene, slipped).finish(&settings(&scene), &Token::new()).unwrap();
    assert_eq!(verdict(Kind::Network, &codes(&result)), "slipped", "{:?}", result.findings);
    assert!(!codes(&result).contains(&Code::CameraMoved), "the cameras were not moved");
}

#[test]
fn a_camera_that_sees_nothing_is_reported_by_name() {
    let scene = NetworkScene::named("corridor", 6).unwrap();
    let recording = simulate(&scene).unwrap();
    let without =
        messages(&scene, &recording, 1.0).into_iter().filter(|m| !matches!(m, Message::Detections(d) if d.camera == 1));
    let result = fed(&scene, without).finish(&settings(&scene), &Token::new()).unwrap();
    let unseen: Vec<_> = result.findings.iter().filter(|f| f.code == Code::CameraUnseen).collect();
    assert_eq!(unseen.len(), 1);
    assert!(unseen[0].text.starts_with(&scene.cameras[1].name));
}

#[test]
fn a_batch_that_was_cut_short_is_an_error_and_none_that_was_requested_is_not() {
    let scene = NetworkScene::named("loop", 2).unwrap();
    let recording = simulate(&scene).unwrap();
    let machine = fed(&scene, messages(&scene, &recording, 1.0));
    let cut = |steps| {
        let options = Options { batch_steps: steps, ..settings(&scene) };
        codes(&machine.finish(&options, &Token::new()).unwrap())
    };
    assert_eq!(verdict(Kind::Network, &cut(1)), "not-converged");
    assert_eq!(verdict(Kind::Network, &cut(0)), "mapped");
}

#[test]
fn clocks_in_other_units_and_cancelling_leave_no_map() {
    let scene = NetworkScene::named("corridor", 7).unwrap();
    let recording = simulate(&scene).unwrap();
    let all = messages(&scene, &recording, 1.0);
    let milliseconds = all.iter().cloned().map(|m| match m {
        Message::Detections(d) => Message::Detections(Detections { stamp: 1e6 + 1000.0 * d.stamp, ..d }),
        other => other,
    });
    let told = fed(&scene, milliseconds).finish(&settings(&scene), &Token::new()).unwrap_err().to_string();
    assert!(told.contains("clocks"), "{told}");
    let token = Token::new();
    token.cancel();
    assert!(matches!(fed(&scene, all).finish(&settings(&scene), &token), Err(Error::Cancelled(_))));
}

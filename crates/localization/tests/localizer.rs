//! The localizer as its users meet it: exact without noise, firm against bad input, found again after it was lost.

mod drive;

use drive::{Draw, Hall, Wheels, nees, step};
use groma_geometry::Se2;
use groma_localization::{
    DRIVE, Error, Localizer, Mode, Motion, Observation, Options, RelocalizeOptions, Relocalizer, Start, Status,
};
use groma_models::{Landmark, LandmarkKind, LandmarkMap};
use nalgebra::{Matrix2, Matrix3, SMatrix, Vector2, Vector3};

const MOUNT: Se2 = Se2 { rotation: groma_geometry::So2::IDENTITY, translation: Vector2::new(0.4, -0.1) };

fn at_rest(pose: Option<(Se2, Matrix3<f64>)>) -> Start {
    Start { stamp: 0.0, pose, mount: MOUNT, calibration: None }
}

fn prior(sigma: f64) -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::repeat(sigma * sigma))
}

fn motion(path: f64, turn: f64) -> Motion {
    let covariance = Matrix3::from_diagonal(&Vector3::new(1e-4, 2.5e-5, 2.5e-5)) * path.abs();
    Motion { motion: Se2::exp(Vector3::new(path, 0.0, turn)), covariance, by_drive: SMatrix::zeros() }
}

/// Without any noise of the sensors.
fn exact(hall: &mut Hall) -> LandmarkMap {
    (hall.clutter, hall.detected) = (0, 1.0);
    let all = |_| true;
    let sigma = std::mem::replace(&mut hall.sigma_map, 0.0);
    let mut map = hall.survey(&mut Draw::new(0), all);
    hall.sigma_map = sigma;
    map.landmarks.iter_mut().for_each(|l| l.covariance = Matrix2::identity() * sigma * sigma);
    map
}

fn noise_free(hall: &Hall, laser: &Se2, stamp: f64) -> Vec<Observation> {
    let silent = Hall { sigma_range: 0.0, sigma_bearing: 0.0, places: hall.places.clone(), ..*hall };
    let seen = silent.look(laser, stamp, &mut Draw::new(1));
    seen.into_iter().map(|(_, o)| Observation { covariance: hall.noise(), ..o }).collect()
}

#[test]
fn without_noise_a_wrong_start_is_corrected_to_rounding() {
    let mut hall = Hall::new(3, 60, 0, 25.0, 1.2);
    let map = exact(&mut hall);
    for mode in [Mode::Static, Mode::Mixed] {
        let mut truth = Se2::new(12.0, 9.0, 0.4);
        let start = truth * Se2::new(0.08, -0.05, 0.02);
        let options = Options { mode, ..Options::default() };
        let mut localizer = Localizer::new(map.clone(), &at_rest(Some((start, prior(0.1)))), options).unwrap();
        for k in 1..400 {
            let (path, turn) = step(k, 20.0, 1.0);
            truth = truth * Se2::exp(Vector3::new(path, 0.0, turn));
            localizer.predict(k as f64 / 20.0, &motion(path, turn)).unwrap();
            let update = localizer.update(&noise_free(&hall, &(truth * MOUNT), k as f64 / 20.0), None);
            assert_eq!(update.quality.status, Status::Tracking);
        }
        assert!(truth.minus(&localizer.pose()).norm() < 2e-5, "{:?}", truth.minus(&localizer.pose()));
    }
}

#[test]
fn each_beam_is_taken_from_where_it_was_fired() {
    let mut hall = Hall::new(3, 60, 0, 25.0, 1.2);
    let map = exact(&mut hall);
    let mut truth = Se2::new(12.0, 9.0, 0.4);
    let mut localizer = Localizer::new(map, &at_rest(Some((truth, prior(0.01)))), Options::default()).unwrap();
    let xi = Vector3::new(0.1, 0.0, 0.05);
    for k in 1..100 {
        truth = truth * Se2::exp(xi);
        localizer.predict(f64::from(k) * 0.1, &Motion { motion: Se2::exp(xi), ..motion(0.1, 0.05) }).unwrap();
        // A turn of the scanner takes the whole step: the first beam is fired at its beginning.
        let mut scan = Vec::new();
        for (n, o) in noise_free(&hall, &(truth * MOUNT), 0.0).into_iter().enumerate() {
            let share = (n % 10) as f64 / 10.0;
            let then = truth * Se2::exp(xi * (share - 1.0));
            let laser = truth * MOUNT;
            let place = laser.act(Vector2::new(o.polar.y.cos(), o.polar.y.sin()) * o.polar.x);
            let q = (then * MOUNT).inverse().act(place);
            let stamp = (f64::from(k) - 1.0 + share) * 0.1;
            scan.push(Observation { stamp, polar: Vector2::new(q.norm(), q.y.atan2(q.x)), ..o });
        }
        localizer.update(&scan, None);
    }
    assert!(truth.minus(&localizer.pose()).norm() < 1e-9, "{:?}", truth.minus(&localizer.pose()));
}

#[test]
fn bad_input_changes_nothing_and_says_why() {
    let mut hall = Hall::new(3, 30, 0, 20.0, 1.0);
    let map = exact(&mut hall);
    let truth = Se2::new(10.0, 9.0, 0.4);
    let mut localizer = Localizer::new(map, &at_rest(Some((truth, prior(0.01)))), Options::default()).unwrap();
    localizer.predict(1.0, &motion(0.0, 0.0)).unwrap();
    let (pose, covariance) = (localizer.pose(), localizer.covariance());
    let nan = Motion { motion: Se2::new(f64::NAN, 0.0, 0.0), ..motion(0.1, 0.0) };
    let negative = Motion { covariance: -Matrix3::identity(), ..motion(0.1, 0.0) };
    let skew = Motion { covariance: Matrix3::new(1.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), ..motion(0.1, 0.0) };
    let drive = Motion { by_drive: SMatrix::<f64, 3, DRIVE>::repeat(f64::INFINITY), ..motion(0.1, 0.0) };
    for bad in [nan, negative, skew, drive] {
        assert_eq!(localizer.predict(2.0, &bad), Err(Error::Unusable { what: "the motion" }));
    }
    assert_eq!(localizer.predict(0.5, &motion(0.1, 0.0)), Err(Error::TimeGoesBack { stamp: 0.5, before: 1.0 }));
    assert!(localizer.predict(f64::NAN, &motion(0.1, 0.0)).is_err());
    let good = noise_free(&hall, &(truth * MOUNT), 1.0)[0];
    let bad = [
        Observation { polar: Vector2::new(f64::NAN, 0.0), ..good },
        Observation { polar: Vector2::new(0.0, 0.0), ..good },
        Observation { polar: Vector2::new(1e9, 0.0), ..good },
        Observation { covariance: Matrix2::zeros(), ..good },
        Observation { identity: Some(usize::MAX), ..good },
    ];
    let update = localizer.update(&bad, None);
    assert_eq!((update.unusable, update.matches.len()), (4, 0));
    assert_eq!((localizer.pose(), localizer.covariance()), (pose, covariance));
    assert_eq!(localizer.update(&[], None).matches, []);
}

#[test]
fn a_match_names_its_observation_though_others_before_it_cannot_be_used() {
    let mut hall = Hall::new(3, 30, 0, 20.0, 1.0);
    let map = exact(&mut hall);
    let truth = Se2::new(10.0, 9.0, 0.4);
    let seen = noise_free(&hall, &(truth * MOUNT), 0.0);
    let matches = |observations: &[Observation]| {
        let start = at_rest(Some((truth, prior(0.01))));
        let mut localizer = Localizer::new(map.clone(), &start, Options::default()).unwrap();
        localizer.update(observations, None).matches.iter().map(|m| (m.observation, m.landmark)).collect::<Vec<_>>()
    };
    let bad = Observation { covariance: Matrix2::zeros(), ..seen[0] };
    let shifted: Vec<_> =
        matches(&seen).into_iter().map(|(observation, landmark)| (observation + 1, landmark)).collect();
    assert!(shifted.len() > 3);
    assert_eq!(matches(&[&[bad], &seen[..]].concat()), shifted);
}

#[test]
fn what_cannot_be_used_is_refused_at_the_start() {
    let landmark = Landmark {
        kind: LandmarkKind::Corner,
        position: Vector2::new(1.0, 2.0),
        covariance: Matrix2::identity() * 1e-4,
        orientation: None,
        descriptor: None,
        seen: 1,
        visible: 1,
    };
    let with = |landmark: Landmark| LandmarkMap { landmarks: vec![landmark] };
    let start = at_rest(None);
    let bad_maps = [
        Landmark { position: Vector2::new(f64::NAN, 0.0), ..landmark.clone() },
        Landmark { covariance: Matrix2::zeros(), ..landmark.clone() },
        Landmark { covariance: Matrix2::new(1.0, 2.0, 2.0, 1.0), ..landmark.clone() },
    ];
    for bad in bad_maps {
        assert!(matches!(Localizer::new(with(bad), &start, Options::default()), Err(Error::Map(_))));
    }
    let bad_starts = [
        Start { stamp: f64::NAN, ..start.clone() },
        Start { mount: Se2::new(f64::INFINITY, 0.0, 0.0), ..start.clone() },
        Start { pose: Some((Se2::IDENTITY, prior(f64::NAN))), ..start.clone() },
        Start { calibration: Some(-SMatrix::identity()), ..start.clone() },
    ];
    for bad in bad_starts {
        assert!(Localizer::new(with(landmark.clone()), &bad, Options::default()).is_err());
    }
    let options = Options { gate: 1.0, ..Options::default() };
    assert!(matches!(Localizer::new(with(landmark), &start, options), Err(Error::Option(_))));
}

#[test]
fn a_map_without_landmarks_and_landmarks_on_one_spot_are_lived_with() {
    let empty = Localizer::new(LandmarkMap::default(), &at_rest(Some((Se2::IDENTITY, prior(0.1)))), Options::default());
    let mut localizer = empty.unwrap();
    let o = Observation::at_point(0.0, Vector2::new(2.0, 0.0), Matrix2::identity() * 1e-4);
    for k in 1..50 {
        localizer.predict(f64::from(k), &motion(0.1, 0.0)).unwrap();
        assert_eq!(localizer.update(&[o, o, o], None).quality.status, Status::Coasting);
    }
    let place = Landmark {
        kind: LandmarkKind::Corner,
        position: Vector2::new(3.0, 0.0),
        covariance: Matrix2::identity() * 1e-4,
        orientation: None,
        descriptor: None,
        seen: 1,
        visible: 1,
    };
    let heap = LandmarkMap { landmarks: vec![place; 40] };
    let mut localizer = Localizer::new(heap, &at_rest(Some((Se2::IDENTITY, prior(0.1)))), Options::default()).unwrap();
    let update = localizer.update(&[o; 20], None);
    assert!(update.quality.nis.is_finite() && localizer.covariance().iter().all(|v| v.is_finite()));
}

#[test]
fn a_kidnapped_vehicle_says_that_it_is_lost_and_finds_itself() {
    let hall = Hall::new(5, 90, 10, 35.0, 0.9);
    let mut draw = Draw::new(2);
    let map = hall.survey(&mut draw, |_| true);
    let relocalizer = Relocalizer::new(map.clone(), None, RelocalizeOptions::default()).unwrap();
    let mut truth = Se2::new(14.0, 8.0, 0.3);
    let start = at_rest(Some((truth, prior(0.01))));
    let mut localizer = Localizer::new(map, &start, Options::default()).unwrap().with_relocalizer(relocalizer.into());
    let wheels = Wheels::good();
    let (mut lost, mut found) = (None, None);
    for k in 1..1200 {
        let (path, turn) = step(k, 20.0, 1.0);
        if k == 400 {
            truth = Se2::new(22.0, 20.0, -2.0);
        }
        let said = wheels.say(path, turn, &mut draw);
        truth = truth * Se2::exp(Vector3::new(path, 0.0, turn));
        localizer.predict(k as f64 / 20.0, &said).unwrap();
        let seen: Vec<_> = hall.look(&(truth * MOUNT), k as f64 / 20.0, &mut draw).into_iter().map(|s| s.1).collect();
        let update = localizer.update(&seen, None);
        let is_lost = update.quality.status == Status::Lost;
        assert!(!is_lost || k >= 400, "lost at {k} without a reason");
        if is_lost && lost.is_none() {
            lost = Some(k);
        }
        if update.relocated.is_some() {
            found = Some(k);
        }
    }
    let (lost, found) = (lost.unwrap(), found.unwrap());
    assert!(lost < 440 && found < 480, "lost at {lost}, found at {found}");
    assert!(nees(&truth, &localizer.pose(), &localizer.covariance()) < 20.0);
    assert_eq!(localizer.quality().status, Status::Tracking);
}

#[test]
fn an_unknown_start_is_found_or_left_open_but_never_wrong() {
    let hall = Hall::new(8, 90, 10, 35.0, 0.9);
    let mut draw = Draw::new(3);
    let map = hall.survey(&mut draw, |_| true);
    let relocalizer = Relocalizer::new(map, None, RelocalizeOptions::default()).unwrap();
    let (mut right, places) = (0, 20);
    for _ in 0..places {
        let truth = Se2::new(draw.uniform(3.0, 32.0), draw.uniform(3.0, 32.0), draw.uniform(-3.1, 3.1));
        let seen = hall.look(&(truth * MOUNT), 0.0, &mut draw);
        let mut view = groma_localization::LocalView::default();
        let seen: Vec<_> = seen.into_iter().map(|(_, o)| (o, MOUNT)).collect();
        view.see(&seen);
        let Some(found) = relocalizer.certain(&view) else { continue };
        let error = truth.minus(&found.pose);
        assert!(error.xy().norm() < 0.3 && error.z.abs() < 0.1, "wrong and certain: {found:?}, {truth:?}");
        assert!(nees(&truth, &found.pose, &found.covariance) < 25.0);
        right += 1;
    }
    assert!(right >= places * 95 / 100, "{right} of {places}");
}

#[test]
fn a_scene_that_repeats_is_not_certain() {
    // Two halls alike, forty metres apart.
    let one = Hall::new(8, 40, 0, 20.0, 1.0);
    let twin = one.places.iter().map(|(kind, p)| (*kind, p + Vector2::new(40.0, 0.0)));
    let both = Hall { places: one.places.iter().copied().chain(twin).collect(), ..Hall::new(1, 0, 0, 1.0, 1.0) };
    let mut draw = Draw::new(3);
    let relocalizer = Relocalizer::new(both.survey(&mut draw, |_| true), None, RelocalizeOptions::default()).unwrap();
    for _ in 0..20 {
        let truth = Se2::new(draw.uniform(4.0, 16.0), draw.uniform(4.0, 16.0), draw.uniform(-3.1, 3.1));
        let mut view = groma_localization::LocalView::default();
        let seen: Vec<_> = both.look(&(truth * MOUNT), 0.0, &mut draw).into_iter().map(|(_, o)| (o, MOUNT)).collect();
        view.see(&seen);
        let found = relocalizer.locate(&view);
        assert!(found[0].probability < 0.99, "{found:?}");
    }
}

#[test]
#[ignore = "a day takes minutes"]
#[allow(clippy::print_stdout)] // the figures
fn a_day_at_20_hz_neither_loses_the_vehicle_nor_grows() {
    let hall = Hall::new(1, 60, 10, 30.0, 0.8);
    let mut draw = Draw::new(4);
    let map = hall.survey(&mut draw, |kind| kind == LandmarkKind::Reflector);
    let mut truth = Se2::new(14.0, 8.0, 0.3);
    let options = Options { mode: Mode::Mixed, ..Options::default() };
    let mut localizer = Localizer::new(map, &at_rest(Some((truth, prior(0.01)))), options).unwrap();
    let (mut worst, mut most): (f64, usize) = (0.0, 0);
    let mut rows = 0;
    for k in 1..=24 * 3600 * 20 {
        let (path, turn) = step(k, 20.0, 1.0);
        let said = Wheels::good().say(path, turn, &mut draw);
        truth = truth * Se2::exp(Vector3::new(path, 0.0, turn));
        let stamp = k as f64 / 20.0;
        localizer.predict(stamp, &said).unwrap();
        let seen: Vec<_> = hall.look(&(truth * MOUNT), stamp, &mut draw).into_iter().map(|s| s.1).collect();
        let quality = localizer.update(&seen, Some(&|polar| polar.x < hall.reach)).quality;
        assert_ne!(quality.status, Status::Lost, "after {stamp} s");
        worst = worst.max((truth.translation - localizer.pose().translation).norm());
        let found = localizer.found();
        most = most.max(found.proven + found.on_trial);
        rows = rows.max(localizer.joint().points().len());
    }
    println!("worst error {worst:.3} m, most landmarks found during the drive {most}, most in memory {rows}");
    assert!(worst < 0.2 && most <= 100 && rows <= 250);
}

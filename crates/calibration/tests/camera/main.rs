//! Intrinsics from simulated views: exact without noise, honest with it, refused when the views do not tell them.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // helpers of tests, and figures for BENCHMARKS.md

mod pose;
mod scene;

use groma_calibration::camera::{CameraCalibration, Options, Refusal, View, calibrate};
use groma_geometry::Se3;
use groma_models::{Camera, Lens, Token};
use nalgebra::DVector;
use scene::Scene;

fn options(lens: Lens) -> Options {
    Options { lens, ..Options::default() }
}

fn quick(lens: Lens, views: &[View]) -> Result<CameraCalibration, Refusal> {
    calibrate(640, 480, views, &Options { splits: 0, ..options(lens) }, &Token::new())
}

fn error(found: &Camera, truth: &Camera) -> DVector<f64> {
    DVector::from_column_slice(found.parameters()) - DVector::from_column_slice(truth.parameters())
}

/// `e^T C^-1 e / n`.
fn nees(found: &CameraCalibration, truth: &Camera) -> f64 {
    let e = error(&found.camera, truth);
    e.dot(&found.covariance.clone().cholesky().unwrap().solve(&e)) / e.len() as f64
}

#[test]
fn without_noise_every_lens_is_found_exactly() {
    for lens in Lens::ALL {
        let mut scene = Scene::new(lens, 0.0, 3);
        let views = scene.views(15, 0.6, if lens == Lens::Rational { 0.6 } else { 1.1 });
        let found = quick(lens, &views).unwrap();
        let off = error(&found.camera, &scene.camera);
        assert!(off.rows(0, 4).amax() < 1e-6 && off.amax() < 1e-6, "{lens:?} {off}");
        assert!(found.rms < 1e-8 && found.views.iter().flatten().all(|v| v.decided));
    }
}

fn mean_nees(lens: Lens, runs: u64, views: usize, tilt: f64, range: f64) -> f64 {
    let one = |seed| {
        let mut scene = Scene::new(lens, 0.3, 100 + seed);
        let views = scene.views(views, tilt, range);
        nees(&quick(lens, &views).unwrap(), &scene.camera)
    };
    (0..runs).map(one).sum::<f64>() / runs as f64
}

#[test]
fn the_covariance_holds() {
    // 12 runs of 8 parameters: a mean of chi-square 96 over 96, 0.72 .. 1.31 in 98 of 100.
    let mean = mean_nees(Lens::Radtan, 12, 20, 0.6, 1.2);
    assert!((0.72..1.31).contains(&mean), "{mean}");
}

/// Prints the figures of docs/theory and BENCHMARKS.
#[test]
#[ignore = "minutes"]
fn the_covariance_holds_over_many_configurations() {
    for (lens, views, tilt, range) in [
        (Lens::Pinhole, 20, 0.6, 1.2),
        (Lens::Radtan, 20, 0.6, 1.2),
        (Lens::Radtan, 8, 0.6, 1.2),
        (Lens::Radtan, 20, 0.35, 1.2),
        (Lens::Radtan, 20, 0.8, 2.0),
        (Lens::PlumbBob, 20, 0.6, 1.2),
        (Lens::Equidistant, 20, 0.6, 0.8),
    ] {
        let mean = mean_nees(lens, 60, views, tilt, range);
        println!("{lens:?} {views} views {tilt} rad {range} m: NEES/n {mean:.3}");
        assert!((0.8..1.2).contains(&mean));
    }
}

/// A quotient of polynomials is told so weakly that a covariance of first order is too small: NEES/n 1.58. To be turned round when
/// it is corrected. Farther away some runs are refused.
#[test]
#[ignore = "minutes"]
#[should_panic(expected = "too small for the rational lens")]
fn the_covariance_of_the_rational_lens_is_too_small() {
    let mean = mean_nees(Lens::Rational, 60, 30, 0.6, 0.6);
    println!("Rational 30 views 0.6 rad 0.6 m: NEES/n {mean:.3}");
    assert!((0.8..1.2).contains(&mean), "too small for the rational lens: {mean}");
}

#[test]
fn a_panel_that_never_turns_is_refused_with_the_reason() {
    let mut scene = Scene::new(Lens::Radtan, 0.3, 5);
    let start = scene.pose(0.5, 2.0);
    let across =
        |k: usize| Scene::moved(&Se3 { ..start }, [0.05 * k as f64 - 0.4, 0.03 * k as f64, 0.0, 0.0, 0.0, 0.0]);
    let views: Vec<_> = (0..12).map(|k| scene.view(k, &across(k))).collect();
    let refusal = quick(Lens::Radtan, &views).unwrap_err().to_string();
    println!("{refusal}");
    assert!(refusal.contains("faces the same way") || refusal.contains("uncertain by"), "{refusal}");
}

#[test]
fn a_panel_that_never_moves_is_refused_with_the_reason() {
    let mut scene = Scene::new(Lens::Radtan, 0.3, 6);
    let pose = scene.pose(0.5, 2.0);
    let views: Vec<_> = (0..12).map(|k| scene.view(k, &pose)).collect();
    let refusal = quick(Lens::Radtan, &views).unwrap_err().to_string();
    assert!(refusal.contains("faces the same way"), "{refusal}");
}

#[test]
fn too_few_views_are_refused() {
    let mut scene = Scene::new(Lens::Radtan, 0.3, 6);
    let views = scene.views(2, 0.5, 1.2);
    let refusal = quick(Lens::Radtan, &views).unwrap_err();
    assert_eq!(refusal, Refusal::TooFewViews { views: 2, needed: 3 });
    assert!(refusal.to_string().starts_with("2 usable views of a panel: at least 3"));
    assert_eq!(quick(Lens::Radtan, &[]).unwrap_err(), Refusal::TooFewViews { views: 0, needed: 3 });
}

#[test]
fn corners_that_are_elsewhere_are_left_out() {
    let mut scene = Scene::new(Lens::Radtan, 0.2, 7);
    let mut views = scene.views(15, 0.6, 1.2);
    for (k, view) in views.iter_mut().enumerate() {
        let count = view.corners.len();
        view.corners[(7 * k) % count].pixel.x += 15.0;
        view.corners[(11 * k + 3) % count].pixel.y -= 40.0;
    }
    let found = quick(Lens::Radtan, &views).unwrap();
    let out: usize = found.views.iter().flatten().map(|v| v.used.iter().filter(|u| !**u).count()).sum();
    assert!((29..45).contains(&out), "{out}");
    assert!(nees(&found, &scene.camera) < 2.5);
}

#[test]
fn halves_agree_when_the_model_is_right() {
    let mut scene = Scene::new(Lens::Radtan, 0.3, 8);
    let views = scene.views(24, 0.6, 1.2);
    let found = calibrate(640, 480, &views, &options(Lens::Radtan), &Token::new()).unwrap();
    let factor = found.honesty.factor.unwrap();
    assert!(found.honesty.splits == 20 && (0.5..1.5).contains(&factor), "{:?}", found.honesty);
}

#[test]
fn halves_disagree_when_the_lens_bends_otherwise() {
    let mut scene = Scene::new(Lens::Equidistant, 0.05, 8);
    let views = scene.views(24, 0.6, 0.8);
    let wrong = calibrate(640, 480, &views, &options(Lens::Radtan), &Token::new());
    let factor = wrong.unwrap().honesty.factor.unwrap();
    assert!(factor > 2.0, "{factor}");
}

#[test]
fn a_lens_that_cannot_bend_as_the_images_do_is_refused_where_the_refinement_creeps_on() {
    let refused = |seed| {
        let mut scene = Scene::new(Lens::Equidistant, 0.05, seed);
        let views = scene.views(10, 0.6, 0.8);
        matches!(quick(Lens::PlumbBob, &views), Err(Refusal::NotSettled { .. }))
    };
    assert!([902, 905].into_iter().any(refused));
}

#[test]
fn of_many_views_those_that_tell_most_are_taken() {
    let mut scene = Scene::new(Lens::Radtan, 0.3, 9);
    let views = scene.views(40, 0.5, 1.5);
    let few = Options { splits: 0, most_views: 15, ..options(Lens::Radtan) };
    let found = calibrate(640, 480, &views, &few, &Token::new()).unwrap();
    let taken = found.views.iter().flatten().filter(|v| v.taken).count();
    assert_eq!((taken, found.views.iter().flatten().count()), (15, 40));
    let first =
        calibrate(640, 480, &views[..15], &Options { splits: 0, ..options(Lens::Radtan) }, &Token::new()).unwrap();
    assert!(found.covariance.determinant() < first.covariance.determinant());
}

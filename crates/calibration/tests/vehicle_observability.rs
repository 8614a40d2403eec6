//! The table of degenerate drives: rank of every cell, and the names of what is left open.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{Arc, Noise, arc, exact, stop_and_go, straight, tricycle};
use groma_calibration::vehicle::{Calibration, Model, Options, Request, calibrate};
use groma_models::Token;

fn calibrated(asymmetric: bool, free: &[&str], arcs: &[Arc]) -> Calibration {
    let vehicle = tricycle(asymmetric);
    let (log, spans) = stop_and_go(&vehicle, arcs);
    let motions = drives::with_covariance(exact(&vehicle, &log, &spans), Noise::default_of_notes().covariance());
    let model = if asymmetric { Model::TricycleAsymmetric } else { Model::Tricycle };
    let request = Request { model: Some(model), wheelbase: Some(drives::WHEELBASE), free, ..Request::default() };
    let options = Options { robust: false, noise_known: true, folds: 0, ..Options::default() };
    calibrate(&log, &motions, &request, &options, &Token::new()).unwrap()
}

fn rank(found: &Calibration) -> usize {
    found.layout.len() - found.weak.len()
}

/// Every arc three times, so that there are motions enough to calibrate at all.
fn thrice(arcs: &[Arc]) -> Vec<Arc> {
    (0..3).flat_map(|_| arcs.to_vec()).collect()
}

#[test]
fn ranks_are_those_of_the_table() {
    let (f, b) = (true, false);
    let beta = 120.0;
    let same_both_ways = [arc(30.0, f, beta), arc(30.0, b, beta)];
    // Straight drives make one twist forward and one backward, however often: three numbers a steering offset, whether
    // the wheelbase is known or not.
    let rows: [(&str, Vec<Arc>, [usize; 4]); 9] = [
        ("one arc", vec![arc(30.0, f, beta)], [3, 3, 3, 3]),
        ("same steering F and B", same_both_ways.to_vec(), [3, 3, 4, 4]),
        ("straight F and B", vec![straight(5.0), straight(-5.0)], [3, 3, 4, 4]),
        ("+30 F, -30 F", vec![arc(30.0, f, beta), arc(-30.0, f, beta)], [5, 6, 5, 6]),
        ("+30 F, +45 F", vec![arc(30.0, f, beta), arc(45.0, f, beta)], [5, 6, 5, 6]),
        ("+30 F, straight F", vec![arc(30.0, f, beta), straight(5.0)], [5, 6, 5, 6]),
        ("+30 F, -30 B", vec![arc(30.0, f, beta), arc(-30.0, b, beta)], [5, 6, 6, 6]),
        ("+30 F, -30 F, +30 B", vec![arc(30.0, f, beta), arc(-30.0, f, beta), arc(30.0, b, beta)], [5, 6, 6, 7]),
        (
            "+-30 F and B",
            [30.0, -30.0].iter().flat_map(|&a| [arc(a, f, beta), arc(a, b, beta)]).collect(),
            [5, 6, 6, 7],
        ),
    ];
    for (name, arcs, expected) in rows {
        let columns = [(false, &[][..]), (false, &["wheelbase"]), (true, &[]), (true, &["wheelbase"])];
        let got = columns.map(|(asymmetric, free)| rank(&calibrated(asymmetric, free, &thrice(&arcs))));
        assert_eq!(got, expected, "{name}");
    }
}

/// Sets of names: every weak direction has the parts of one of them.
fn names(found: &Calibration) -> Vec<Vec<&'static str>> {
    let all = found.layout.names();
    let parts = |w: &groma_calibration::vehicle::observability::Weak| {
        let largest = w.direction.amax();
        (0..all.len()).filter(|&k| w.direction[k].abs() > 0.05 * largest).map(|k| all[k]).collect()
    };
    found.weak.iter().map(parts).collect()
}

/// An arc that turns the vehicle by exactly one turn.
fn circle(degrees: f64) -> Arc {
    let steering: f64 = f64::to_radians(degrees);
    let path = drives::WHEELBASE * std::f64::consts::TAU / (steering + drives::cdeg(-75.93)).sin().abs();
    Arc { steering, path }
}

#[test]
fn weak_directions_are_named() {
    let straight_only = calibrated(false, &[], &thrice(&[straight(5.0), straight(-5.0)]));
    assert!(names(&straight_only).iter().flatten().all(|n| n.starts_with("laser_")), "{:?}", straight_only.weak);
    assert!(straight_only.weak.iter().all(|w| w.words.ends_with("drive arcs, to the left and to the right")));

    let whole = calibrated(false, &[], &thrice(&[circle(30.0), circle(-30.0), circle(45.0)]));
    // After a whole turn the laser is where it was, wherever it sits and looks.
    assert_eq!(names(&whole).len(), 3, "{:?}", whole.weak);
    assert!(names(&whole).iter().flatten().all(|n| n.starts_with("laser_")), "{:?}", whole.weak);
    assert!(whole.weak.iter().all(|w| w.words.contains("whole circle")));

    let forward = calibrated(true, &[], &thrice(&[arc(30.0, true, 120.0), arc(-30.0, true, 120.0)]));
    assert_eq!(names(&forward), [["steering_offset_backward"]]);
    assert!(forward.weak[0].words.contains("drive arcs backward"), "{}", forward.weak[0].words);

    let one_angle = calibrated(false, &[], &thrice(&[arc(30.0, true, 120.0)]));
    let named: Vec<_> = names(&one_angle).concat();
    assert!(["steering_offset", "drive_scale", "laser_x", "laser_yaw"].iter().all(|n| named.contains(n)), "{named:?}");
    assert!(one_angle.weak[0].words.contains("another steering angle"));
}

/// Stop-and-go arcs do not determine a delay: a set too many is told as such.
#[test]
fn a_delay_is_not_seen_between_stops() {
    let found = calibrated(false, &["delay"], &drives::grid(2, 20.0, 40.0, 120.0));
    assert_eq!(names(&found), [["delay"]]);
    assert!(found.weak[0].words.contains("without stops"), "{}", found.weak[0].words);
}

/// The gain needs a second angle where the wheelbase is known, a third where it is free.
#[test]
fn the_gain_needs_two_angles_and_a_third_with_the_wheelbase() {
    let two = thrice(&[arc(30.0, true, 120.0), arc(-30.0, true, 120.0)]);
    let three = [two.clone(), thrice(&[arc(45.0, true, 120.0)])].concat();
    assert_eq!(rank(&calibrated(false, &["gain"], &two)), 6);
    assert_eq!(rank(&calibrated(false, &["gain", "wheelbase"], &two)), 6);
    assert_eq!(rank(&calibrated(false, &["gain", "wheelbase"], &three)), 7);
}

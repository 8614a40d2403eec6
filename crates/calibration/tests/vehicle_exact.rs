//! Without noise every model and every set of free parameters comes back to rounding.

#![allow(clippy::expect_used, clippy::panic, clippy::print_stdout, clippy::unwrap_used)]

mod drives;

use drives::{arc, differential, driving_on, exact, grid, stop_and_go, straight, tricycle, windows};
use groma_calibration::vehicle::{Model, Motions, Options, Request, Vehicle, calibrate};
use groma_models::{Drive, Token, Tricycle};

const TRICYCLE_SETS: [&[&str]; 4] = [&[], &["wheelbase"], &["gain"], &["wheelbase", "gain"]];

fn is_recovered(vehicle: &Vehicle, log: &groma_models::WheelLog, motions: &Motions, model: Model, free: &[&str]) {
    for robust in [false, true] {
        let options = Options { robust, ..Options::default() };
        let request = Request { model: Some(model), wheelbase: Some(drives::WHEELBASE), free, ..Request::default() };
        let known = if free.contains(&"delay") { request } else { Request { delay: vehicle.delay, ..request } };
        let found = calibrate(log, motions, &known, &options, &Token::new()).unwrap();
        let (got, truth) = (found.vehicle.to_full(), vehicle.to_full());
        for k in 0..got.len() {
            let scale = truth[k].abs().max(0.01);
            let error = (got[k] - truth[k]).abs() / scale;
            assert!(error < 1e-9, "{} {free:?} robust {robust}, number {k}: {} {}", model.name(), got[k], truth[k]);
        }
        assert!(found.weak.is_empty(), "{:?}", found.weak);
        assert!(found.held_out.is_none_or(|h| h.position_median < 1e-9));
    }
}

#[test]
fn stop_and_go_arcs_give_the_tricycle_back() {
    let mut arcs = grid(3, 18.0, 50.0, 180.0);
    arcs.push(straight(2.0));
    for asymmetric in [false, true] {
        for gain in [1.0, 0.56, -1.03] {
            let mut vehicle = tricycle(asymmetric);
            let Drive::Tricycle(t) = vehicle.drive else { return };
            vehicle.drive = Drive::Tricycle(Tricycle { gain, ..t });
            let (log, spans) = stop_and_go(&vehicle, &arcs);
            let motions = drives::without_covariance(exact(&vehicle, &log, &spans));
            let model = if asymmetric { Model::TricycleAsymmetric } else { Model::Tricycle };
            let sets = TRICYCLE_SETS.iter().filter(|free| gain == 1.0 || free.contains(&"gain"));
            for free in sets {
                is_recovered(&vehicle, &log, &motions, model, free);
            }
        }
    }
}

#[test]
fn driving_on_gives_the_tricycle_and_the_delay_back() {
    for (seed, asymmetric) in [(1, false), (2, true)] {
        let mut vehicle = tricycle(asymmetric);
        vehicle.delay = 0.03;
        let log = driving_on(&vehicle, 60.0, &mut drives::Random::new(seed));
        let spans = windows(&log, 1.0, 0.3);
        let motions =
            drives::with_covariance(exact(&vehicle, &log, &spans), drives::Noise::default_of_notes().covariance());
        let model = if asymmetric { Model::TricycleAsymmetric } else { Model::Tricycle };
        for free in TRICYCLE_SETS {
            is_recovered(&vehicle, &log, &motions, model, free);
            let with_delay: Vec<&str> = free.iter().copied().chain(["delay"]).collect();
            is_recovered(&vehicle, &log, &motions, model, &with_delay);
        }
    }
}

#[test]
fn both_drives_give_the_differential_back() {
    let mut vehicle = differential();
    let (log, spans) = stop_and_go(&vehicle, &[grid(2, 18.0, 50.0, 120.0), vec![straight(2.0)]].concat());
    let motions = drives::without_covariance(exact(&vehicle, &log, &spans));
    is_recovered(&vehicle, &log, &motions, Model::Differential, &[]);
    vehicle.delay = -0.05;
    let log = driving_on(&vehicle, 60.0, &mut drives::Random::new(3));
    let motions = drives::without_covariance(exact(&vehicle, &log, &windows(&log, 0.7, 0.3)));
    is_recovered(&vehicle, &log, &motions, Model::Differential, &[]);
    is_recovered(&vehicle, &log, &motions, Model::Differential, &["delay"]);
}

/// Scale and offset of a counter that counts backward, and turns that were given wrapped.
#[test]
fn a_counter_that_counts_backward_is_recognised_by_its_scale() {
    let mut vehicle = tricycle(true);
    let Drive::Tricycle(t) = vehicle.drive else { return };
    vehicle.drive = Drive::Tricycle(Tricycle { scale: -t.scale, ..t });
    let (log, spans) = stop_and_go(
        &vehicle,
        &[
            arc(30.0, true, 180.0),
            arc(-30.0, true, 170.0),
            arc(20.0, false, 90.0),
            arc(-20.0, false, 90.0),
            arc(40.0, false, 90.0),
        ],
    );
    let motions = drives::without_covariance(exact(&vehicle, &log, &spans));
    is_recovered(&vehicle, &log, &motions, Model::TricycleAsymmetric, &[]);
}

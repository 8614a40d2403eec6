//! Plans against the grids of the thesis, with the tolerances and the small hall of the theory page.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests may fail loudly")]

use groma_calibration::vehicle::{Layout, Model, Vehicle};
use groma_geometry::Se2;
use groma_models::{Differential, Drive, Token, Tricycle};
use groma_planning::vehicle::design::{Choice, best_mixture};
use groma_planning::vehicle::grid::grid;
use groma_planning::vehicle::plan::{choice, plan};
use groma_planning::vehicle::{Arc, Error, Floor, Footprint, Limits, Noise, Plan, Request};
use nalgebra::Vector2;

fn cdeg(x: f64) -> f64 {
    (x * 0.01).to_radians()
}

fn tricycle() -> Vehicle {
    let offset = cdeg(-75.93);
    let drive =
        Tricycle { scale: 0.249_685e-3, wheelbase: 1.5, gain: 1.0, offset_forward: offset, offset_backward: offset };
    Vehicle { drive: Drive::Tricycle(drive), laser: Se2::new(0.390_28, 0.002_14, cdeg(50.34)), delay: 0.0 }
}

const SIGMAS: [f64; 5] = [1.745_329e-4, 2.5e-8, 0.25e-3, 0.25e-3, 0.872_665e-4];

fn request<'a>(layout: &'a Layout, sigmas: &'a [Option<f64>], limits: Limits) -> Request<'a> {
    Request { vehicle: tricycle(), layout, sigmas, noise: Noise::default(), limits, floor: None }
}

/// Repetitions of a whole grid, in parts, that hold the tolerances: number of arcs and time.
fn needed(request: &Request<'_>, arcs: &[Arc]) -> (f64, f64) {
    let choice: Choice = choice(request, arcs);
    let scaled = choice.scaled(&vec![1.0; arcs.len()]).unwrap();
    (scaled.iter().sum(), choice.total(&scaled))
}

/// The best grid; `whole` asks that none of its arcs is left out for its length.
fn best_grid(request: &Request<'_>, turns: &[f64], whole: bool) -> (f64, f64) {
    let mut best = (f64::INFINITY, f64::INFINITY);
    for (from, to) in [(18.0_f64, 50.0_f64), (18.0, 34.0), (35.0, 50.0)] {
        for &turn in turns {
            for count in [2, 3, 4, 6, 8, 10] {
                let limits = Limits { angle_min: from.to_radians(), angle_max: to.to_radians(), ..request.limits };
                let arcs = grid(&request.vehicle, count, turn.to_radians(), &limits);
                if arcs.len() < 4 || (whole && arcs.len() < 4 * count) {
                    continue;
                }
                let (number, time) = needed(request, &arcs);
                println!("  {count} angles {from}-{to}, {turn} deg: {number:.1} arcs, {time:.0} s");
                if time < best.1 {
                    best = (number, time);
                }
            }
        }
    }
    best
}

fn told(name: &str, plan: &Plan) {
    println!("{name}: {} arcs, {:.0} s, no plan takes less than {:.0} s", plan.arcs.len(), plan.time, plan.bound);
}

#[test]
fn a_plan_takes_no_more_than_the_best_grid() {
    let layout = Layout::new(Model::Tricycle, &[]).unwrap();
    let sigmas = SIGMAS.map(Some);
    let limits = Limits { acceleration_max: 100.0, ..Limits::default() };
    let request = request(&layout, &sigmas, limits);
    let found = plan(&request, &Token::new()).unwrap();
    told("large hall", &found);
    let (number, time) = best_grid(&request, &[60.0, 120.0, 180.0, 240.0], true);
    println!("best grid: {number:.1} arcs, {time:.0} s");
    assert!(found.time <= time, "{} s against {time} s", found.time);
    assert!(found.sigmas.iter().zip(SIGMAS).all(|(got, wanted)| *got <= wanted), "{}", found.sigmas);
    assert!(found.bound <= found.time && found.bound > 0.9 * found.time);
}

#[test]
fn in_a_small_hall_it_takes_about_half() {
    let layout = Layout::new(Model::Tricycle, &[]).unwrap();
    let sigmas = SIGMAS.map(Some);
    let limits = Limits { path_max: 4.0, acceleration_max: 100.0, ..Limits::default() };
    let request = request(&layout, &sigmas, limits);
    let found = plan(&request, &Token::new()).unwrap();
    told("small hall", &found);
    let turns = [30.0, 45.0, 60.0, 90.0];
    let (number, time) = best_grid(&request, &turns, true);
    println!("best whole grid: {number:.1} arcs, {time:.0} s");
    assert!(found.time < 0.6 * time, "{} s against {time} s", found.time);
    let (number, time) = best_grid(&request, &turns, false);
    println!("best grid of what is short enough: {number:.1} arcs, {time:.0} s");
    assert!(found.time < time, "{} s against {time} s", found.time);
    assert!(found.arcs.iter().all(|arc| arc.path.abs() <= 4.0 + 1e-9));
}

#[test]
fn the_bound_is_that_of_a_plain_search_among_two_arcs() {
    let layout = Layout::new(Model::Tricycle, &[]).unwrap();
    let sigmas = SIGMAS.map(Some);
    let request = request(&layout, &sigmas, Limits::default());
    let four = grid(&request.vehicle, 2, 2.0, &request.limits);
    let both = choice(&request, &four);
    let mixture = best_mixture(&both, &Token::new()).unwrap().unwrap();
    let mut least = f64::INFINITY;
    for k in 1..400 {
        let share = f64::from(k) / 400.0;
        let repetitions: Vec<f64> = (0..8).map(|j| if j < 4 { share } else { 1.0 - share }).collect();
        least = least.min(both.total(&both.scaled(&repetitions).unwrap()));
    }
    assert!(mixture.bound <= least && mixture.cost <= least * 1.002, "{mixture:?} {least}");
    assert!(mixture.bound > 0.99 * mixture.cost);
}

#[test]
fn a_plan_fits_its_floor_and_its_acceleration() {
    let layout = Layout::new(Model::TricycleAsymmetric, &["wheelbase"]).unwrap();
    let sigmas: Vec<Option<f64>> = layout.names().iter().map(|n| n.starts_with("laser_x").then_some(1e-3)).collect();
    let corners = [(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (0.0, 6.0)].map(|(x, y)| Vector2::new(x, y)).to_vec();
    let footprint = Footprint { front: 1.8, rear: 0.4, side: 0.5 };
    let floor = Floor::new(corners).unwrap();
    let limits = Limits { acceleration_max: 0.2, ..Limits::default() };
    let request = Request { floor: Some((floor.clone(), footprint)), ..request(&layout, &sigmas, limits) };
    let found = plan(&request, &Token::new()).unwrap();
    told("floor", &found);
    assert!(found.arcs.len() < 10, "{}", found.arcs.len());
    for (arc, start) in found.arcs.iter().zip(&found.starts) {
        for k in 0..=20 {
            let pose = *start * arc.motion(&request.vehicle, f64::from(k) / 20.0);
            assert!(floor.holds(&footprint, &pose), "{arc:?} from {start:?}");
        }
        let u = arc.path_and_turn(&request.vehicle) / (arc.path.abs() / arc.speed);
        assert!((u.x * u.y).abs() <= 0.2 + 1e-9);
    }
    let closet = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.5), (0.0, 1.5)].map(|(x, y)| Vector2::new(x, y)).to_vec();
    let none = plan(&Request { floor: Some((Floor::new(closet).unwrap(), footprint)), ..request }, &Token::new());
    assert_eq!(none.unwrap_err(), Error::NoRoom);
}

#[test]
fn differential_drives_are_planned_too() {
    let drive = Differential { left: 0.077, right: 0.077, axle: 0.33 };
    let vehicle = Vehicle { drive: Drive::Differential(drive), laser: Se2::new(0.145, 0.0, 0.0), delay: 0.0 };
    let layout = Layout::new(Model::Differential, &[]).unwrap();
    let sigmas = [Some(1e-5), Some(1e-5), Some(1e-4), Some(1e-3), Some(1e-3), Some(1e-3)];
    let limits = Limits { path_max: 3.0, ..Limits::default() };
    let found = plan(&Request { vehicle, ..request(&layout, &sigmas, limits) }, &Token::new()).unwrap();
    told("differential", &found);
    assert!(found.sigmas.iter().zip(sigmas).all(|(got, wanted)| *got <= wanted.unwrap()));
}

#[test]
fn wishes_without_sense_are_refused() {
    let layout = Layout::new(Model::Tricycle, &[]).unwrap();
    for sigmas in [[None; 5], [Some(0.0); 5], [Some(f64::NAN); 5]] {
        assert_eq!(plan(&request(&layout, &sigmas, Limits::default()), &Token::new()).unwrap_err(), Error::Sigma);
    }
    let sigmas = SIGMAS.map(Some);
    let none = Limits { path_max: 0.0, ..Limits::default() };
    assert!(matches!(plan(&request(&layout, &sigmas, none), &Token::new()).unwrap_err(), Error::Number(_)));
    let short = Limits { path_max: 0.001, ..Limits::default() };
    let refused = plan(&request(&layout, &sigmas, short), &Token::new()).unwrap_err();
    assert!(matches!(refused, Error::NoArcs | Error::TooMany), "{refused}");
}

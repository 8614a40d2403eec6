//! Maps of a calibrated vehicle: its wheels take the place of odometry.

use crate::feed::{Arrival, arrivals, codes, errors, estimate, fed, in_turn, laps, scan};
use groma_geometry::Se2;
use groma_mapping::options::Options;
use groma_models::{Differential, Drive, Odometry, Scanner, Token, Vehicle};
use groma_pipeline::map::Outcome;
use groma_pipeline::message::WheelReading;
use groma_pipeline::wheels::VirtualWheels;
use groma_pipeline::{Map, Message};
use groma_simulation::Simulated;
use std::f64::consts::{PI, TAU};

/// The wheels stamp so much later than the scans [s].
const DELAY: f64 = 0.3;
const RADIUS: f64 = 0.1;
const AXLE: f64 = 0.5;

fn vehicle(mount: Se2, delay: f64) -> Vehicle {
    let drive = Drive::Differential(Differential { left: RADIUS, right: RADIUS, axle: AXLE });
    let laser = mount.to_vector();
    let scanner = Scanner::new("front".into(), [laser.x, laser.y, laser.z], 0.0).unwrap();
    Vehicle::new(drive, vec![scanner], delay).unwrap()
}

/// What the wheels read, by their clock.
fn readings(odometry: &[Odometry], delay: f64) -> Vec<WheelReading> {
    let mut wheels = VirtualWheels::new(AXLE);
    let made = odometry.iter().filter_map(|o| wheels.push(o));
    made.map(|r| WheelReading {
        stamp: r.stamp + delay,
        positions: r.positions.iter().map(|(k, metres)| (*k, metres / RADIUS)).collect(),
    })
    .collect()
}

/// Scans and wheels, each when it was measured.
fn together(simulated: &Simulated, readings: Vec<WheelReading>, delay: f64) -> Vec<Arrival> {
    let mut all: Vec<Arrival> = readings.into_iter().map(|r| (r.stamp - delay, Message::Wheels(r))).collect();
    all.extend(simulated.scans.iter().map(|s| (scan(s).end(), scan(s))));
    in_turn(all)
}

fn map_of(vehicle: &Vehicle, arrivals: &[Arrival]) -> Outcome {
    let mut map = Map::of_vehicle(Options::default(), vehicle).unwrap();
    arrivals.iter().for_each(|(_, message)| map.push(message.clone()));
    map.finish(&Token::new()).unwrap()
}

/// Largest distance between the poses of two maps [m].
fn apart(a: &Outcome, b: &Outcome) -> f64 {
    assert_eq!(a.map.stamps, b.map.stamps);
    let nodes = a.map.graph.nodes.iter().zip(&b.map.graph.nodes);
    nodes.map(|(a, b)| (a.translation - b.translation).norm()).fold(0.0, f64::max)
}

#[test]
fn wheels_serve_as_odometry_does_whatever_their_clock() {
    let (simulated, mount) = laps(1);
    let odometry = fed(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    let by_odometry = errors(&simulated, &odometry.finish(&Token::new()).unwrap());
    for delay in [0.0, DELAY, -DELAY] {
        let all = together(&simulated, readings(&simulated.odometry, delay), delay);
        let outcome = map_of(&vehicle(mount, delay), &all);
        let found = errors(&simulated, &outcome);
        assert!(found.0 < 1.2 * by_odometry.0 && found.1 < 1.2 * by_odometry.1, "{delay} s: {found:?} {by_odometry:?}");
        assert_eq!((codes(&outcome), outcome.verdict), (vec![], "consistent"));
        let count = |name: &str| outcome.counts.iter().find(|(n, _)| *n == name).unwrap().1;
        assert_eq!((count("wheels_read") as usize, count("odometry_read")), (simulated.odometry.len(), 0.0));
        // A wrong clock shows as a laser that sits elsewhere.
        assert!(count("laser_offset_x_m").abs() < 0.03, "{delay} s: {}", count("laser_offset_x_m"));
    }
}

#[test]
fn counters_that_wrap_and_joints_in_messages_of_their_own_give_the_same_map() {
    let (simulated, mount) = laps(1);
    let (plain, vehicle) = (readings(&simulated.odometry, DELAY), vehicle(mount, DELAY));
    let whole = map_of(&vehicle, &together(&simulated, plain.clone(), DELAY));
    let wrap = |x: f64| (x + PI).rem_euclid(TAU) - PI;
    let wrapped = plain
        .iter()
        .map(|r| WheelReading { positions: r.positions.iter().map(|(k, x)| (*k, wrap(*x))).collect(), ..r.clone() });
    let wrapped = map_of(&vehicle, &together(&simulated, wrapped.collect(), DELAY));
    assert!(apart(&whole, &wrapped) < 1e-6 && codes(&wrapped) == ["wheels-unrolled"], "{}", apart(&whole, &wrapped));
    let single = |r: &WheelReading, k: usize| WheelReading { positions: vec![r.positions[k]], ..r.clone() };
    for order in [[0, 1], [1, 0]] {
        let separate = plain.iter().flat_map(|r| order.map(|k| single(r, k))).collect();
        let separate = map_of(&vehicle, &together(&simulated, separate, DELAY));
        assert!(estimate(&separate) == estimate(&whole), "{order:?}");
    }
}

#[test]
fn odometry_that_others_publish_is_passed_over() {
    let (simulated, mount) = laps(1);
    let all = together(&simulated, readings(&simulated.odometry, 0.0), 0.0);
    let wild = |(at, _): &Arrival| {
        let pose = Se2::new((7.0 * at).sin(), 3.0 * at, *at);
        (*at, Message::Odometry(Odometry { stamp: *at, pose }))
    };
    let others: Vec<Arrival> = all.iter().flat_map(|arrival| [wild(arrival), arrival.clone()]).collect();
    let vehicle = vehicle(mount, 0.0);
    assert!(estimate(&map_of(&vehicle, &others)) == estimate(&map_of(&vehicle, &all)));
}

/// The counters begin anew in the middle of the drive: told, and bridged by the scans.
#[test]
fn a_counter_that_is_reset_does_not_bend_the_map() {
    let (simulated, mount) = laps(1);
    let mut reset = readings(&simulated.odometry, 0.0);
    let middle = reset.len() / 2;
    reset[middle..].iter_mut().flat_map(|r| &mut r.positions).for_each(|(_, x)| *x -= 4000.0);
    let outcome = map_of(&vehicle(mount, 0.0), &together(&simulated, reset, 0.0));
    assert!(codes(&outcome).contains(&"wheels-leap") && errors(&simulated, &outcome).1 < 0.06);
    assert!(!codes(&outcome).contains(&"odometry-jump"));
}

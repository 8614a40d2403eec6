//! Every verdict on a map, and every finding, has an input that leads to it.

use crate::building::{around, drive, mount};
use crate::feed::{Arrival, arrivals, codes, fed, in_turn, laps, mapped, scan, sweeping};
use groma_geometry::Se2;
use groma_mapping::options::Options;
use groma_models::finding::Code;
use groma_models::{LaserScan, Odometry, Token};
use groma_pipeline::map::Outcome;
use groma_pipeline::{Map, Message};
use groma_simulation::drive::Route;
use groma_simulation::world::{WALL, World};
use groma_simulation::{Scanner, Scenario};
use nalgebra::Vector2;

fn value(outcome: &Outcome, code: Code, name: &str) -> f64 {
    let finding = outcome.findings.iter().find(|f| f.code == code).unwrap();
    finding.values.iter().find(|q| q.name == name).unwrap().value
}

fn span(outcome: &Outcome, code: Code) -> (f64, f64) {
    outcome.findings.iter().find(|f| f.code == code).unwrap().span.unwrap()
}

fn odometry_with(odometry: &[Odometry], change: impl Fn(usize, &Odometry) -> Odometry) -> Vec<Odometry> {
    odometry.iter().enumerate().map(|(k, o)| change(k, o)).collect()
}

#[test]
fn a_good_drive_is_consistent_and_nothing_is_objected() {
    let (simulated, mount) = laps(1);
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    assert_eq!((outcome.verdict, codes(&outcome)), ("consistent", vec![]));
    let count = |name: &str| outcome.counts.iter().find(|(n, _)| *n == name).unwrap().1;
    assert_eq!(count("scans_read") as usize, simulated.scans.len());
    assert_eq!((count("scans_used"), count("odometry_read") as usize), (count("scans_read"), simulated.odometry.len()));
    let driven: f64 = simulated.scan_poses.windows(2).map(|w| (w[1].translation - w[0].translation).norm()).sum();
    assert!((count("path_m") - driven).abs() < 0.05 * driven, "{} m of {driven} m", count("path_m"));
}

#[test]
fn without_a_loop_and_without_odometry_it_says_so() {
    let (simulated, mount) = laps(1);
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans[..40], &[], 0.0));
    assert_eq!((outcome.verdict, codes(&outcome)), ("consistent", vec!["loop-none", "odometry-missing"]));
}

/// Half of the drive is missing, and nothing tells how the vehicle came to a wood of pillars.
#[test]
fn a_gap_that_nothing_bridges_tears_the_map() {
    let (simulated, mount) = laps(1);
    let elsewhere = sweeping(2);
    let v = Vector2::new;
    let mut world = World::default();
    for k in 0..60_u32 {
        let (along, across) = (f64::from(k) * 0.7, f64::from(k * k % 17));
        world.circle(v(along, if k % 2 == 0 { 3.0 + 0.6 * across } else { -3.0 - 0.6 * across }), 0.25, WALL);
    }
    let mut route = Route::from(v(5.0, 0.0));
    route.to(v(25.0, 0.3));
    let other = drive(world, &route, &elsewhere);
    let shift = simulated.scans[60].stamp + 1.0 - other.scans[0].stamp;
    let later = other.scans.iter().map(|s| LaserScan { stamp: s.stamp + shift, ..s.clone() });
    let scans: Vec<LaserScan> = simulated.scans[..60].iter().cloned().chain(later).collect();
    let outcome = mapped(&Options::default(), mount, &arrivals(&scans, &[], 0.0));
    assert_eq!(outcome.verdict, "torn");
    let (from, to) = span(&outcome, Code::MapTorn);
    assert!(from >= simulated.scans[59].stamp && to <= scans[scans.len() - 1].stamp);
}

/// The hall, its eastern half moved north by `shift` metres, block and furniture included.
fn parted(shift: f64) -> World {
    let mut world = World::default();
    let mut half = |west: bool, corners: &[(f64, f64)]| {
        let by = if west { 0.0 } else { shift };
        let corners: Vec<Vector2<f64>> = corners.iter().map(|(x, y)| Vector2::new(*x, y + by)).collect();
        world.polyline(&corners, WALL);
    };
    half(true, &[(9.0, 0.0), (0.0, 0.0), (0.0, 10.0), (9.0, 10.0)]);
    half(false, &[(9.0, 0.0), (16.0, 0.0), (16.0, 10.0), (9.0, 10.0)]);
    half(true, &[(9.0, 3.5), (4.0, 3.5), (4.0, 6.5), (9.0, 6.5)]);
    half(false, &[(9.0, 3.5), (12.0, 3.5), (12.0, 6.5), (9.0, 6.5)]);
    [(1.0, 9.3, true), (6.0, 0.4, true), (11.0, 9.5, false), (15.2, 2.5, false)].into_iter().for_each(
        |(x, y, west)| {
            half(
                west,
                &[(x - 0.3, y - 0.4), (x + 0.3, y - 0.4), (x + 0.3, y + 0.4), (x - 0.3, y + 0.4), (x - 0.3, y - 0.4)],
            );
        },
    );
    world
}

/// One lap, then another one in a hall whose eastern half is elsewhere: each half closes loops, and no map meets both.
#[test]
fn a_hall_that_was_rebuilt_on_the_way_strains_the_map() {
    let still = sweeping(1);
    let near = Scenario { scanner: Scanner { range_max: 6.0, ..still.scanner }, ..still };
    let before = drive(parted(0.0), &around(2), &near);
    let verdict = |shift: f64| {
        let after = drive(parted(shift), &around(2), &near);
        assert_eq!(before.odometry, after.odometry);
        let half = before.scans.len() / 2;
        let scans: Vec<LaserScan> = before.scans[..half].iter().chain(&after.scans[half..]).cloned().collect();
        mapped(&Options::default(), mount(&near), &arrivals(&scans, &before.odometry, 0.0))
    };
    assert_eq!(verdict(0.0).verdict, "consistent");
    let strained = verdict(0.5);
    assert_eq!(strained.verdict, "strained");
    let (violated, closures) =
        (value(&strained, Code::ClosureViolated, "violated"), value(&strained, Code::ClosureViolated, "closures"));
    assert!(violated >= 2.0 && violated < closures, "{violated} of {closures}");
    let worst = value(&strained, Code::ClosureViolated, "worst");
    assert!(worst > 0.25 && worst < 0.8, "{worst}");
    let (from, to) = span(&strained, Code::ClosureViolated);
    let middle = before.scans[before.scans.len() / 2].stamp;
    assert!(from < middle && to > middle, "{from} .. {to}, rebuilt at {middle}");
}

/// A turn of a run that is asked to end: the current graph, and the word for it.
#[test]
fn what_is_cancelled_is_kept_and_called_interrupted() {
    let (simulated, mount) = laps(1);
    let map = fed(&Options::default(), mount, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    let token = Token::new();
    token.cancel();
    let outcome = map.finish(&token).unwrap();
    assert_eq!(outcome.verdict, "interrupted");
    assert!(codes(&outcome).contains(&"interrupted") && !outcome.map.grid.cells.is_empty());
    assert!(outcome.map.trajectory.len() >= simulated.scans.len());
}

/// A bare corridor whose ends are out of range.
#[test]
fn a_corridor_without_ends_is_weakly_constrained() {
    let wide = sweeping(1);
    let short = Scenario { scanner: Scanner { range_max: 5.0, ..wide.scanner }, ..wide };
    let v = Vector2::new;
    let mut world = World::default();
    world.rectangle(v(20.0, 0.0), v(40.0, 2.4), 0.0, WALL);
    let mut route = Route::from(v(2.0, 0.0));
    route.to(v(38.0, 0.1));
    let simulated = drive(world, &route, &short);
    let all = arrivals(&simulated.scans, &simulated.odometry, 0.0);
    let outcome = mapped(&Options::default(), mount(&short), &all);
    assert!(value(&outcome, Code::WeakStretch, "sigma") > 0.1);
    let weak = outcome.findings.iter().find(|f| f.code == Code::WeakStretch).unwrap();
    let [x, _] = weak.place.unwrap();
    assert!(x > 2.0 && x < 34.0, "{x}");
}

#[test]
fn dead_odometry_is_overruled_from_when_it_died() {
    let (simulated, mount) = laps(1);
    let dead = simulated.odometry.len() / 3;
    let odometry =
        odometry_with(&simulated.odometry, |k, o| Odometry { pose: simulated.odometry[k.min(dead)].pose, ..*o });
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans, &odometry, 0.0));
    let (from, to) = span(&outcome, Code::OdometryOverruled);
    let scans = value(&outcome, Code::OdometryOverruled, "scans");
    assert!(from > odometry[dead].stamp && to > from && scans > 20.0 && scans < simulated.scans.len() as f64);
}

#[test]
fn a_scanner_that_sits_elsewhere_is_told_where() {
    let (simulated, mount) = laps(1);
    let said = mount * Se2::new(-0.3, 0.0, 0.0);
    let outcome = mapped(&Options::default(), said, &arrivals(&simulated.scans, &simulated.odometry, 0.0));
    let (x, y) = (value(&outcome, Code::ScannerOffset, "x"), value(&outcome, Code::ScannerOffset, "y"));
    assert!((x - 0.3).abs() < 0.1 && y.abs() < 0.1, "{x} {y}");
}

#[test]
fn a_leap_of_the_odometry_is_told_with_its_time() {
    let (simulated, mount) = laps(1);
    let leap = simulated.odometry.len() / 2;
    let odometry = odometry_with(&simulated.odometry, |k, o| {
        let by = if k >= leap { Se2::new(0.0, 3.0, 0.0) } else { Se2::IDENTITY };
        Odometry { pose: by * o.pose, ..*o }
    });
    let outcome = mapped(&Options::default(), mount, &arrivals(&simulated.scans, &odometry, 0.0));
    assert_eq!(value(&outcome, Code::OdometryJump, "count"), 1.0);
    assert_eq!(span(&outcome, Code::OdometryJump), (odometry[leap - 1].stamp, odometry[leap].stamp));
}

/// Scans without hits, scans that point nowhere, poses that are none, stamps that repeat or are none.
#[test]
fn what_cannot_be_used_is_counted_by_reason() {
    let (simulated, mount) = laps(1);
    let mut scans = simulated.scans.clone();
    scans[7].ranges.fill(f64::INFINITY);
    scans[8].ranges.fill(f64::NAN);
    for (k, bad) in [(11, f64::NAN), (12, 1e300), (13, f64::NEG_INFINITY)] {
        scans[k].geometry.angle_increment = bad;
    }
    let mut all = arrivals(&scans, &simulated.odometry, 0.0);
    let nowhere = |k: usize, x: f64| {
        let stamp = simulated.odometry[k].stamp + 1e-3;
        (stamp, Message::Odometry(Odometry { stamp, pose: Se2::new(x, 0.0, 0.0) }))
    };
    all.extend([nowhere(30, f64::NAN), nowhere(40, f64::INFINITY)]);
    all.push((scans[20].stamp + 0.06, scan(&scans[20])));
    let outcome = mapped(&Options::default(), mount, &in_turn(all));
    let count = |code, part: &str| {
        let of = |f: &&groma_models::Finding| f.code == code && f.text.contains(part);
        outcome.findings.iter().find(of).map(|f| f.values[0].value)
    };
    assert_eq!(count(Code::ScansUnusable, "ten hits"), Some(2.0));
    assert_eq!(count(Code::ValuesInvalid, "scans"), Some(3.0));
    assert_eq!(count(Code::ValuesInvalid, "odometry"), Some(2.0));
    assert_eq!(count(Code::StampsInvalid, "scans"), Some(1.0));
    assert_eq!(span(&outcome, Code::ScansUnusable), (scans[7].stamp, scans[8].stamp));
    assert!(outcome.counts.contains(&("scans_used", (scans.len() - 5) as f64)), "{:?}", outcome.counts);
    assert_eq!(outcome.verdict, "consistent");
}

/// Two rooms a kilometre and a half apart, and a cell of a centimetre.
#[test]
fn a_map_too_large_for_its_cell_is_told() {
    let (simulated, mount) = laps(1);
    let far = |o: &Odometry| Odometry { stamp: o.stamp + 100.0, pose: Se2::new(1500.0, 1000.0, 0.0) * o.pose };
    let near = &simulated.odometry[..20];
    let odometry: Vec<Odometry> = near.iter().copied().chain(near.iter().map(far)).collect();
    let first = &simulated.scans[0];
    let second = LaserScan { stamp: first.stamp + 100.0, ranges: vec![9.0; 271], ..first.clone() };
    let options = Options { resolution: 0.01, ..Options::default() };
    let outcome = mapped(&options, mount, &arrivals(&[first.clone(), second], &odometry, 0.0));
    let cell = value(&outcome, Code::LimitReached, "resolution");
    assert!(cell > 0.01 && cell == outcome.map.grid.resolution && outcome.map.grid.cells.len() <= 40_000_000);
}

#[test]
fn a_drive_without_a_usable_scan_is_no_map() {
    let (simulated, mount) = laps(1);
    let all: Vec<Arrival> = arrivals(&[], &simulated.odometry, 0.0);
    assert!(fed(&Options::default(), mount, &all).finish(&Token::new()).is_err());
}

#[test]
fn settings_and_mounts_out_of_range_are_refused_by_name() {
    let refused = |options: Options, mount| Map::new(options, mount).err().map(|e| e.to_string()).unwrap();
    for resolution in [0.0, -1.0, f64::NAN, f64::INFINITY, 2.0] {
        assert!(refused(Options { resolution, ..Options::default() }, Se2::IDENTITY).starts_with("resolution"));
    }
    for lateness in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(refused(Options { lateness, ..Options::default() }, Se2::IDENTITY).starts_with("lateness"));
    }
    let mut options = Options::default();
    options.corners.range_noise = f64::NAN;
    assert!(refused(options, Se2::IDENTITY).contains("range_noise"));
    assert!(refused(Options::default(), Se2::new(0.0, f64::NAN, 0.0)).starts_with("laser_y"));
    assert!(refused(Options::default(), Se2::new(0.0, 0.0, f64::NAN)).starts_with("laser_yaw"));
}

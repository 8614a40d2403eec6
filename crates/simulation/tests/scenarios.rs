//! The named scenarios: drivable for many seeds, reproducible, and as hard as they say.

#![expect(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail loudly")]

use groma_models::Token;
use groma_simulation::scenario::{Building, SCENES};
use groma_simulation::scenes::depot::{Depot, DepotDrive};
use groma_simulation::world::{REFLECTOR, World};
use groma_simulation::{Scanner, Scenario, Simulated, simulate};

/// The drive and the odometry of a scenario, with hardly any scan.
fn drive_of(name: &str, seed: u64) -> Simulated {
    let scenario = Scenario::named(name, seed).unwrap();
    let scanner = Scanner { period: 1e4, ..scenario.scanner.clone() };
    simulate(&Scenario { scanner, ..scenario }, &Token::new())
        .unwrap_or_else(|e| panic!("{name} with seed {seed}: {e}"))
}

fn length(simulated: &Simulated) -> f64 {
    simulated.truth.windows(2).map(|pair| (pair[1].translation - pair[0].translation).norm()).sum()
}

fn final_error(simulated: &Simulated) -> f64 {
    let odometry = simulated.truth[0] * simulated.odometry.last().unwrap().pose;
    (odometry.translation - simulated.truth.last().unwrap().translation).norm()
}

#[test]
fn every_building_can_be_driven_through() {
    for seed in 1..=8 {
        for name in ["rooms", "turns", "warehouse"] {
            assert!(length(&drive_of(name, seed)) > 350.0, "{name} with seed {seed}");
        }
    }
    for seed in 1..=4 {
        assert!((2100.0..2400.0).contains(&length(&drive_of("loop", seed))), "loop with seed {seed}");
    }
}

#[test]
fn the_long_loop_ends_thirty_metres_off() {
    for seed in 1..=3 {
        let error = final_error(&drive_of("loop", seed));
        assert!((error - 30.0).abs() < 0.05, "{error} m with seed {seed}");
    }
}

#[test]
fn the_same_seed_gives_the_same_numbers_and_another_seed_others() {
    let run = |seed| simulate(&Scenario::named("stalls", seed).unwrap(), &Token::new()).unwrap();
    let (first, again, other) = (run(2), run(2), run(3));
    // Bit for bit, as text: NaN is equal to itself there.
    assert_eq!(format!("{:?}", first.scans), format!("{:?}", again.scans));
    assert_eq!(first.odometry, again.odometry);
    assert_eq!(first.joints, again.joints);
    assert_eq!(first.stalls, again.stalls);
    assert_ne!(first.world.surfaces, other.world.surfaces);
    assert_ne!(first.odometry, other.odometry);
}

#[test]
fn faults_leave_the_building_alone() {
    let plain = drive_of("rooms", 4);
    let stalled = drive_of("stalls", 4);
    assert_eq!(plain.world.surfaces, stalled.world.surfaces);
    assert_eq!(plain.truth, stalled.truth);
}

#[test]
fn turns_are_wide_between_scans() {
    let turns = simulate(&Scenario::named("turns", 1).unwrap(), &Token::new()).unwrap();
    let between = |pair: &[groma_geometry::Se2]| pair[0].between(&pair[1]).theta().abs().to_degrees();
    assert!(turns.scan_poses.windows(2).filter(|pair| between(pair) > 40.0).count() > 30);
}

#[test]
fn stalls_hide_turns_and_way() {
    let stalled = drive_of("stalls", 1);
    let jumps: Vec<_> = stalled.odometry.windows(2).map(|pair| pair[0].pose.between(&pair[1].pose)).collect();
    assert_eq!(stalled.stalls.len(), 8);
    assert!(jumps.iter().filter(|jump| jump.theta().abs() > 0.3).count() >= 2);
    assert!(jumps.iter().filter(|jump| jump.translation.norm() > 0.4).count() >= 3);
}

#[test]
fn nonsense_is_refused_by_name() {
    let known = "rooms, warehouse, loop, stalls, turns, depot";
    let error = Scenario::named("attic", 1).unwrap_err();
    assert_eq!(error.to_string(), format!("no scene is called \"attic\": try one of {known}"));
    let mut scenario = Scenario::default();
    scenario.scanner.period = 0.0;
    assert!(simulate(&scenario, &Token::new()).unwrap_err().to_string().starts_with("scanner.period = 0"));
    let mut scenario = Scenario::default();
    scenario.scanner.dropout = 1.5;
    assert!(simulate(&scenario, &Token::new()).unwrap_err().to_string().contains("at most 1"));
    let mut scenario = Scenario::default();
    scenario.limits.speed = f64::NAN;
    assert!(simulate(&scenario, &Token::new()).is_err());
}

#[test]
fn scenarios_survive_json_and_unknown_settings_do_not() {
    for name in SCENES {
        let scenario = Scenario::named(name, 9).unwrap();
        let text = serde_json::to_string(&scenario).unwrap();
        assert_eq!(serde_json::from_str::<Scenario>(&text).unwrap(), scenario);
        let wrong = text.replacen("\"sigma\"", "\"sgima\"", 1);
        assert!(serde_json::from_str::<Scenario>(&wrong).unwrap_err().to_string().contains("sgima"));
    }
}

/// The world and the length of the way of a drive through the depot.
fn depot(seed: u64, depot: Depot) -> (World, f64) {
    let scenario = Scenario::named("depot", seed).unwrap();
    let scanner = Scanner { period: 1e4, ..scenario.scanner.clone() };
    let run = simulate(&Scenario { building: Building::Depot(depot), scanner, ..scenario }, &Token::new()).unwrap();
    let length = length(&run);
    (run.world, length)
}

fn marks(world: &World) -> Vec<groma_simulation::world::Surface> {
    world.surfaces.iter().copied().filter(|surface| surface.reflectivity >= REFLECTOR).collect()
}

#[test]
fn the_paths_through_the_depot_are_as_long_as_they_say() {
    let wanted =
        [(DepotDrive::Path1, 12.0), (DepotDrive::Path2, 12.0), (DepotDrive::Path3, 12.0), (DepotDrive::Path4, 7.0)];
    for (drive, metres) in wanted {
        for plan in 1..=3 {
            let (_, length) = depot(plan, Depot { plan, drive, ..Depot::default() });
            assert!((length - metres).abs() < 0.3, "{drive:?} of plan {plan}: {length} m");
        }
    }
}

#[test]
fn halting_points_are_visited_again() {
    let (_, length) = depot(1, Depot { drive: DepotDrive::Halts, ..Depot::default() });
    assert!((300.0..350.0).contains(&length), "{length}");
}

#[test]
fn a_day_moves_its_share_of_the_pallets_and_nothing_else() {
    let at = |day, changed| depot(1, Depot { day, changed, ..Depot::default() }).0;
    let (before, same, moved) = (at(0, 0.0), at(7, 0.0), at(7, 1.0 / 3.0));
    assert_eq!(before.surfaces, same.surfaces);
    assert_eq!(marks(&before), marks(&moved));
    let kept = before.surfaces.iter().filter(|surface| moved.surfaces.contains(surface)).count() as f64;
    let share = kept / before.surfaces.len() as f64;
    assert!((0.6..0.95).contains(&share), "{share}");
    assert_ne!(moved.surfaces, at(8, 1.0 / 3.0).surfaces);
}

#[test]
fn fewer_reflectors_are_some_of_them() {
    let at = |reflectors| marks(&depot(1, Depot { reflectors, ..Depot::default() }).0);
    let (all, half, few, none) = (at(1.0), at(0.5), at(0.25), at(0.0));
    assert!(all.len() > 60 && none.is_empty());
    assert!((half.len() as f64 / all.len() as f64 - 0.5).abs() < 0.15);
    assert!(half.iter().all(|mark| all.contains(mark)) && few.iter().all(|mark| half.contains(mark)));
}

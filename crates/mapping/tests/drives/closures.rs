//! Loop closures: places that look alike are not taken for one another, places seen again are found.
//!
//! A row of rooms of one plan, furniture included, ten metres from each other on a bare corridor, and a scanner that does
//! not see from one door to the next: all that is seen fits one room as well as the other, and slides along the corridor.

use crate::building::{around, closures, drive, hall, map, mount, scenario, truth, worst, worst_closure};
use groma_geometry::Se2;
use groma_mapping::closure::{Closure, Verdict};
use groma_mapping::map_result::MapResult;
use groma_mapping::mapper::Mapper;
use groma_mapping::options::Options;
use groma_models::Token;
use groma_simulation::drive::{Route, WheelErrors};
use groma_simulation::world::{FURNITURE, WALL, World};
use groma_simulation::{Scanner, Scenario, Simulated};
use nalgebra::Vector2;

/// Where the doors are along the corridor [m].
const DOORS: [f64; 4] = [4.0, 14.0, 24.0, 34.0];
/// The rooms that are visited, in order: the first one twice, at the start and at the end.
const VISITS: [usize; 5] = [0, 3, 2, 1, 0];

fn v(x: f64, y: f64) -> Vector2<f64> {
    Vector2::new(x, y)
}

fn building() -> World {
    let mut world = World::default();
    let length = DOORS[3] + 4.0;
    world.polyline(&[v(0.0, 1.0), v(0.0, -1.0), v(length, -1.0), v(length, 1.0)], WALL);
    let mut last = 0.0;
    for door in DOORS {
        world.wall(v(last, 1.0), v(door - 0.6, 1.0), WALL);
        last = door + 0.6;
        let outline = [(-0.6, 1.0), (-2.5, 1.0), (-2.5, 6.0), (2.5, 6.0), (2.5, 1.0), (0.6, 1.0)];
        world.polyline(&outline.map(|(x, y)| v(door + x, y)), WALL);
        world.rectangle(v(door - 1.8, 4.8), v(0.8, 1.4), 0.2, FURNITURE);
        world.rectangle(v(door + 1.9, 2.2), v(0.6, 0.9), 0.0, FURNITURE);
        world.circle(v(door + 1.6, 5.2), 0.25, FURNITURE);
    }
    world.wall(v(last, 1.0), v(length, 1.0), WALL);
    world
}

fn route() -> Route {
    let mut route = Route::from(v(1.0, 0.0));
    for door in VISITS.map(|k| DOORS[k]) {
        route.to(v(door, 0.0));
        route.to(v(door, 3.8));
        route.stop(0.5);
        route.to(v(door, 0.0));
        route.stop(0.5);
    }
    route
}

/// A scanner that does not see from one door to the next, and wheels that end 4 m off.
fn short_sighted(seed: u64) -> Scenario {
    Scenario {
        scanner: Scanner { range_max: 5.0, ..scenario(seed).scanner },
        wheels: WheelErrors { final_error: Some(4.0), ..WheelErrors::default() },
        ..scenario(seed)
    }
}

fn mapped(seed: u64) -> (Simulated, MapResult, Vec<Se2>) {
    let scenario = short_sighted(seed);
    let simulated = drive(building(), &route(), &scenario);
    let result = map(&simulated, &simulated.odometry, mount(&scenario));
    let truth = truth(&simulated, &result);
    (simulated, result, truth)
}

#[test]
fn rooms_that_look_alike_are_refused() {
    for seed in 1..5 {
        let (_, result, truth) = mapped(seed);
        let (metres, radians, accepted) = worst_closure(&truth, &result);
        assert!(accepted > 20 && metres < 0.2 && radians < 0.02, "seed {seed}: {metres} m {radians} rad");
        // Who believes the views alone would have accepted these.
        let refused = closures(&truth, &result, |verdict| verdict != Verdict::Accepted);
        let tempting = |(c, true_pose): &&(Closure, Se2)| {
            c.check.overlap > 0.85 && true_pose.between(&c.check.pose).translation.norm() > 0.5
        };
        let count = refused.iter().filter(tempting).count();
        assert!(count >= 3, "seed {seed}: {count} of {} are wrong, too few to fall for", refused.len());
        let (metres, radians) = worst(&truth, &result.graph.nodes);
        assert!(metres < 0.25 && radians < 0.01, "seed {seed}: {metres} m {radians} rad");
    }
}

#[test]
fn a_corridor_without_ends_slides() {
    let (_, result, _) = mapped(1);
    assert!(result.closures.iter().any(|c| c.closure.verdict == Verdict::Slides));
    assert!(result.weak.iter().any(|spot| spot.sigma > 0.1), "and the map says that it is weak there");
}

#[test]
fn a_room_seen_again_is_where_it_was() {
    for seed in 1..5 {
        let (simulated, result, truth) = mapped(seed);
        let room = simulated.scan_poses[0].inverse().act(v(DOORS[0], 3.0));
        let inside: Vec<usize> = (0..truth.len()).filter(|k| (truth[*k].translation - room).norm() < 1.0).collect();
        let (first, last) = (inside[0], inside[inside.len() - 1]);
        assert!(result.stamps[last] - result.stamps[first] > 150.0);
        let error =
            truth[first].between(&truth[last]).between(&result.graph.nodes[first].between(&result.graph.nodes[last]));
        assert!(error.translation.norm() < 0.03 && error.theta().abs() < 0.005, "seed {seed}: {error:?}");
    }
}

/// A drive that has been pushed, and its map by the mapper.
fn pushed(simulated: &Simulated, scenario: &Scenario, online: bool) -> (usize, MapResult) {
    let mut mapper = Mapper::new(Options { online, ..Options::default() });
    let mut readings = simulated.odometry.iter().peekable();
    for scan in &simulated.scans {
        while let Some(reading) = readings.next_if(|r| r.stamp <= scan.stamp) {
            mapper.push_odometry(*reading);
        }
        mapper.push_scan(scan, &mount(scenario)).unwrap();
    }
    (mapper.state().unwrap().closures, mapper.finish(&Token::new()).unwrap())
}

/// What was closed on the way is of local maps that are finished; the last one may see the start again.
#[test]
fn the_end_of_a_drive_closes_loops_too() {
    let scenario = scenario(1);
    let simulated = drive(hall(), &around(1), &scenario);
    for online in [false, true] {
        let (on_the_way, result) = pushed(&simulated, &scenario, online);
        assert!(result.accepted().count() > on_the_way, "{on_the_way} of {}", result.accepted().count());
    }
}

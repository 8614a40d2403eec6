//! Drives through small simulated buildings, for the tests of mapping.

use groma_geometry::Se2;
use groma_mapping::closure::{Closure, Verdict};
use groma_mapping::map_result::MapResult;
use groma_mapping::mapper::Mapper;
use groma_mapping::options::Options;
use groma_models::{Odometry, Token};
use groma_simulation::drive::{Limits, Route, WheelErrors};
use groma_simulation::scenario::Building;
use groma_simulation::simulate::simulate_in;
use groma_simulation::world::{FURNITURE, WALL, World};
use groma_simulation::{Scanner, Scenario, Simulated};
use nalgebra::Vector2;

/// A vehicle with a scanner that sees all of 270 degrees and tells a centimetre.
pub fn scenario(seed: u64) -> Scenario {
    Scenario {
        building: Building::Rooms, // not looked at: worlds and routes are given
        seed,
        limits: Limits { speed: 0.6, ..Limits::default() },
        scanner: Scanner { beams: 271, angle_increment: 1f64.to_radians(), ..Scanner::default() },
        ..Scenario::default()
    }
}

/// The same, with a scanner and wheels that make no errors.
pub fn without_noise() -> Scenario {
    let noisy = scenario(1);
    Scenario {
        scanner: Scanner { sigma: 0.0, quantum: 0.0, dropout: 0.0, ..noisy.scanner },
        wheels: WheelErrors {
            radius: [0.0; 2],
            base: 0.0,
            steering: 0.0,
            slip: 0.0,
            encoder_step: 0.0,
            final_error: None,
        },
        ..noisy
    }
}

/// A hall with a block in its middle and things along its walls.
pub fn hall() -> World {
    let v = Vector2::new;
    let mut world = World::default();
    world.rectangle(v(8.0, 5.0), v(16.0, 10.0), 0.0, WALL);
    world.rectangle(v(8.0, 5.0), v(8.0, 3.0), 0.0, WALL);
    world.rectangle(v(1.0, 9.3), v(1.2, 0.8), 0.1, FURNITURE);
    world.rectangle(v(15.2, 2.5), v(0.7, 1.6), -0.2, FURNITURE);
    world.rectangle(v(6.0, 0.4), v(2.0, 0.6), 0.05, FURNITURE);
    world.circle(v(11.0, 9.5), 0.3, FURNITURE);
    world
}

/// Around the block, `times` times, clockwise.
pub fn around(times: usize) -> Route {
    let corners = [(2.0, 2.0), (2.0, 8.0), (14.0, 8.0), (14.0, 2.0)].map(|(x, y)| Vector2::new(x, y));
    let mut route = Route::from(Vector2::new(5.0, 2.0));
    for _ in 0..times {
        corners.iter().for_each(|c| route.to(*c));
    }
    route.to(Vector2::new(5.0, 2.2));
    route
}

/// Drives it.
pub fn drive(world: World, route: &Route, scenario: &Scenario) -> Simulated {
    simulate_in(world, route, scenario, &Token::new()).unwrap()
}

/// Where the scanner of a scenario sits.
pub fn mount(scenario: &Scenario) -> Se2 {
    let [x, y, yaw] = scenario.scanner.mount;
    Se2::new(x, y, yaw)
}

/// The map of a drive, its odometry given.
pub fn map(simulated: &Simulated, odometry: &[Odometry], mount: Se2) -> MapResult {
    let mut mapper = Mapper::new(Options::default());
    let mut readings = odometry.iter().peekable();
    for scan in &simulated.scans {
        while let Some(reading) = readings.next_if(|r| r.stamp <= scan.stamp) {
            mapper.push_odometry(*reading);
        }
        mapper.push_scan(scan, &mount).unwrap();
    }
    mapper.finish(&Token::new()).unwrap()
}

/// True poses of the keyframes, seen from the first.
pub fn truth(simulated: &Simulated, result: &MapResult) -> Vec<Se2> {
    let at = |stamp: &f64| simulated.scans.iter().position(|scan| scan.stamp == *stamp).unwrap();
    let poses: Vec<Se2> = result.stamps.iter().map(|stamp| simulated.scan_poses[at(stamp)]).collect();
    poses.iter().map(|pose| poses[0].between(pose)).collect()
}

/// Largest error of a list of poses against the ground truth [m], [rad].
pub fn worst(truth: &[Se2], estimate: &[Se2]) -> (f64, f64) {
    assert_eq!(truth.len(), estimate.len());
    let errors = truth.iter().zip(estimate).map(|(t, e)| t.between(e));
    errors.fold((0.0, 0.0), |(m, r), e| (e.translation.norm().max(m), e.theta().abs().max(r)))
}

/// Closures of a verdict that passes, with the true pose of the later anchor in the earlier one.
pub fn closures(truth: &[Se2], result: &MapResult, wanted: impl Fn(Verdict) -> bool) -> Vec<(Closure, Se2)> {
    let chosen = result.closures.iter().filter(|c| wanted(c.closure.verdict));
    chosen.map(|c| (c.closure.clone(), truth[c.from].between(&truth[c.to]))).collect()
}

/// The most that the truth leaves of accepted closures in the directions that they hold [m], [rad]; their number.
pub fn worst_closure(truth: &[Se2], result: &MapResult) -> (f64, f64, usize) {
    let accepted = closures(truth, result, |verdict| verdict == Verdict::Accepted);
    let left = accepted.iter().map(|(closure, true_pose)| closure.residual(true_pose));
    left.fold((0.0, 0.0, 0), |(m, r, count), e| (e.distance.max(m), e.angle.max(r), count + 1))
}

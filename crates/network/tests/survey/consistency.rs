//! Covariances that hold, of the filter and of the batch.

use crate::runs::{Score, many, true_settings};
use groma_network::Options;
use groma_simulation::network::NetworkScene;

fn filter_only(scene: &NetworkScene) -> Options {
    Options { batch_steps: 0, ..true_settings(scene) }
}

fn as_it_is(_: &mut NetworkScene) {}

fn focal(scene: &mut NetworkScene) {
    scene.noise.focal = 0.002;
}

fn everything(scene: &mut NetworkScene) {
    scene.noise.focal = 0.002;
    (scene.noise.mount, scene.noise.mount_turn) = (0.005, 0.5f64.to_radians());
    scene.noise.view = [0.002, 0.1f64.to_radians()];
}

fn holds(score: Score, low: f64, high: f64) {
    assert!((low..=high).contains(&score.per_dof()), "{}", score.per_dof());
}

/// Filter and batch over the same runs; the filter is as accurate as the batch up to ten percent.
fn compare(name: &str, runs: u64, change: impl Fn(&mut NetworkScene), low: f64, high: f64) {
    let filter = many(name, runs, &change, filter_only);
    let batch = many(name, runs, &change, true_settings);
    holds(filter, low, high);
    holds(batch, low, high);
    assert!(filter.position < 1.1 * batch.position, "{} {}", filter.position, batch.position);
}

#[test]
fn a_corridor_is_consistent() {
    compare("corridor", 4, as_it_is, 0.6, 1.5);
}

#[test]
fn a_loop_with_unknown_focal_lengths_and_mount_is_consistent() {
    holds(many("loop", 4, everything, true_settings), 0.6, 1.5);
}

/// Every camera of the hallway to 0.10 m and 1 degree, ten laps.
#[test]
#[ignore = "statistics that take minutes"]
fn ten_hallways() {
    let score = many("hallway", 10, as_it_is, true_settings);
    holds(score, 0.7, 1.4);
    assert!(score.worst.0 <= 0.10 && score.worst.1.to_degrees() <= 1.0, "{score:?}");
}

#[test]
#[ignore = "statistics that take minutes"]
fn forty_corridors() {
    compare("corridor", 40, as_it_is, 0.85, 1.2);
}

#[test]
#[ignore = "statistics that take minutes"]
fn forty_corridors_with_unknown_focal_lengths() {
    compare("corridor", 40, focal, 0.85, 1.2);
}

#[test]
#[ignore = "statistics that take minutes"]
fn forty_times_three_laps() {
    compare("laps", 40, as_it_is, 0.85, 1.2);
}

#[test]
#[ignore = "statistics that take minutes"]
fn forty_times_three_laps_with_unknown_focal_lengths() {
    compare("laps", 40, focal, 0.85, 1.2);
}

#[test]
#[ignore = "statistics that take minutes"]
fn forty_loops_with_everything_unknown() {
    compare("laps", 40, everything, 0.85, 1.2);
}

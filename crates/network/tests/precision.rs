//! The filter in f32 against f64 over three laps, from poses of the target with known noise.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use groma_estimation::streams::{Purpose, Random};
use groma_estimation::udu::Real;
use groma_geometry::{LieGroup, Se3};
use groma_network::survey::result::errors;
use groma_network::{Floor, NetworkFilter, OdometryNoise, View};
use groma_simulation::network::{NetworkScene, simulate};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

/// Standard deviations of a view: a grid panel at three metres.
const METRES: f64 = 0.001;
const RADIANS: f64 = 0.002;

struct Run {
    nees: f64,
    dof: usize,
    least_d: f64,
    positions: Vec<nalgebra::Vector3<f64>>,
}

fn run<T: Real>(seed: u64) -> Run {
    let scene = NetworkScene::named("laps", seed).unwrap();
    let recording = simulate(&scene).unwrap();
    let mut draw = Random::new(seed, Purpose::Corners);
    let sigmas = Vector6::new(METRES, METRES, METRES, RADIANS, RADIANS, RADIANS);
    let mut filter =
        NetworkFilter::<T>::new(Se3::identity(), &DMatrix::zeros(6, 0), OdometryNoise::default(), Floor::default());
    let mut born = vec![None; scene.cameras.len()];
    let mut least_d = f64::INFINITY;
    let mut at = 0;
    for (number, stop) in recording.stops.iter().enumerate() {
        while at + 1 < recording.odometry.len() && recording.odometry[at + 1].0 <= stop.from {
            let step = recording.odometry[at].1.between(&recording.odometry[at + 1].1);
            filter.drive(&step).unwrap();
            at += 1;
        }
        filter.stop().unwrap();
        for (camera, place) in born.iter_mut().enumerate() {
            if !recording.seen.iter().any(|seen| seen.stop == number && seen.camera == camera) {
                continue;
            }
            let off = Vector6::from_fn(|k, _| sigmas[k] * draw.normal());
            let view = View {
                pose: recording.cameras[camera].between(&stop.pose) * Se3::exp(&off),
                covariance: Matrix6::from_diagonal(&sigmas.component_mul(&sigmas)),
                sensitivity: DMatrix::zeros(6, 0),
                calibration: DVector::zeros(0),
            };
            match *place {
                None => *place = Some(filter.birth(&view, &DMatrix::zeros(0, 0)).unwrap()),
                Some(k) => drop(filter.update(k, &view).unwrap()),
            }
            let d = filter.covariance().d().iter().map(|d| nalgebra::try_convert(*d).unwrap_or(f64::NAN));
            least_d = d.fold(least_d, |a: f64, b: f64| if b.is_nan() { b } else { a.min(b) });
        }
    }
    let n = filter.cameras().len();
    let mut all = DVector::zeros(6 * n);
    let mut positions = vec![];
    let world =
        |e: Vector6<f64>, pose: &Se3| groma_network::survey::result::about_own_centre(pose).try_inverse().unwrap() * e;
    for (camera, k) in born.iter().enumerate().filter_map(|(c, k)| Some((c, (*k)?))) {
        let e = errors(&filter.cameras()[k].pose, &recording.cameras[camera]);
        positions.push(filter.cameras()[k].pose.translation);
        all.rows_mut(6 * k, 6).copy_from(&world(e, &filter.cameras()[k].pose));
    }
    // Solved by the factors, in their own precision: the covariance itself may be indefinite once it is formed.
    let covariance = filter.map_covariance();
    let nees = all.dot(&covariance.lu().solve(&all).unwrap());
    Run { nees, dof: all.len(), least_d, positions }
}

fn compare(runs: u64) {
    let (mut narrow, mut wide, mut dof, mut apart, mut error) = (0.0, 0.0, 0, 0.0f64, 0.0f64);
    for seed in 1..=runs {
        let (a, b) = (run::<f32>(seed), run::<f64>(seed));
        assert!(a.least_d >= 0.0 && b.least_d >= 0.0, "{} {}", a.least_d, b.least_d);
        (narrow, wide, dof) = (narrow + a.nees, wide + b.nees, dof + b.dof);
        for (p, q) in a.positions.iter().zip(&b.positions) {
            apart = apart.max((p - q).norm());
            error = error.max(q.norm());
        }
    }
    let (narrow, wide) = (narrow / dof as f64, wide / dof as f64);
    println!(
        "{runs} runs of three laps: NEES/dof f32 {narrow:.4}, f64 {wide:.4}, largest difference of a position {apart:.2e} m"
    );
    assert!((narrow / wide - 1.0).abs() < 0.05 && (0.5..1.6).contains(&wide), "{narrow} {wide}");
    assert!(apart < 1e-2 * error);
}

#[test]
fn single_precision_gives_the_same_map() {
    compare(2);
}

#[test]
#[ignore = "statistics that take minutes"]
fn single_precision_gives_the_same_map_in_forty_runs() {
    compare(40);
}

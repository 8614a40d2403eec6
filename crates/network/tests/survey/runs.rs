//! Simulated surveys, mapped.

use groma_estimation::chi_square::probability;
use groma_models::Token;
use groma_network::survey::result::errors;
use groma_network::survey::{Detection, KnownCamera};
use groma_network::{NetworkMap, Options, Survey};
use groma_simulation::network::{NetworkRecording, NetworkScene, simulate};
use nalgebra::{DMatrix, DVector};

/// What is known of a scene before it is surveyed, and all that was recorded.
pub fn survey(scene: &NetworkScene, recording: &NetworkRecording) -> Survey {
    let focal = scene.noise.focal;
    let known = |placed: &groma_simulation::network::SceneCamera| {
        let n = placed.camera.count();
        let mut direction = DVector::zeros(n);
        direction[0] = placed.camera.parameters()[0] * focal;
        direction[1] = placed.camera.parameters()[1] * focal;
        KnownCamera {
            name: placed.name.clone(),
            camera: placed.camera.clone(),
            covariance: Some(&direction * direction.transpose()),
        }
    };
    let mut survey = Survey::new(scene.target.clone(), scene.cameras.iter().map(known).collect()).unwrap();
    for (stamp, pose) in &recording.odometry {
        assert!(survey.push_odometry(*stamp, *pose));
    }
    for seen in &recording.seen {
        let detection = Detection {
            stamp: seen.stamp,
            camera: seen.camera,
            panel: seen.panel,
            stop: None,
            ids: seen.ids.clone(),
            pixels: seen.pixels.clone(),
            sigmas: vec![scene.noise.corner.max(0.01); seen.ids.len()],
        };
        assert!(survey.push_detection(detection));
    }
    survey
}

/// The settings that say what is wrong with a scene, no more and no less.
pub fn true_settings(scene: &NetworkScene) -> Options {
    let walk = &scene.noise.odometry;
    let mut options = Options::default();
    options.odometry.along = walk.along;
    options.odometry.across = walk.across;
    options.odometry.heading = walk.heading;
    options.odometry.turning = walk.turning;
    options.floor.height = scene.noise.floor_height;
    options.floor.tilt = scene.noise.floor_tilt;
    options.mount.position = scene.noise.mount;
    options.mount.height = scene.noise.mount;
    options.mount.rotation = scene.noise.mount_turn;
    options.view.position = scene.noise.view[0];
    options.view.rotation = scene.noise.view[1];
    options
}

/// How far a map is from the truth.
#[derive(Clone, Copy, Debug, Default)]
pub struct Score {
    /// Sum of squares of the errors of all cameras in units of the joint covariance, and degrees of freedom.
    pub nees: (f64, usize),
    /// Mean error of position [m].
    pub position: f64,
    /// Largest error of position [m] and of rotation [rad].
    pub worst: (f64, f64),
    /// How far odometry alone is off at the end [m].
    pub odometry: f64,
}

pub fn map(scene: &NetworkScene, options: &Options) -> (NetworkMap, Score) {
    let recording = simulate(scene).unwrap();
    let map = survey(scene, &recording).finish(options, &Token::new()).unwrap();
    let score = score(&map, &recording);
    (map, score)
}

pub fn score(map: &NetworkMap, recording: &NetworkRecording) -> Score {
    let current: Vec<usize> = (0..map.cameras.len()).filter(|&k| map.cameras[k].current).collect();
    let mut score = Score::default();
    let mut all = DVector::zeros(6 * current.len());
    for (row, &k) in current.iter().enumerate() {
        let e = errors(&map.cameras[k].pose, &recording.cameras[map.cameras[k].camera]);
        let (metres, radians) = (e.fixed_rows::<3>(0).norm(), e.fixed_rows::<3>(3).norm());
        score.position += metres / current.len() as f64;
        score.worst = (score.worst.0.max(metres), score.worst.1.max(radians));
        all.rows_mut(6 * row, 6).copy_from(&e);
    }
    let joint = map.joint.as_ref().unwrap();
    let covariance =
        DMatrix::from_fn(all.len(), all.len(), |i, j| joint[(6 * current[i / 6] + i % 6, 6 * current[j / 6] + j % 6)]);
    score.nees = (all.dot(&covariance.cholesky().unwrap().solve(&all)), all.len());
    let (first, last) = (&recording.stops[0], recording.stops.last().unwrap());
    let end = map.odometry.last().unwrap();
    let off = first.pose.translation + nalgebra::Vector3::new(end.x(), end.y(), 0.0) - last.pose.translation;
    score.odometry = off.xy().norm();
    score
}

/// Many runs: NEES per degree of freedom, mean position error [m], mean of the odometry's error at the end [m].
pub fn many(
    name: &str,
    runs: u64,
    change: impl Fn(&mut NetworkScene),
    options: impl Fn(&NetworkScene) -> Options,
) -> Score {
    let mut total = Score::default();
    for seed in 1..=runs {
        let mut scene = NetworkScene::named(name, seed).unwrap();
        change(&mut scene);
        let (_, score) = map(&scene, &options(&scene));
        total.nees = (total.nees.0 + score.nees.0, total.nees.1 + score.nees.1);
        total.position += score.position / runs as f64;
        total.odometry += score.odometry / runs as f64;
        total.worst = (total.worst.0.max(score.worst.0), total.worst.1.max(score.worst.1));
    }
    let per_dof = total.nees.0 / total.nees.1 as f64;
    let p = probability(total.nees.0, total.nees.1);
    println!(
        "{name}, {runs} runs: NEES/dof {per_dof:.3} (P {p:.3}), mean camera error {:.4} m, worst {:.3} m {:.3} deg, odometry {:.2} m",
        total.position,
        total.worst.0,
        total.worst.1.to_degrees(),
        total.odometry
    );
    total
}

impl Score {
    pub fn per_dof(&self) -> f64 {
        self.nees.0 / self.nees.1 as f64
    }
}

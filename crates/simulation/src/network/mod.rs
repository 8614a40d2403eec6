//! Fixed cameras that never share a view, and a robot that carries a target past them.
//!
//! A [`NetworkScene`] says where everything is and what is wrong with it; [`simulate`] draws the errors from its seed and
//! turns it into what a recorder would have: odometry, and the corners that each camera sees at each stop; the truth
//! beside it. Frame W: the robot's level start pose, z up, the floor at z = 0.
//!
//! Models: odometry `T' = T Exp(u) Exp(w)`, w a random walk ([`WalkNoise`]); at each stop the robot stands unevenly by
//! normal height, roll and pitch; each camera's focal length is off by a relative error; the target is mounted askew;
//! corners have normal noise. Panels hide nothing but what looks away from the camera; nothing else stands in the way.

pub mod drive;
pub mod images;
pub mod scenes;
pub mod view;

pub use drive::{NetworkDrive, Stop};
pub use scenes::NETWORK_SCENES;
pub use view::SeenPanel;

use crate::error::SimulationError;
use groma_estimation::streams::{Purpose, Random};
use groma_geometry::{LieGroup, Se2, Se3};
use groma_models::{Camera, Target};
use nalgebra::Vector6;
use serde::{Deserialize, Serialize};

/// A camera of the building.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SceneCamera {
    /// Its name.
    pub name: String,
    /// The assumed lens; the true focal length may differ.
    pub camera: Camera,
    /// `T_W_C`: x, y, z [m].
    pub position: [f64; 3],
    /// Heading of the optical axis [rad].
    pub heading: f64,
    /// How far the axis looks below the horizon [rad].
    pub down: f64,
}

/// The random walk of odometry, as the estimator knows it: per root of a metre, and of a radian for `turning`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WalkNoise {
    /// Along the path [m/sqrt(m)].
    pub along: f64,
    /// Across the path [m/sqrt(m)].
    pub across: f64,
    /// Heading [rad/sqrt(m)].
    pub heading: f64,
    /// Heading [rad/sqrt(rad)].
    pub turning: f64,
}

/// What is wrong: standard deviations.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkNoise {
    /// Odometry.
    pub odometry: WalkNoise,
    /// A corner's coordinate [pixel].
    pub corner: f64,
    /// Height of the robot at a stop [m].
    pub floor_height: f64,
    /// Roll and pitch of the robot at a stop [rad].
    pub floor_tilt: f64,
    /// Relative error of each camera's focal length.
    pub focal: f64,
    /// Position of the target on the robot, each axis [m]; its height too.
    pub mount: f64,
    /// Rotation of the target on the robot, each axis [rad].
    pub mount_turn: f64,
    /// Error of a view's pose that no corner noise explains: position [m] and rotation [rad], each axis.
    pub view: [f64; 2],
}

/// Everything that a simulation depends on.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkScene {
    /// Seed of everything random.
    pub seed: u64,
    /// The cameras.
    pub cameras: Vec<SceneCamera>,
    /// The target in the frame of the robot, as assumed.
    pub target: Target,
    /// Where the robot stops: x, y, heading; it drives straight from one to the next and turns in place. The first one
    /// is the start and has the pose (0, 0, 0).
    pub stops: Vec<[f64; 3]>,
    /// What is wrong.
    pub noise: NetworkNoise,
    /// Images that each camera takes at a stop.
    pub frames: usize,
    /// A camera that is hit on the way, if any.
    pub bump: Option<Bump>,
}

/// A camera that does not stay where it is.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Bump {
    /// Name of the camera.
    pub camera: String,
    /// From this stop on.
    pub stop: usize,
    /// The motion, in the frame of the camera: x, y, z [m], rotation vector [rad].
    pub motion: [f64; 6],
}

impl SceneCamera {
    /// `T_W_C`: z along the axis, x to the right of the image, y down.
    #[must_use]
    pub fn t_w_c(&self) -> Se3 {
        let turn =
            |axis: usize, angle: f64| Se3::exp(&Vector6::from_fn(|k, _| if k == 3 + axis { angle } else { 0.0 }));
        // Ahead, right, down: from x forward, y left, z up.
        let optical = turn(2, -std::f64::consts::FRAC_PI_2) * turn(0, -std::f64::consts::FRAC_PI_2);
        let rotation = turn(2, self.heading) * turn(1, self.down) * optical;
        Se3 { translation: self.position.into(), ..rotation }
    }
}

/// A simulated survey and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct NetworkRecording {
    /// Stamps and poses of the odometry, from the identity on.
    pub odometry: Vec<(f64, Se2)>,
    /// What is seen, in order of stop, camera, frame and panel.
    pub seen: Vec<SeenPanel>,
    /// Time, number and true pose `T_W_R` of each stop.
    pub stops: Vec<Stop>,
    /// True `T_W_C` of each camera, after a bump.
    pub cameras: Vec<Se3>,
    /// True lenses.
    pub lenses: Vec<Camera>,
    /// True error of the target on the robot: `T_R_B = Exp(mu)`, applied to the believed panels.
    pub mount: Se3,
}

impl NetworkScene {
    /// The scene called `name`.
    ///
    /// # Errors
    /// When there is none of that name.
    pub fn named(name: &str, seed: u64) -> Result<Self, SimulationError> {
        scenes::named(name, seed)
    }

    /// Refuses what makes no sense.
    ///
    /// # Errors
    /// [`SimulationError`], which says what.
    pub fn check(&self) -> Result<(), SimulationError> {
        let n = &self.noise;
        let walk = [n.odometry.along, n.odometry.across, n.odometry.heading, n.odometry.turning];
        let rest = [n.corner, n.floor_height, n.floor_tilt, n.focal, n.mount, n.mount_turn, n.view[0], n.view[1]];
        for value in walk.into_iter().chain(rest) {
            if !(0.0..=1e3).contains(&value) {
                return Err(SimulationError::Setting { name: "noise", value, rule: "must be from 0 to 1000" });
            }
        }
        for value in self.stops.iter().flatten().copied() {
            if value.is_nan() || value.abs() > 1e4 {
                return Err(SimulationError::Setting { name: "stops", value, rule: "must be within 10 km" });
            }
        }
        if !(1..=1000).contains(&self.frames.max(1)) {
            let (name, value, rule) = ("frames", self.frames as f64, "must be at most 1000");
            return Err(SimulationError::Setting { name, value, rule });
        }
        if self.stops.len() < 2 {
            return Err(SimulationError::EmptyRoute);
        }
        self.target.check().map_err(|e| SimulationError::Scene(e.to_string()))
    }
}

/// Drives through a scene.
///
/// # Errors
/// What [`NetworkScene::check`] refuses.
pub fn simulate(scene: &NetworkScene) -> Result<NetworkRecording, SimulationError> {
    scene.check()?;
    let mut lens = Random::new(scene.seed, Purpose::Lenses);
    let mut lenses = Vec::with_capacity(scene.cameras.len());
    for camera in &scene.cameras {
        lenses.push(true_lens(&camera.camera, 1.0 + scene.noise.focal * lens.normal())?);
    }
    let mut mounting = Random::new(scene.seed, Purpose::Mounting);
    let sigmas = [scene.noise.mount, scene.noise.mount_turn];
    let mount = Se3::exp(&Vector6::from_fn(|k, _| sigmas[k / 3] * mounting.normal()));
    let drive = drive::drive(scene);
    let truth = view::Truth { lenses: &lenses, mount };
    let seen = view::all(scene, &drive.stops, &truth);
    let last = scene.stops.len();
    let cameras = (0..scene.cameras.len()).map(|k| view::camera_at(scene, k, last)).collect();
    Ok(NetworkRecording { odometry: drive.odometry, seen, stops: drive.stops, cameras, lenses, mount })
}

fn true_lens(believed: &Camera, scale: f64) -> Result<Camera, SimulationError> {
    let mut parameters = believed.parameters().to_vec();
    parameters[0] *= scale;
    parameters[1] *= scale;
    believed.with_parameters(parameters).map_err(|e| SimulationError::Scene(e.to_string()))
}

//! The map of a network: values only.

use super::alarm::{Moved, Slip, slip};
use super::filtering::Filtered;
use super::judged::Judged;
use super::refine::Refined;
use super::{Halt, Survey};
use crate::batch::{Lens, Residuals};
use groma_geometry::{LieGroup, Se2, Se3, Separation};
use groma_models::Camera;
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};
use std::f64::consts::PI;

/// A variance of the mount below this is that of a direction that was held.
const HELD: f64 = 1e-13;
/// A direction is weak when its standard deviation is so many times the largest across it,
const WEAK_SHARE: f64 = 3.0;
/// and no less than this [m].
const WEAK_LEAST: f64 = 0.02;
/// A direction is the height when its vertical part is more than this.
const VERTICAL: f64 = 0.9;

/// Where a camera is and what is known of it.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraResult {
    /// Number of the camera.
    pub camera: usize,
    /// Number of the stop from which on it is there.
    pub since: usize,
    /// Whether it is there still.
    pub current: bool,
    /// `T_W_C`.
    pub pose: Se3,
    /// Covariance of position [m] and rotation [rad], both in the axes of the world: x, y, z, rot x, rot y, rot z.
    pub covariance: Matrix6<f64>,
    /// Its intrinsics after the survey.
    pub intrinsics: Camera,
    /// Covariance of their parameters.
    pub intrinsics_covariance: DMatrix<f64>,
    /// Views that hold it.
    pub views: usize,
    /// Sum of squares of its corners, in standard deviations, and their number of coordinates.
    pub chi_square: (f64, usize),
}

/// The map.
#[derive(Clone, Debug)]
pub struct NetworkMap {
    /// Places of cameras, in the order in which they were first seen.
    pub cameras: Vec<CameraResult>,
    /// Joint covariance of all of them, six rows each as in [`CameraResult::covariance`]; nothing for a large network.
    pub joint: Option<DMatrix<f64>>,
    /// Number of the halt, pose `T_W_R` and its covariance (position, rotation) at each stop used in the map.
    pub stops: Vec<(usize, Se3, Matrix6<f64>)>,
    /// Mean time of what was seen at each halt [s].
    pub stamps: Vec<f64>,
    /// Odometry alone at each halt, from the first.
    pub odometry: Vec<Se2>,
    /// `T_R_B`: what is left to add to the target file, and the covariance of mu.
    pub mount: (Se3, Matrix6<f64>),
    /// All views.
    pub judged: Vec<Judged>,
    /// Which views the map rests on, by their number in `judged`.
    pub used: Vec<usize>,
    /// Cameras that were moved.
    pub moved: Vec<Moved>,
    /// Whether the odometry seems to have slipped.
    pub slip: Option<Slip>,
    /// What is left.
    pub residuals: Residuals,
    /// Unknowns of the batch that are not determined by a prior alone.
    pub unknowns: usize,
    /// Steps of the batch, and whether it converged.
    pub steps: (usize, bool),
}

/// The direction in which the position of a camera is known far worse than across it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WeakDirection {
    /// Standard deviation along it [m].
    pub sigma: f64,
    /// Largest standard deviation across it [m].
    pub across: f64,
    /// Unit vector along it, in the axes of the world.
    pub direction: Vector3<f64>,
}

impl WeakDirection {
    /// Whether it is the height.
    #[must_use]
    pub fn is_vertical(&self) -> bool {
        self.direction.z.abs() > VERTICAL
    }

    /// Its direction in the floor, from the x axis of the map, 0 to pi [rad].
    #[must_use]
    pub fn azimuth(&self) -> f64 {
        self.direction.y.atan2(self.direction.x).rem_euclid(PI)
    }
}

impl CameraResult {
    /// Standard deviation of the position along its worst direction [m].
    #[must_use]
    pub fn sigma_position(&self) -> f64 {
        sigma_position(&self.covariance)
    }

    /// Standard deviation of the rotation about its worst axis [rad].
    #[must_use]
    pub fn sigma_rotation(&self) -> f64 {
        sigma_rotation(&self.covariance)
    }

    /// Chi-square of its corners per degree of freedom: the pose of the robot at each view takes up six.
    #[must_use]
    pub fn chi_square_per_dof(&self) -> f64 {
        let (sum, count) = self.chi_square;
        sum / count.saturating_sub(6 * self.views).max(1) as f64
    }

    /// Where its position is known far worse along one direction than across it.
    #[must_use]
    pub fn weak_direction(&self) -> Option<WeakDirection> {
        let eigen = self.covariance.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigen();
        let last = eigen.eigenvalues.imax();
        let sigma = |k: usize| eigen.eigenvalues[k].max(0.0).sqrt();
        let across = (0..3).filter(|k| *k != last).map(sigma).fold(0.0, f64::max);
        let direction = eigen.eigenvectors.column(last).into_owned();
        let weak = sigma(last) >= WEAK_SHARE * across && sigma(last) >= WEAK_LEAST;
        weak.then(|| WeakDirection { sigma: sigma(last), across, direction })
    }

    /// How far it is from here to another place of the camera.
    #[must_use]
    pub fn separation(&self, other: &Self) -> Separation {
        let motion = self.pose.inverse() * other.pose;
        Separation {
            distance: (other.pose.translation - self.pose.translation).norm(),
            angle: motion.rotation.quaternion.angle(),
        }
    }
}

/// Standard deviation of a position along its worst direction, by the covariance of position and rotation [m].
#[must_use]
pub fn sigma_position(covariance: &Matrix6<f64>) -> f64 {
    largest_sigma(covariance.fixed_view::<3, 3>(0, 0).into_owned())
}

/// Standard deviation of a rotation about its worst axis, by the covariance of position and rotation [rad].
#[must_use]
pub fn sigma_rotation(covariance: &Matrix6<f64>) -> f64 {
    largest_sigma(covariance.fixed_view::<3, 3>(3, 3).into_owned())
}

fn largest_sigma(covariance: Matrix3<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
}

impl NetworkMap {
    /// Chi-square of all corners per degree of freedom; none without any.
    #[must_use]
    pub fn corner_chi_square(&self) -> Option<f64> {
        let (sum, count) = self.residuals.corners();
        (count > self.unknowns).then(|| sum / (count - self.unknowns) as f64)
    }

    /// Standard deviation of the height that all cameras share with the target on the robot [m]; 0 where it was given.
    #[must_use]
    pub fn height_sigma(&self) -> f64 {
        self.mount.1[(2, 2)].max(0.0).sqrt()
    }

    /// How far odometry alone ends from the last stop of the map [m].
    #[must_use]
    pub fn odometry_error(&self) -> Option<f64> {
        let (halt, pose, _) = self.stops.last()?;
        Some((self.odometry.get(*halt)?.translation - pose.translation.xy()).norm())
    }

    /// Length of the straight lines from stop to stop, by odometry [m].
    #[must_use]
    pub fn path_length(&self) -> f64 {
        self.odometry.windows(2).map(|pair| (pair[1].translation - pair[0].translation).norm()).sum()
    }
}

pub(super) fn assemble(
    s: &Survey,
    lenses: &[Lens],
    halts: &[Halt],
    filtered: &Filtered,
    refined: Refined,
) -> NetworkMap {
    let Refined { solution, halts: stops, views } = refined;
    let state = &solution.state;
    let turned: Vec<Matrix6<f64>> = state.places.iter().map(about_own_centre).collect();
    let camera = |k: usize| {
        let place = filtered.places[k];
        let lens = &lenses[place.camera];
        let own = views.iter().zip(&solution.residuals.views);
        let own: Vec<_> = own.filter(|(j, _)| filtered.judged[**j].place == Some(k)).map(|(_, chi)| *chi).collect();
        CameraResult {
            camera: place.camera,
            since: place.since,
            current: !filtered.moved.iter().any(|moved| moved.from == k),
            pose: state.places[k],
            covariance: turned[k] * solution.spread.places[k] * turned[k].transpose(),
            intrinsics: lens.calibrated(&state.calibrations[place.camera]),
            intrinsics_covariance: &lens.basis * &solution.spread.calibrations[place.camera] * lens.basis.transpose(),
            views: own.len(),
            chi_square: own.iter().fold((0.0, 0), |sum, chi| (sum.0 + chi.0, sum.1 + chi.1)),
        }
    };
    let unknowns = 6 * (stops.len() + state.places.len()) - 3;
    NetworkMap {
        cameras: (0..state.places.len()).map(camera).collect(),
        joint: solution.spread.joint.as_ref().map(|joint| turned_all(joint, &turned)),
        stops: stops
            .iter()
            .zip(state.stops.iter().zip(&solution.spread.stops))
            .map(|(&halt, (pose, covariance))| {
                let turn = about_own_centre(pose);
                (halt, *pose, turn * covariance * turn.transpose())
            })
            .collect(),
        stamps: halts.iter().map(|halt| halt.stamp).collect(),
        odometry: halts.iter().map(|halt| halts[0].pose.between(&halt.pose)).collect(),
        mount: (state.mount, solution.spread.mount.map(|v| if v.abs() < HELD { 0.0 } else { v })),
        judged: filtered.judged.clone(),
        used: views,
        slip: slip(&filtered.moved, s.cameras.len()),
        moved: filtered.moved.clone(),
        residuals: solution.residuals,
        unknowns,
        steps: (solution.iterations, solution.converged),
    }
}

/// From the world-frame error of a pose to the errors of its position and rotation, both in the axes of the world:
/// `dp = rho + w x p`.
#[must_use]
pub fn about_own_centre(pose: &Se3) -> Matrix6<f64> {
    let mut turn = Matrix6::identity();
    turn.fixed_view_mut::<3, 3>(0, 3).copy_from(&-pose.translation.cross_matrix());
    turn
}

fn turned_all(joint: &DMatrix<f64>, turned: &[Matrix6<f64>]) -> DMatrix<f64> {
    let mut out = joint.clone();
    for (i, a) in turned.iter().enumerate() {
        for (j, b) in turned.iter().enumerate() {
            let block = a * joint.fixed_view::<6, 6>(6 * i, 6 * j) * b.transpose();
            out.fixed_view_mut::<6, 6>(6 * i, 6 * j).copy_from(&block);
        }
    }
    out
}

/// The errors of position and rotation of an estimate, in the axes of the world.
#[must_use]
pub fn errors(estimate: &Se3, truth: &Se3) -> nalgebra::Vector6<f64> {
    about_own_centre(estimate) * (*truth * estimate.inverse()).log()
}

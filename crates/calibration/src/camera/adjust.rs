//! Joint refinement of a camera and all panel poses: `minimise sum |r|^2` by Levenberg-Marquardt, poses eliminated.
//!
//! With the blocks of view j, `W_j = J_T^T J_T`, `V_j = J_theta^T J_T`, `A = sum J_theta^T J_theta`:
//!
//! ```text
//! S = A - sum V_j W_j^-1 V_j^T                 information of the parameters, poses eliminated
//! S d_theta = -(g_theta - sum V_j W_j^-1 g_j),  d_j = -W_j^-1 (g_j + V_j^T d_theta)
//! ```
//!
//! The diagonals of A and W are damped (Marquardt). Only the `free` parameters move. Source: Triggs et al., "Bundle
//! adjustment", 2000, section 6.1.

use super::normal::{Block, MAX, block, squared_error};
use super::view::View;
use groma_estimation::levenberg_marquardt::{Minimum, Options, Problem, minimize};
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Cancelled, Token};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, SVector, Vector6};

/// The end is reached when a step promises to lower the squared error e by less than this share of `1 + e`.
const TOLERANCE: f64 = 1e-9;

/// A camera and the poses of the panels, one a view.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub camera: Camera,
    pub poses: Vec<Se3>,
}

/// Where the refinement ended.
#[derive(Clone, Debug)]
pub(super) struct Adjusted {
    pub state: State,
    pub error: f64,
    pub converged: bool,
}

/// Refines a state; nothing when it does not see its own corners, or the work is cancelled.
pub(super) fn adjust(
    start: State,
    views: &[View],
    free: &[bool],
    most_steps: usize,
    token: &Token,
) -> Option<Adjusted> {
    let blocks = Vec::new();
    let options = Options { max_iterations: most_steps, tolerance: TOLERANCE };
    let end = minimize(&mut Adjustment { views, free, token, blocks }, start, &options).ok()?;
    end.map(|Minimum { state, cost, converged, .. }| Adjusted { state, error: cost, converged })
}

/// Camera and poses as a problem: the step of the parameters, and of the poses.
struct Adjustment<'a> {
    views: &'a [View],
    free: &'a [bool],
    token: &'a Token,
    blocks: Vec<Block>,
}

type Step = (SVector<f64, MAX>, Vec<Vector6<f64>>);

impl Problem for Adjustment<'_> {
    type State = State;
    type Step = Step;
    type Error = Cancelled;

    fn cost(&mut self, at: &State) -> Result<Option<f64>, Cancelled> {
        Ok(total_error(at, self.views))
    }

    fn linearize(&mut self, at: &State) -> Result<(), Cancelled> {
        self.blocks = blocks(at, self.views).unwrap_or_default();
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Step, f64)>, Cancelled> {
        self.token.check()?;
        Ok(step(&self.blocks, self.free, damping))
    }

    fn moved(&self, at: &State, (by, poses): &Step) -> Option<State> {
        let parameters = at.camera.parameters().iter().zip(by.iter()).map(|(p, d)| p + d).collect();
        let camera = at.camera.with_parameters(parameters).ok()?;
        Some(State { camera, poses: at.poses.iter().zip(poses).map(|(pose, d)| pose.plus(d)).collect() })
    }
}

/// The blocks of all views.
pub(super) fn blocks(state: &State, views: &[View]) -> Option<Vec<Block>> {
    views.iter().zip(&state.poses).map(|(view, pose)| block(&state.camera, pose, &view.corners)).collect()
}

fn total_error(state: &State, views: &[View]) -> Option<f64> {
    views.iter().zip(&state.poses).map(|(view, pose)| squared_error(&state.camera, pose, &view.corners)).sum()
}

/// The information that one view gives of the parameters, its pose eliminated.
pub(super) fn reduced(block: &Block) -> Option<SMatrix<f64, MAX, MAX>> {
    Some(block.camera - block.cross * block.pose.cholesky()?.solve(&block.cross.transpose()))
}

/// The damped step with the poses eliminated, and its promise.
fn step(blocks: &[Block], free: &[bool], damping: f64) -> Option<(Step, f64)> {
    let (mut information, mut gradient) = (SMatrix::<f64, MAX, MAX>::zeros(), SVector::<f64, MAX>::zeros());
    let mut inverses = Vec::with_capacity(blocks.len());
    for block in blocks {
        let inverse = damped(&block.pose, damping).try_inverse()?;
        information += block.camera - block.cross * inverse * block.cross.transpose();
        gradient += block.camera_gradient - block.cross * inverse * block.pose_gradient;
        inverses.push(inverse);
    }
    let diagonal = blocks.iter().map(|b| b.camera.diagonal()).sum::<SVector<f64, MAX>>() * damping;
    information += SMatrix::from_diagonal(&diagonal);
    let by = -solve_free(&information, &gradient, free)?;
    let pose = |(block, inverse): (&Block, &Matrix6<f64>)| -> Vector6<f64> {
        -inverse * (block.cross.transpose() * by + block.pose_gradient)
    };
    let poses: Vec<Vector6<f64>> = blocks.iter().zip(&inverses).map(pose).collect();
    let of_camera =
        diagonal.component_mul(&by).dot(&by) - blocks.iter().map(|b| b.camera_gradient.dot(&by)).sum::<f64>();
    let of_pose = |(block, d): (&Block, &Vector6<f64>)| {
        (block.pose.diagonal().component_mul(d) * damping - block.pose_gradient).dot(d)
    };
    let promise = of_camera + blocks.iter().zip(&poses).map(of_pose).sum::<f64>();
    Some(((by, poses), promise))
}

fn damped(information: &Matrix6<f64>, damping: f64) -> Matrix6<f64> {
    information + Matrix6::from_diagonal(&(information.diagonal() * damping))
}

/// The solution in the free unknowns; zero in the others.
fn solve_free(
    information: &SMatrix<f64, MAX, MAX>,
    gradient: &SVector<f64, MAX>,
    free: &[bool],
) -> Option<SVector<f64, MAX>> {
    let index: Vec<usize> = (0..free.len()).filter(|&k| free[k]).collect();
    let part = DMatrix::from_fn(index.len(), index.len(), |i, j| information[(index[i], index[j])]);
    let right = DVector::from_fn(index.len(), |i, _| gradient[index[i]]);
    let solution = part.cholesky()?.solve(&right);
    let mut full = SVector::zeros();
    index.iter().zip(solution.iter()).for_each(|(&k, value)| full[k] = *value);
    solution.iter().all(|v| v.is_finite()).then_some(full)
}

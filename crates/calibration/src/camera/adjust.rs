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
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Token};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, SVector, Vector6};

const FIRST_DAMPING: f64 = 1e-4;
const LAST_DAMPING: f64 = 1e10;
/// The end is reached when a step lowers the squared error by less than this share.
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

/// Refines a state; nothing when it does not see its own corners. Of cancelled work, where it was.
pub(super) fn adjust(
    start: State,
    views: &[View],
    free: &[bool],
    most_steps: usize,
    token: &Token,
) -> Option<Adjusted> {
    let mut at = Adjusted { error: total_error(&start, views)?, state: start, converged: false };
    let mut damping = FIRST_DAMPING;
    for _ in 0..most_steps {
        if token.is_cancelled() {
            break;
        }
        let blocks = blocks(&at.state, views)?;
        let next = loop {
            let next = step(&at.state, &blocks, free, damping)
                .and_then(|state| Some((total_error(&state, views)?, state)))
                .filter(|next| next.0 <= at.error);
            match next {
                Some(next) => break next,
                None if damping > LAST_DAMPING => return Some(Adjusted { converged: true, ..at }),
                None => damping *= 10.0,
            }
        };
        let small = at.error - next.0 <= TOLERANCE * at.error + 1e-18;
        at = Adjusted { error: next.0, state: next.1, converged: small && damping <= 1.0 };
        damping = (0.1 * damping).max(1e-12);
        if at.converged {
            break;
        }
    }
    Some(at)
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

fn step(state: &State, blocks: &[Block], free: &[bool], damping: f64) -> Option<State> {
    let (mut information, mut gradient) = (SMatrix::<f64, MAX, MAX>::zeros(), SVector::<f64, MAX>::zeros());
    let mut inverses = Vec::with_capacity(blocks.len());
    for block in blocks {
        let inverse = damped(&block.pose, damping).try_inverse()?;
        information += block.camera - block.cross * inverse * block.cross.transpose();
        gradient += block.camera_gradient - block.cross * inverse * block.pose_gradient;
        inverses.push(inverse);
    }
    let diagonal = blocks.iter().map(|b| b.camera.diagonal()).sum::<SVector<f64, MAX>>();
    information += SMatrix::from_diagonal(&(diagonal * damping));
    let by = solve_free(&information, &gradient, free)?;
    let moved = state.camera.parameters().iter().zip(by.iter()).map(|(p, d)| p - d).collect();
    let camera = state.camera.with_parameters(moved).ok()?;
    let pose = |(pose, (block, inverse)): (&Se3, (&Block, &Matrix6<f64>))| {
        let d: Vector6<f64> = inverse * (block.cross.transpose() * by - block.pose_gradient);
        pose.plus(&d)
    };
    Some(State { camera, poses: state.poses.iter().zip(blocks.iter().zip(&inverses)).map(pose).collect() })
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

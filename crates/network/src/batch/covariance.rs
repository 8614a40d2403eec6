//! What the batch knows of its estimates: covariances of world-frame errors.

use super::B;
use nalgebra::{DMatrix, Matrix6};

/// Covariances at the solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Spread {
    /// Of each stop's pose.
    pub stops: Vec<Matrix6<f64>>,
    /// Of each place's pose.
    pub places: Vec<Matrix6<f64>>,
    /// Of the calibration states of each lens.
    pub calibrations: Vec<DMatrix<f64>>,
    /// Of the mount; zero in the directions that are held.
    pub mount: Matrix6<f64>,
    /// Of all places' poses together, six rows each; nothing for a network too large for it.
    pub joint: Option<DMatrix<f64>>,
}

impl Spread {
    /// Most places and lenses together for which the joint covariance is computed.
    pub const JOINT_BLOCKS: usize = 200;

    pub(super) fn new(
        diagonal: &[Matrix6<f64>],
        joint: Option<DMatrix<f64>>,
        [places, lenses, mount]: [usize; 3],
        sizes: Vec<usize>,
    ) -> Self {
        let calibration = |(block, &m): (&Matrix6<f64>, &usize)| block.view((0, 0), (m, m)).clone_owned();
        let poses = (lenses - places) * B;
        Self {
            stops: diagonal[..places].to_vec(),
            places: diagonal[places..lenses].to_vec(),
            calibrations: diagonal[lenses..mount]
                .iter()
                .zip(&sizes)
                .map(|pair| DMatrix::from_iterator(*pair.1, *pair.1, calibration(pair).iter().copied()))
                .collect(),
            mount: diagonal[mount],
            joint: joint.map(|all| all.view((0, 0), (poses, poses)).into_owned()),
        }
    }
}

//! The normal equations in blocks of six: one per stop, a place, a lens, and one for the mount.
//!
//! Calibration states that a lens does not have, and directions of the mount that are held, get the equation `x = 0`.

use super::{B, Batch, Spread, State};
use crate::Error;
use groma_estimation::{BlockMatrix, Cholesky};
use groma_models::Token;
use nalgebra::{DMatrix, SMatrix, SVector};

type Block = SMatrix<f64, B, B>;

/// `A x = -g`.
pub(crate) struct System {
    matrix: BlockMatrix<B>,
    gradient: Vec<SVector<f64, B>>,
    cholesky: Cholesky<B>,
    places: usize,
    lenses: usize,
    mount: usize,
}

impl System {
    pub fn new(batch: &Batch, state: &State) -> Result<Self, Error> {
        let [_, places, lenses, mount] = state.blocks();
        let chain = (1..state.stops.len()).map(|k| (k - 1, k));
        let views = batch.views.iter().flat_map(|v| {
            let (stop, place, lens) = (v.stop, places + v.place, lenses + v.lens);
            [(stop, place), (stop, lens), (stop, mount), (place, lens), (place, mount), (lens, mount)]
        });
        let matrix = BlockMatrix::zeros(mount + 1, chain.chain(views));
        let cholesky = Cholesky::analyze(&matrix)?;
        let gradient = vec![SVector::zeros(); mount + 1];
        Ok(Self { matrix, gradient, cholesky, places, lenses, mount })
    }

    pub fn clear(&mut self) {
        self.matrix.clear();
        self.gradient.fill(SVector::zeros());
    }

    /// Adds a residual's share: blocks with the derivative of the whitened residual in each.
    pub fn add<const R: usize>(&mut self, parts: &[(usize, SMatrix<f64, R, B>)], residual: &SVector<f64, R>) {
        for (k, (i, j_i)) in parts.iter().enumerate() {
            self.gradient[*i] += j_i.transpose() * residual;
            self.matrix.diagonal[*i] += j_i.transpose() * j_i;
            for (j, j_j) in &parts[k + 1..] {
                self.couple(*i, *j, &(j_i.transpose() * j_j));
            }
        }
    }

    pub fn add_diagonal(&mut self, i: usize, block: &Block, gradient: &SVector<f64, B>) {
        self.matrix.diagonal[i] += block;
        self.gradient[i] += gradient;
    }

    pub fn couple(&mut self, i: usize, j: usize, block: &Block) {
        let slot = self.matrix.slot(i.min(j), i.max(j));
        if let Some(upper) = slot.and_then(|s| self.matrix.upper.get_mut(s)) {
            *upper += if i < j { *block } else { block.transpose() };
        }
    }

    /// The damped step and by how much it lowers the linear model.
    pub fn step(&mut self, damping: f64) -> Result<(Vec<SVector<f64, B>>, f64), Error> {
        let mut damped = self.matrix.clone();
        for block in &mut damped.diagonal {
            for k in 0..B {
                block[(k, k)] *= 1.0 + damping;
            }
        }
        self.cholesky.factorize(&damped)?;
        let mut step = self.cholesky.solve(&self.gradient)?;
        step.iter_mut().for_each(|block| *block = -*block);
        let promise = -step.iter().zip(&self.gradient).map(|(d, g)| d.dot(g)).sum::<f64>();
        Ok((step, promise))
    }

    /// The covariances at the last linearisation.
    pub fn spread(mut self, batch: &Batch, token: &Token) -> Result<Spread, Error> {
        token.check()?;
        self.cholesky.factorize(&self.matrix)?;
        let selected = self.cholesky.selected_inverse();
        let map: Vec<usize> = (self.places..self.mount).collect();
        let joint = if map.len() <= Spread::JOINT_BLOCKS { Some(self.joint(&map, token)?) } else { None };
        let sizes = batch.lenses.iter().map(|lens| lens.basis.ncols()).collect();
        Ok(Spread::new(&selected.diagonal, joint, [self.places, self.lenses, self.mount], sizes))
    }

    /// The joint covariance of some blocks, by solving for the columns of the identity.
    fn joint(&mut self, blocks: &[usize], token: &Token) -> Result<DMatrix<f64>, Error> {
        let mut joint = DMatrix::zeros(blocks.len() * B, blocks.len() * B);
        for (column, &block) in blocks.iter().enumerate() {
            token.check()?;
            for k in 0..B {
                let mut unit = vec![SVector::zeros(); self.gradient.len()];
                unit[block][k] = 1.0;
                let solved = self.cholesky.solve(&unit)?;
                for (row, &other) in blocks.iter().enumerate() {
                    joint.view_mut((row * B, column * B + k), (B, 1)).copy_from(&solved[other]);
                }
            }
        }
        Ok((&joint + joint.transpose()) / 2.0)
    }
}

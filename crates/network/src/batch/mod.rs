//! All at once: robot poses, cameras, calibrations and mount by least squares over the corners themselves.
//!
//! Unknowns, each with a world-frame error as in [`measurement`](crate::measurement): the robot's pose at every stop
//! (xi_k), every camera's (zeta_i), the target's on the robot (mu), and calibration states b of every lens. Costs:
//!
//! | | residual | covariance |
//! |---|---|---|
//! | odometry | `Log(M_k^-1 planar(T_k)^-1 planar(T_k+1))`, its x, y and yaw | that of the [`Motion`] |
//! | floor | `Log(planar(T_k)^-1 T_k)`, its z, roll and pitch | [`Floor`] |
//! | corners | `(pi(theta^ + E b, H p) - z)/sigma`, Huber's loss; `H = T_C^-1 T_R T_R_B` | 1 |
//! | prior of b, mu | | as given |
//!
//! The first stop's x, y and yaw are the origin. A view may carry a slack e, `H Exp(e)`, of given sigma, for what no
//! corner noise explains (the panel bends, the detector repeats its error): it is eliminated within the view.
//!
//! Solved by Levenberg-Marquardt on the normal equations in blocks of six, by sparse Cholesky: robot poses form a chain,
//! each camera touches the stops that saw it. Not by `estimation::levenberg_marquardt`: slacks are eliminated by one linear
//! step, so that the gradient is not quite that of the cost and no step may lower the cost where the whole step still
//! promises to. This loop takes that for its end; the common one comes to none in two of four surveys with slack, where this
//! one takes 8 to 13 steps (`survey/common_loop.rs` prints it). The covariance is that of the last normal equations. Needs a start near the
//! solution: the filter's. Does not look for outliers among views: the filter's gates do.

mod covariance;
mod system;
mod terms;

pub use covariance::Spread;

use crate::view::Corner;
use crate::{Error, Floor, odometry::Motion};
use groma_geometry::{LieGroup, Se3};
use groma_models::{Camera, Token};
use nalgebra::{DMatrix, DVector, Matrix6, SVector, Vector6};
pub(crate) use system::System;
#[cfg(test)]
pub(crate) use terms::linearise;

/// Unknowns of a block.
pub(crate) const B: usize = 6;
const FIRST_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
const LAST_DAMPING: f64 = 1e6;
/// A step that promises less is the last [chi-square].
const ENOUGH: f64 = 1e-6;

/// A lens: its assumed values, and how the calibration states move its parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// theta^.
    pub camera: Camera,
    /// E, parameters x m with m up to six: a root of the parameters' covariance, so that b has the prior `N(0, I)`.
    pub basis: DMatrix<f64>,
}

/// What one camera saw at one stop.
#[derive(Clone, Debug, PartialEq)]
pub struct BatchView {
    /// Number of the stop.
    pub stop: usize,
    /// Number of the place of a camera (a camera that was moved has two).
    pub place: usize,
    /// Number of the lens.
    pub lens: usize,
    /// Its corners.
    pub corners: Vec<Corner>,
}

/// A problem.
#[derive(Clone, Debug)]
pub struct Batch {
    /// Motion from each stop to the next.
    pub motions: Vec<Motion>,
    /// The floor; a sigma of zero is taken as a micrometre and a microradian.
    pub floor: Floor,
    /// The lenses.
    pub lenses: Vec<Lens>,
    /// What was seen.
    pub views: Vec<BatchView>,
    /// The target on the robot as assumed, and the covariance of mu; zero variances are held.
    pub mount: (Se3, Matrix6<f64>),
    /// Standard deviations of a view's slack, position [m] and rotation [rad]; zero for none.
    pub slack: [f64; 2],
    /// Most steps.
    pub iterations: usize,
}

/// An estimate of everything.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// `T_W_R` at each stop.
    pub stops: Vec<Se3>,
    /// `T_W_C` of each place.
    pub places: Vec<Se3>,
    /// b of each lens.
    pub calibrations: Vec<DVector<f64>>,
    /// `T_R_B`.
    pub mount: Se3,
}

/// The sums of squares that an estimate leaves, by kind, each with the number of its residuals.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Residuals {
    /// Corners of each view.
    pub views: Vec<(f64, usize)>,
    /// Odometry.
    pub odometry: (f64, usize),
    /// Floor.
    pub floor: (f64, usize),
    /// Priors of calibration and mount.
    pub priors: (f64, usize),
}

impl Residuals {
    /// Corners of all views.
    #[must_use]
    pub fn corners(&self) -> (f64, usize) {
        self.views.iter().fold((0.0, 0), |sum, view| (sum.0 + view.0, sum.1 + view.1))
    }
}

/// The end of a batch.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The estimate.
    pub state: State,
    /// What it leaves.
    pub residuals: Residuals,
    /// Steps taken.
    pub iterations: usize,
    /// Whether the last step promised next to nothing.
    pub converged: bool,
    /// Covariances.
    pub spread: Spread,
}

impl Batch {
    /// The estimate of least cost near `start`.
    ///
    /// # Errors
    /// When the numbers of stops, places and lenses do not fit, an unknown is unconstrained, memory runs out, or `token` is
    /// cancelled.
    pub fn solve(&self, start: State, token: &Token) -> Result<Solution, Error> {
        self.check(&start)?;
        let mut system = System::new(self, &start)?;
        let mut state = start;
        let unseen = || Error::NoData("a camera does not see the target from where the start has it".into());
        token.begin(self.iterations);
        let mut at = terms::linearise(self, &state, &mut system, token)?.ok_or_else(unseen)?;
        let (mut damping, mut taken, mut converged) = (FIRST_DAMPING, 0, false);
        while !converged && taken < self.iterations && damping < LAST_DAMPING {
            let (step, promise) = system.step(damping)?;
            converged = promise < ENOUGH + 1e-10 * at;
            let moved = state.moved(self, &step);
            match terms::linearise(self, &moved, &mut system, token)?.filter(|cost| *cost <= at + 1e-12 * at.abs()) {
                Some(cost) => {
                    (state, at, taken) = (moved, cost, taken + 1);
                    damping = (damping / 10.0).max(LEAST_DAMPING);
                    token.step()?;
                }
                None => {
                    damping *= 10.0;
                    terms::linearise(self, &state, &mut system, token)?;
                }
            }
        }
        let residuals = terms::residuals(self, &state);
        let spread = system.spread(self, token)?;
        Ok(Solution { state, residuals, iterations: taken, converged, spread })
    }

    fn check(&self, start: &State) -> Result<(), Error> {
        let size = |what, expected, got| {
            let fits = expected == got;
            if fits { Ok(()) } else { Err(groma_estimation::Error::Size { what, expected, got }) }
        };
        size("motions", start.stops.len().saturating_sub(1), self.motions.len())?;
        size("calibrations", self.lenses.len(), start.calibrations.len())?;
        for (lens, b) in self.lenses.iter().zip(&start.calibrations) {
            size("calibration states", lens.basis.ncols(), b.len())?;
            size("calibration states of a lens, at most", lens.basis.ncols().min(B), lens.basis.ncols())?;
            size("parameters of a lens", lens.camera.count(), lens.basis.nrows())?;
        }
        let known =
            |v: &BatchView| v.stop < start.stops.len() && v.place < start.places.len() && v.lens < self.lenses.len();
        if self.views.iter().all(known) { Ok(()) } else { Err(Error::NoData("a view of nothing that is known".into())) }
    }
}

impl Lens {
    /// The camera with calibration states b; the believed one where that makes no camera.
    #[must_use]
    pub fn calibrated(&self, b: &DVector<f64>) -> Camera {
        let theta = DVector::from_column_slice(self.camera.parameters()) + &self.basis * b;
        self.camera.with_parameters(theta.as_slice().to_vec()).unwrap_or_else(|_| self.camera.clone())
    }
}

impl State {
    /// Where each kind of block begins: stops, places, calibrations, mount.
    pub(crate) fn blocks(&self) -> [usize; 4] {
        let (s, p) = (self.stops.len(), self.places.len());
        [0, s, s + p, s + p + self.calibrations.len()]
    }

    pub(crate) fn moved(&self, batch: &Batch, step: &[SVector<f64, B>]) -> Self {
        let [stops, places, calibrations, mount] = self.blocks();
        let pose = |pose: &Se3, d: &Vector6<f64>| Se3::exp(d) * *pose;
        let poses = |from: &[Se3], at: usize| from.iter().zip(&step[at..]).map(|(t, d)| pose(t, d)).collect();
        let lens = |(k, b): (usize, &DVector<f64>)| b + step[calibrations + k].rows(0, batch.lenses[k].basis.ncols());
        Self {
            stops: poses(&self.stops, stops),
            places: poses(&self.places, places),
            calibrations: self.calibrations.iter().enumerate().map(lens).collect(),
            mount: pose(&self.mount, &step[mount]),
        }
    }
}

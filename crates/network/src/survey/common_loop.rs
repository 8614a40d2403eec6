//! The batch by the loop of `estimation::levenberg_marquardt`, compared with its own: why it has its own.
//!
//! `cargo test --release -p groma-network common_loop -- --nocapture` prints the figures.

#![allow(clippy::print_stdout)]

use super::{Detection, KnownCamera, Survey, filtering, lens, refine, stops};
use crate::batch::{Batch, Lens, State, System, linearise};
use crate::{Error, Options};
use groma_estimation::levenberg_marquardt::{self, Problem, minimize};
use groma_models::Token;
use groma_simulation::network::{NetworkScene, simulate};
use nalgebra::SVector;

/// A batch with its normal equations at the state of the last cost, and at the last state that was kept.
struct Descent<'a> {
    batch: &'a Batch,
    trial: System,
    kept: System,
    costs: usize,
}

impl Problem for Descent<'_> {
    type State = State;
    type Step = Vec<SVector<f64, 6>>;
    type Error = Error;

    fn cost(&mut self, at: &State) -> Result<Option<f64>, Error> {
        self.costs += 1;
        linearise(self.batch, at, &mut self.trial, &Token::new())
    }

    fn linearize(&mut self, _: &State) -> Result<(), Error> {
        std::mem::swap(&mut self.trial, &mut self.kept);
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Self::Step, f64)>, Error> {
        self.kept.step(damping).map(Some)
    }

    fn moved(&self, at: &State, step: &Self::Step) -> Option<State> {
        Some(at.moved(self.batch, step))
    }
}

/// A loop with unknown focal lengths and mount, whose views have slack.
fn batch(seed: u64) -> (Batch, State) {
    let mut scene = NetworkScene::named("loop", seed).unwrap();
    scene.noise.focal = 0.002;
    (scene.noise.mount, scene.noise.mount_turn) = (0.005, 0.5_f64.to_radians());
    scene.noise.view = [0.002, 0.1_f64.to_radians()];
    let (recording, mut options) = (simulate(&scene).unwrap(), Options { focal: 0.002, ..Options::default() });
    (options.view.position, options.view.rotation) = (scene.noise.view[0], scene.noise.view[1]);
    let known = scene.cameras.iter();
    let known = known.map(|c| KnownCamera { name: c.name.clone(), camera: c.camera.clone(), covariance: None });
    let mut survey = Survey::new(scene.target.clone(), known.collect()).unwrap();
    recording.odometry.iter().for_each(|(stamp, pose)| assert!(survey.push_odometry(*stamp, *pose)));
    for seen in recording.seen {
        let (camera, panel, sigmas) = (seen.camera, seen.panel, vec![scene.noise.corner; seen.ids.len()]);
        let (stamp, ids, pixels) = (seen.stamp, seen.ids, seen.pixels);
        assert!(survey.push_detection(Detection { stamp, camera, panel, stop: None, ids, pixels, sigmas }));
    }
    let lenses: Vec<Lens> = survey.cameras.iter().map(|known| lens(known, &options)).collect();
    let halts = stops::halts(&survey, &options, &Token::new()).unwrap();
    let filtered = filtering::run(&survey, &lenses, &halts, &options, &Token::new()).unwrap();
    refine::taken(&lenses, &halts, &filtered, &options)
}

/// With slacks eliminated, the gradient is not that of the cost: steps that still promise something are refused, and the common
/// loop, which ends only where the undamped step promises nothing, comes to no end.
#[test]
fn the_common_loop_finds_no_end_where_views_have_slack() {
    let mut endless = 0;
    for seed in 1..=4 {
        let (batch, start) = batch(seed);
        let own = batch.solve(start.clone(), &Token::new()).unwrap();
        let system = || System::new(&batch, &start).unwrap();
        let mut descent = Descent { batch: &batch, trial: system(), kept: system(), costs: 0 };
        let options = levenberg_marquardt::Options { max_iterations: batch.iterations, tolerance: 1e-10 };
        let common = minimize(&mut descent, start.clone(), &options).unwrap().unwrap();
        println!(
            "loop {seed}: own {} steps, converged {}; common {} steps, {} costs, converged {}",
            own.iterations, own.converged, common.iterations, descent.costs, common.converged
        );
        assert!(own.converged);
        endless += usize::from(!common.converged);
    }
    assert!(endless > 0, "the common loop serves: use it");
}

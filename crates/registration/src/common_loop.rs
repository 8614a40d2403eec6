//! Registration with each round's pairs fitted by the loop of `estimation::levenberg_marquardt`, compared with one
//! Gauss-Newton step a round: why registration does not use it.
//!
//! `cargo test --release -p groma-registration common_loop -- --nocapture` prints the figures.

#![allow(clippy::print_stdout)]

use crate::mutual::{self, Mutual};
use crate::point_to_line::{self, Alignment};
use crate::{Contour, SurfaceMap, SurfaceScan, align, align_mutually};
use groma_estimation::Loss;
use groma_estimation::levenberg_marquardt::{Minimum, Normal, Options, Problem, minimize};
use groma_estimation::random::SplitMix64;
use groma_geometry::Se2;
use groma_models::{BeamGeometry, LaserScan};
use nalgebra::{Vector2, Vector3};
use std::convert::Infallible;

/// Residuals and their derivatives, all of one round.
type Rows = Vec<(f64, Vector3<f64>)>;

/// The step that fits the pairs of one round.
struct Round {
    rows: Rows,
    loss: Loss,
    normal: Normal<3>,
    linearisations: usize,
}

impl Problem for Round {
    type State = Vector3<f64>;
    type Step = Vector3<f64>;
    type Error = Infallible;

    fn cost(&mut self, at: &Vector3<f64>) -> Result<Option<f64>, Infallible> {
        Ok(Some(self.rows.iter().map(|(r, row)| self.loss.rho((r + row.dot(at)).powi(2))).sum()))
    }

    fn linearize(&mut self, at: &Vector3<f64>) -> Result<(), Infallible> {
        self.normal = Normal::zeros();
        self.linearisations += 1;
        for (r, row) in &self.rows {
            let r = r + row.dot(at);
            let weight = self.loss.weight(r * r);
            self.normal.information += row * row.transpose() * weight;
            self.normal.gradient += row * (weight * r);
        }
        Ok(())
    }

    fn step(&mut self, damping: f64) -> Result<Option<(Vector3<f64>, f64)>, Infallible> {
        Ok(self.normal.step(damping))
    }

    fn moved(&self, at: &Vector3<f64>, step: &Vector3<f64>) -> Option<Vector3<f64>> {
        Some(at + step)
    }
}

/// What a way of registration took.
#[derive(Default)]
struct Effort {
    rounds: usize,
    linearisations: usize,
}

impl Effort {
    /// The best step for the pairs of a round whose residuals have the spread `scale`.
    fn fit(&mut self, rows: Rows, scale: f64) -> Vector3<f64> {
        let rows = rows.into_iter().map(|(r, row)| (r / scale, row / scale)).collect();
        let mut round =
            Round { rows, loss: Loss::Cauchy(point_to_line::CAUCHY), normal: Normal::zeros(), linearisations: 0 };
        let Ok(end) = minimize(&mut round, Vector3::zeros(), &Options { max_iterations: 20, tolerance: 1e-5 });
        self.linearisations += round.linearisations;
        end.map_or_else(Vector3::zeros, |Minimum { state, .. }| state)
    }

    fn tell(&self, name: &str, other: &Self) {
        println!(
            "{name}: one step a round: {} rounds and linearisations; common loop: {} rounds, {} linearisations",
            self.rounds, other.rounds, other.linearisations
        );
    }
}

/// `align` without a prior, each round's step as given.
fn to_lines(scan: &SurfaceScan, map: &SurfaceMap, start: Se2, effort: &mut Effort, by_common_loop: bool) -> Se2 {
    let (mut pose, mut matches) = (start, Vec::new());
    for k in 0..point_to_line::MOST_ITERATIONS {
        let radius = point_to_line::RADII[k.min(point_to_line::RADII.len() - 1)];
        let normal = point_to_line::linearize(scan, map, &pose, radius, &mut matches);
        let step = if by_common_loop {
            effort.fit(matches.iter().map(|m| (m.residual, m.row)).collect(), normal.scale)
        } else {
            point_to_line::solve(&normal, None, &pose)
        };
        pose = pose.plus(step);
        effort.rounds += 1;
        if point_to_line::is_negligible(&step) && k + 1 >= point_to_line::RADII.len() {
            break;
        }
    }
    pose
}

/// `align_mutually`, each round's step as given.
fn to_each_other(a: &Contour, b: &Contour, start: Se2, effort: &mut Effort, by_common_loop: bool) -> Se2 {
    let mut pose = start;
    for k in 0..mutual::MOST_ITERATIONS {
        let pairs = mutual::pairs(a, b, &pose, mutual::RADII[k.min(mutual::RADII.len() - 1)]);
        let scale = mutual::spread(&pairs);
        let step = if by_common_loop {
            effort.fit(pairs.iter().map(|pair| (pair.residual, pair.row)).collect(), scale)
        } else {
            mutual::step(&pairs, scale)
        };
        pose = pose.plus(step);
        effort.rounds += 1;
        if mutual::is_negligible(&step) && k + 1 >= mutual::RADII.len() {
            break;
        }
    }
    pose
}

/// What a scanner reads in a room of 13 by 9 m, with a centimetre of noise.
fn scan(pose: &Se2, random: &mut SplitMix64) -> LaserScan {
    let step = 0.5_f64.to_radians();
    let geometry = BeamGeometry {
        angle_min: -270.0 * step,
        angle_increment: step,
        time_increment: 0.0,
        range_min: 0.05,
        range_max: 40.0,
    };
    let ranges = (0..541).map(|i| {
        let d = pose.rotation.act(Vector2::new(geometry.bearing(i).cos(), geometry.bearing(i).sin()));
        let to = |x: f64, v: f64, low: f64, high: f64| ((if v > 0.0 { high } else { low }) - x) / v;
        to(pose.x(), d.x, -6.0, 7.0).min(to(pose.y(), d.y, -4.0, 5.0)) + 0.01 * random.normal()
    });
    LaserScan { stamp: 0.0, geometry, ranges: ranges.collect(), intensities: vec![] }
}

/// A pair of scans, and a start for the pose of the second in the first.
fn pairs() -> Vec<(LaserScan, LaserScan, Se2)> {
    let mut random = SplitMix64::new(3);
    let pair = |k: u32| {
        let a = Se2::new(0.3 + 0.02 * f64::from(k), -0.2, 0.1);
        let b = a * Se2::new(0.5, 0.03, 0.15);
        let off = Vector3::new(0.05 * random.normal(), 0.05 * random.normal(), 0.02 * random.normal());
        (scan(&a, &mut random), scan(&b, &mut random), a.between(&b).plus(off))
    };
    (0..60).map(pair).collect()
}

/// The pairs change with every step: what the common loop gains on the pairs of one round, the next takes away.
#[test]
fn the_common_loop_saves_few_rounds_and_linearises_more() {
    let (mut own, mut common) = ([Effort::default(), Effort::default()], [Effort::default(), Effort::default()]);
    for (a, b, start) in pairs() {
        let surface = |scan: &LaserScan| SurfaceScan::new(scan, &Se2::IDENTITY, Vector3::zeros());
        let mut map = SurfaceMap::default();
        map.insert(&surface(&a), &Se2::IDENTITY);
        let Alignment { pose, .. } = align(&surface(&b), &map, start, None);
        assert_eq!(to_lines(&surface(&b), &map, start, &mut own[0], false), pose);
        let other = to_lines(&surface(&b), &map, start, &mut common[0], true);
        assert!(pose.minus(&other).norm() < 1e-3, "{}", pose.minus(&other));
        let (a, b) = (Contour::new(&a, Vector3::zeros()), Contour::new(&b, Vector3::zeros()));
        let Mutual { pose, .. } = align_mutually(&a, &b, start);
        assert_eq!(to_each_other(&a, &b, start, &mut own[1], false), pose);
        to_each_other(&a, &b, start, &mut common[1], true);
    }
    for (name, own, common) in [("to lines", &own[0], &common[0]), ("to each other", &own[1], &common[1])] {
        own.tell(name, common);
        assert!(10 * common.rounds > 9 * own.rounds && common.linearisations > 2 * own.rounds);
    }
}

//! Are the covariances of the keyframes honest? With the error e of a keyframe seen from the first, a right perturbation,
//! and its covariance P: `NEES = e^T P^-1 e`, 3 in the mean when P is the covariance of e, less when P is on the safe side. In a
//! hall that a drive crosses in a minute P is far on the safe side; `tests/statistics` has whole buildings.

use crate::building::{around, drive, hall, map, mount, scenario, truth};

/// 95 % of chi-square with three degrees of freedom.
const WITHIN: f64 = 7.815;

#[test]
fn keyframes_lie_within_their_covariances() {
    let mut nees = Vec::new();
    for seed in 1..13 {
        let simulated = drive(hall(), &around(1), &scenario(seed));
        let result = map(&simulated, &simulated.odometry, mount(&scenario(seed)));
        let truth = truth(&simulated, &result);
        let from_first = |k: usize| result.graph.nodes[0].inverse() * result.graph.nodes[k];
        for (k, true_pose) in truth.iter().enumerate().skip(1) {
            let e = from_first(k).minus(true_pose);
            nees.push(e.dot(&(result.covariances[k].try_inverse().unwrap() * e)));
        }
    }
    let mean = nees.iter().sum::<f64>() / nees.len() as f64 / 3.0;
    let share = nees.iter().filter(|n| **n < WITHIN).count() as f64 / nees.len() as f64;
    assert!((0.003..1.0).contains(&mean) && share > 0.95, "NEES per degree of freedom {mean}, {share} within 95 %");
}

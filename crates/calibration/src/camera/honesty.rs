//! Check of the formal covariance: halves of the images calibrated against each other.
//!
//! Every split draws half of the images, calibrates both halves from the whole's answer, and compares them in units of
//! their own claims:
//!
//! ```text
//! factor^2 = mean over splits of  (a - b)^T (C_a + C_b)^-1 (a - b) / n
//! ```
//!
//! 1 when corners have independent errors and the lens model fits; real images gave 1 to 8. The formal covariance times
//! `max(1, factor)^2` is what to pass on. Halves that do not allow a calibration are left out and counted. It cannot see
//! an error that all images share: a wrong size of the target, a panel that is always bent alike.

use super::adjust::{State, adjust};
use super::information::knowledge;
use super::uncertainty::ProjectionMap;
use super::view::View;
use groma_estimation::random::SplitMix64;
use groma_models::Token;
use nalgebra::{DMatrix, DVector};

/// Least images of a half.
const LEAST_IMAGES: usize = 3;
const STEPS: usize = 30;

/// What the halves say.
#[derive(Clone, Debug, PartialEq)]
pub struct Honesty {
    /// By what the standard deviations should be multiplied; 1 when they hold, nothing when too few halves could be
    /// calibrated.
    pub factor: Option<f64>,
    /// Root mean square of the difference of each parameter in units of its claimed standard deviation.
    pub z_rms: Vec<f64>,
    /// Root mean square distance over the image between projections by the two halves, best rotation taken out [pixel].
    pub projection_rms: f64,
    /// Splits that were compared.
    pub splits: usize,
}

/// Parameters and covariance of a half.
type Half = (DVector<f64>, DMatrix<f64>);

/// Compares halves. The views are those kept, with the state that fits all.
pub(super) fn honesty(state: &State, views: &[View], splits: usize, seed: u64, token: &Token) -> Honesty {
    let mut images: Vec<usize> = views.iter().map(|view| view.image).collect();
    images.dedup();
    let mut random = SplitMix64::new(seed);
    let pairs: Vec<[Half; 2]> = if images.len() < 2 * LEAST_IMAGES {
        vec![]
    } else {
        (0..splits).filter_map(|_| pair(state, views, &mut images, &mut random, token)).collect()
    };
    summary(state, &pairs)
}

/// Both halves of one split.
fn pair(
    state: &State,
    views: &[View],
    images: &mut [usize],
    random: &mut SplitMix64,
    token: &Token,
) -> Option<[Half; 2]> {
    token.check().ok()?;
    random.shuffle(images);
    let first = &images[..images.len() / 2];
    let (is_first, is_second) = (|image| first.contains(&image), |image| !first.contains(&image));
    Some([half(state, views, is_first, token)?, half(state, views, is_second, token)?])
}

fn half(state: &State, views: &[View], belongs: impl Fn(usize) -> bool, token: &Token) -> Option<Half> {
    let chosen: Vec<usize> = (0..views.len()).filter(|&k| belongs(views[k].image)).collect();
    let views: Vec<View> = chosen.iter().map(|&k| views[k].clone()).collect();
    let poses = chosen.iter().map(|&k| state.poses[k]).collect();
    let start = State { camera: state.camera.clone(), poses };
    let count = start.camera.count();
    let found = adjust(start, &views, &vec![true; count], STEPS, token)?;
    let knowledge = knowledge(&found.state, &views)?.ok()?;
    let corners: usize = views.iter().map(|view| view.corners.len()).sum();
    let dof = (2 * corners).checked_sub(count + 6 * views.len()).filter(|&dof| dof > 0)?;
    let parameters = DVector::from_column_slice(found.state.camera.parameters());
    Some((parameters, knowledge.covariance * (found.error / dof as f64)))
}

fn summary(state: &State, pairs: &[[Half; 2]]) -> Honesty {
    let (count, map) = (state.camera.count(), ProjectionMap::new(&state.camera));
    let (mut distances, mut z_sq, mut shift_sq) = (vec![], vec![0.0; count], 0.0);
    for [a, b] in pairs {
        let (difference, claimed) = (&a.0 - &b.0, &a.1 + &b.1);
        for (k, sum) in z_sq.iter_mut().enumerate() {
            *sum += difference[k] * difference[k] / claimed[(k, k)] / pairs.len() as f64;
        }
        shift_sq += map.rms_shift(&difference).powi(2) / pairs.len() as f64;
        distances.extend(claimed.cholesky().map(|f| difference.dot(&f.solve(&difference)) / count as f64));
    }
    let enough = distances.len() > 1;
    let factor = (distances.iter().sum::<f64>() / distances.len().max(1) as f64).sqrt();
    Honesty {
        factor: enough.then_some(factor),
        z_rms: z_sq.into_iter().map(f64::sqrt).collect(),
        projection_rms: shift_sq.sqrt(),
        splits: distances.len(),
    }
}

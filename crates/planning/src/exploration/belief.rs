//! The covariance of robot and cameras, as the filter would have it; measured values do not enter it.
//!
//! State: errors `xi` in the world frame, the robot first, the cameras in the order in which they were met.
//!
//! ```text
//! drive   P_RR += Q
//! meet    xi_C = xi_R + n,  n ~ N(0, N): rows and columns of the robot copied, P_CC = P_RR + N
//! again   y = xi_R - xi_C + n: P -= C S^-1 C',  C = P H',  S = H P H' + N
//! ```
//!
//! The same equations as the six-dimensional filter of the camera network, in the plane. Assumes looks that are
//! independent of each other.

use super::noise::{Noise, position_trace};
use nalgebra::{DMatrix, Matrix3, Matrix3xX, Vector2};

/// Joint covariance of the robot and the cameras met so far.
#[derive(Clone, Debug)]
pub struct Belief {
    pub(super) covariance: DMatrix<f64>,
    pub(super) cameras: Vec<Vector2<f64>>,
    pub(super) noise: Noise,
}

impl Belief {
    /// The robot at a place that is known because it defines the map; no camera yet.
    #[must_use]
    pub fn new(noise: Noise) -> Self {
        Self { covariance: DMatrix::zeros(3, 3), cameras: vec![], noise }
    }

    /// The robot drives.
    pub fn drive(&mut self, added: &Matrix3<f64>) {
        let mut robot = self.covariance.fixed_view_mut::<3, 3>(0, 0);
        robot += added;
    }

    /// The robot is seen by a camera for the first time, at a place; returns the camera's number.
    pub fn meet(&mut self, at: Vector2<f64>) -> usize {
        let (old, n) = (&self.covariance, self.covariance.nrows());
        let mut grown = DMatrix::zeros(n + 3, n + 3);
        grown.view_mut((0, 0), (n, n)).copy_from(old);
        grown.view_mut((0, n), (n, 3)).copy_from(&old.columns(0, 3));
        grown.view_mut((n, 0), (3, n)).copy_from(&old.rows(0, 3));
        grown.view_mut((n, n), (3, 3)).copy_from(&(old.fixed_view::<3, 3>(0, 0) + self.noise.look(at)));
        self.covariance = grown;
        self.cameras.push(at);
        self.cameras.len() - 1
    }

    /// The robot is seen again by a camera.
    pub fn meet_again(&mut self, camera: usize) {
        let look = self.noise.look(self.cameras[camera]);
        let difference = self.difference(camera);
        if let Some(gain) = factor(&difference, camera, &look) {
            self.covariance.gemm_tr(-1.0, &gain, &gain, 1.0);
        }
    }

    /// Covariance of the robot.
    #[must_use]
    pub fn robot(&self) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(0, 0).into_owned()
    }

    /// Covariance of a camera.
    #[must_use]
    pub fn camera(&self, i: usize) -> Matrix3<f64> {
        self.covariance.fixed_view::<3, 3>(3 * i + 3, 3 * i + 3).into_owned()
    }

    /// Where the cameras are [m].
    #[must_use]
    pub fn cameras(&self) -> &[Vector2<f64>] {
        &self.cameras
    }

    /// Sum of the position variances of all cameras [m^2].
    #[must_use]
    pub fn map_trace(&self) -> f64 {
        self.cameras.iter().enumerate().map(|(i, &at)| position_trace(&self.camera(i), at)).sum()
    }

    /// Root mean square over the cameras of the standard deviation of the position [m].
    #[must_use]
    pub fn sigma(&self) -> f64 {
        (self.map_trace().max(0.0) / self.cameras.len().max(1) as f64).sqrt()
    }

    /// `H P` for the difference of robot and camera, as columns of width 3: (3, n).
    pub(super) fn difference(&self, camera: usize) -> Matrix3xX<f64> {
        self.covariance.rows(0, 3).into_owned().fixed_rows::<3>(0) - self.covariance.fixed_rows::<3>(3 * camera + 3)
    }
}

/// `L^-1 H P` with `L L' = S`, so that an update is `P -= gain' gain`; None where S is not positive (it is by design).
pub(super) fn factor(difference: &Matrix3xX<f64>, camera: usize, look: &Matrix3<f64>) -> Option<Matrix3xX<f64>> {
    let innovation = difference.fixed_view::<3, 3>(0, 0) - difference.fixed_view::<3, 3>(0, 3 * camera + 3) + look;
    let lower = nalgebra::Cholesky::new((innovation + innovation.transpose()) / 2.0)?.unpack();
    lower.solve_lower_triangular(difference)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same by least squares over all robot poses and cameras: the oracle.
    fn batch(visits: &[usize], drives: &[Matrix3<f64>], places: &[Vector2<f64>], noise: &Noise) -> DMatrix<f64> {
        let (robots, cameras) = (visits.len(), places.len());
        let n = 3 * (robots + cameras);
        let mut information = DMatrix::zeros(n, n);
        let mut relate = |i: usize, j: Option<usize>, covariance: Matrix3<f64>| {
            let w = covariance.try_inverse().unwrap();
            let mut add = |a: usize, b: usize, s: f64| {
                let mut block = information.view_mut((3 * a, 3 * b), (3, 3));
                block += w * s;
            };
            add(i, i, 1.0);
            if let Some(j) = j {
                add(j, j, 1.0);
                add(i, j, -1.0);
                add(j, i, -1.0);
            }
        };
        relate(0, None, Matrix3::identity() * 1e-14);
        drives.iter().enumerate().for_each(|(k, q)| relate(k + 1, Some(k), *q));
        visits.iter().enumerate().for_each(|(k, &c)| relate(k, Some(robots + c), noise.look(places[c])));
        let covariance = information.try_inverse().unwrap();
        covariance.view((3 * robots, 3 * robots), (3 * cameras, 3 * cameras)).into_owned()
    }

    #[test]
    fn the_filter_is_least_squares_over_everything() {
        let noise = Noise::default();
        let places = [Vector2::new(0.0, 0.0), Vector2::new(8.0, 0.0), Vector2::new(8.0, 8.0)];
        let visits = [0, 1, 2, 0, 1, 0, 2];
        let mut belief = Belief::new(noise);
        belief.meet(places[0]);
        let mut drives = vec![];
        for pair in visits.windows(2) {
            let q = noise.straight(places[pair[0]], places[pair[1]]);
            drives.push(q);
            belief.drive(&q);
            if pair[1] < belief.cameras().len() {
                belief.meet_again(pair[1])
            } else {
                belief.meet(places[pair[1]]);
            }
        }
        let oracle = batch(&visits, &drives, &places, &noise);
        let map = belief.covariance.view((3, 3), (9, 9)).into_owned();
        assert!((&map - &oracle).amax() < 1e-6 * oracle.amax(), "{}", (map - &oracle).amax());
    }

    #[test]
    fn another_look_never_makes_anything_worse() {
        let noise = Noise::default();
        let (a, b) = (Vector2::new(0.0, 0.0), Vector2::new(8.0, 0.0));
        let mut belief = Belief::new(noise);
        belief.meet(a);
        belief.drive(&noise.straight(a, b));
        belief.meet(b);
        for _ in 0..50 {
            let before = belief.map_trace();
            belief.drive(&noise.straight(b, a));
            belief.meet_again(0);
            belief.drive(&noise.straight(a, b));
            belief.meet_again(1);
            assert!(belief.map_trace() < before && belief.map_trace() > 0.0);
        }
    }
}

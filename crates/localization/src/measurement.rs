//! What a scanner on the vehicle sees of a point landmark: range and bearing, with Jacobians.
//!
//! With `T` the pose at the time of the filter, `D` the motion from then to the time of the beam, `L` the mount of the
//! laser and m the landmark:
//!
//! ```text
//! b = T^-1 m,   q = (D L)^-1 b,   h = ( |q|, atan2(q_y, q_x) )
//! dh/dq = [ q^T / |q| ; (-q_y, q_x) / |q|^2 ]
//! T exp(xi):   dq = -R_DL^T [ I | (-b_y, b_x)^T ] xi          L exp(l):   dq = -[ I | (-q_y, q_x)^T ] l
//! m + dm:      dq = (R_T R_DL)^T dm
//! ```
//!
//! and the other way round, for a landmark that a sighting `(rho, beta)` begins: `m = T D L q`. Perturbations are on the
//! right. The noise of `D`, a few centimetres of driving, is neglected.

use groma_geometry::{Se2, wrap};
use nalgebra::{Matrix2, Matrix2x3, Vector2};

/// From where a beam was fired: the pose of the vehicle and of the laser on it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Viewpoint {
    /// `T_map_base` at the time of the filter.
    pub pose: Se2,
    /// `D L`: the laser at the time of the beam, seen from the vehicle at the time of the filter.
    pub laser: Se2,
}

/// A predicted sighting.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sighting {
    /// Range [m] and bearing [rad].
    pub polar: Vector2<f64>,
    /// By the perturbation of the pose.
    pub by_pose: Matrix2x3<f64>,
    /// By the perturbation of the mount.
    pub by_mount: Matrix2x3<f64>,
    /// By the landmark's position.
    pub by_landmark: Matrix2<f64>,
}

/// A landmark that a sighting begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Begun {
    /// In the map [m].
    pub position: Vector2<f64>,
    /// By the perturbation of the pose.
    pub by_pose: Matrix2x3<f64>,
    /// By the perturbation of the mount.
    pub by_mount: Matrix2x3<f64>,
    /// By range and bearing.
    pub by_polar: Matrix2<f64>,
}

impl Viewpoint {
    /// What is seen of a landmark at `m`; none when it lies on the laser.
    pub fn sight(&self, m: Vector2<f64>) -> Option<Sighting> {
        let b = self.pose.inverse().act(m);
        let turned = self.laser.rotation.inverse();
        let q = turned.act(b - self.laser.translation);
        let sq = q.norm_squared();
        if sq.is_nan() || sq <= 1e-12 {
            return None;
        }
        let range = sq.sqrt();
        let by_q = Matrix2::new(q.x / range, q.y / range, -q.y / sq, q.x / sq);
        Some(Sighting {
            polar: Vector2::new(range, q.y.atan2(q.x)),
            by_pose: -(by_q * turned.matrix()) * with_turn(b),
            by_mount: -by_q * with_turn(q),
            by_landmark: by_q * turned.matrix() * self.pose.rotation.inverse().matrix(),
        })
    }

    /// The landmark at range and bearing `polar`.
    pub fn begin(&self, polar: Vector2<f64>) -> Begun {
        let (sin, cos) = polar.y.sin_cos();
        let q = Vector2::new(cos, sin) * polar.x;
        let b = self.laser.act(q);
        let (r_pose, r_all) = (self.pose.rotation.matrix(), (self.pose.rotation * self.laser.rotation).matrix());
        Begun {
            position: self.pose.act(b),
            by_pose: r_pose * with_turn(b),
            by_mount: r_all * with_turn(q),
            by_polar: r_all * Matrix2::new(cos, -polar.x * sin, sin, polar.x * cos),
        }
    }
}

/// Measured less predicted, the bearing wrapped.
pub(crate) fn residual(measured: Vector2<f64>, predicted: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(measured.x - predicted.x, wrap(measured.y - predicted.y))
}

/// `[ I | (-p_y, p_x)^T ]`: how a point fixed to a frame moves with the frame.
fn with_turn(p: Vector2<f64>) -> Matrix2x3<f64> {
    Matrix2x3::new(1.0, 0.0, -p.y, 0.0, 1.0, p.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2x3, Vector3};

    const STEP: f64 = 1e-6;

    fn differences<const N: usize>(
        f: impl Fn(nalgebra::SVector<f64, N>) -> Vector2<f64>,
    ) -> nalgebra::SMatrix<f64, 2, N> {
        let mut j = nalgebra::SMatrix::<f64, 2, N>::zeros();
        for k in 0..N {
            let mut d = nalgebra::SVector::<f64, N>::zeros();
            d[k] = STEP;
            j.set_column(k, &((f(d) - f(-d)) / (2.0 * STEP)));
        }
        j
    }

    fn places() -> impl Iterator<Item = (Se2, Se2, Se2, Vector2<f64>)> {
        (0..40).map(|k| {
            let u = f64::from(k);
            let (pose, moved) = (Se2::new(3.0 * u.sin(), u.cos(), 0.7 * u), Se2::new(0.02, 0.001 * u, 0.01));
            let mount = Se2::new(0.4, -0.1, 0.3 - 0.2 * u);
            (pose, moved, mount, Vector2::new(9.0 * (1.3 * u).cos() + 0.3, 7.0 * (0.9 * u).sin()))
        })
    }

    #[test]
    fn jacobians_equal_differences() {
        for (pose, moved, mount, m) in places() {
            let at = |pose: Se2, mount: Se2, m: Vector2<f64>| {
                Viewpoint { pose, laser: moved * mount }.sight(m).unwrap().polar
            };
            let found = Viewpoint { pose, laser: moved * mount }.sight(m).unwrap();
            let by_pose: Matrix2x3<f64> = differences(|d: Vector3<f64>| at(pose.plus(d), mount, m));
            let by_mount = differences(|d: Vector3<f64>| at(pose, mount.plus(d), m));
            let by_landmark = differences(|d: Vector2<f64>| at(pose, mount, m + d));
            assert!((found.by_pose - by_pose).norm() < 1e-7, "{} {by_pose}", found.by_pose);
            assert!((found.by_mount - by_mount).norm() < 1e-7);
            assert!((found.by_landmark - by_landmark).norm() < 1e-7);
        }
    }

    #[test]
    fn a_landmark_begins_where_it_was_seen() {
        for (pose, moved, mount, m) in places() {
            let view = |pose: Se2, mount: Se2| Viewpoint { pose, laser: moved * mount };
            let polar = view(pose, mount).sight(m).unwrap().polar;
            let begun = view(pose, mount).begin(polar);
            assert!((begun.position - m).norm() < 1e-12);
            let by_pose = differences(|d: Vector3<f64>| view(pose.plus(d), mount).begin(polar).position);
            let by_mount = differences(|d: Vector3<f64>| view(pose, mount.plus(d)).begin(polar).position);
            let by_polar = differences(|d: Vector2<f64>| view(pose, mount).begin(polar + d).position);
            assert!((begun.by_pose - by_pose).norm() < 1e-7);
            assert!((begun.by_mount - by_mount).norm() < 1e-7);
            assert!((begun.by_polar - by_polar).norm() < 1e-7);
        }
    }

    #[test]
    fn nothing_is_seen_of_a_landmark_on_the_laser() {
        let view = Viewpoint { pose: Se2::IDENTITY, laser: Se2::new(1.0, 0.0, 0.0) };
        assert!(view.sight(Vector2::new(1.0, 0.0)).is_none() && view.sight(Vector2::new(f64::NAN, 0.0)).is_none());
    }
}

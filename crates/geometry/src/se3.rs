//! SE(3): rigid motions of space.
//!
//! Tangent `xi = (rho, w)`, translation first. With `W = [w]_x`, `P = [rho]_x`, `theta = |w|`, `Jl`, `Jr` those of SO(3):
//!
//! ```text
//! exp(xi)  = (Jl(w) rho, exp w)
//! Ad_T     = [[R, [t]_x R], [0, R]]
//! Jl(xi)   = [[Jl(w), Q], [0, Jl(w)]],   Jl^-1(xi) = [[Jl^-1, -Jl^-1 Q Jl^-1], [0, Jl^-1]],   Jr(xi) = Jl(-xi)
//! Q(xi)    = P/2 + c_3 (W P + P W + W P W) + c_4 (W^2 P + P W^2 - 3 W P W) + (c_4 - 3 c_5)/2 (W P W^2 + W^2 P W)
//! ```
//!
//! with `c_n(theta)` of `series.rs`. Source: Sola et al., equations (172)-(180); Barfoot, "State Estimation for Robotics",
//! (7.86).

use crate::lie_group::LieGroup;
use crate::series::tail;
use crate::so3::So3;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use std::ops::Mul;

/// A rigid motion of space, `p_a = R p_b + t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Se3 {
    /// The rotation R.
    pub rotation: So3,
    /// The translation t: the origin of b seen from a [m].
    pub translation: Vector3<f64>,
}

impl LieGroup<6> for Se3 {
    type Point = Vector3<f64>;

    fn identity() -> Self {
        Self { rotation: So3::identity(), translation: Vector3::zeros() }
    }

    fn inverse(&self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: -rotation.act(&self.translation) }
    }

    fn exp(xi: &Vector6<f64>) -> Self {
        let (rho, w) = split(xi);
        Self { rotation: So3::exp(&w), translation: So3::left_jacobian(&w) * rho }
    }

    fn log(&self) -> Vector6<f64> {
        let w = self.rotation.log();
        let rho = So3::left_jacobian_inverse(&w) * self.translation;
        Vector6::new(rho.x, rho.y, rho.z, w.x, w.y, w.z)
    }

    fn adjoint(&self) -> Matrix6<f64> {
        let r = self.rotation.matrix();
        triangular(&r, &(self.translation.cross_matrix() * r))
    }

    fn act(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.act(point) + self.translation
    }

    fn right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (_, w) = split(xi);
        triangular(&So3::right_jacobian(&w), &coupling(&-xi))
    }

    fn right_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
        let (_, w) = split(xi);
        let inverse = So3::right_jacobian_inverse(&w);
        triangular(&inverse, &(-inverse * coupling(&-xi) * inverse))
    }
}

impl Mul for Se3 {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self { rotation: self.rotation * b.rotation, translation: self.act(&b.translation) }
    }
}

fn split(xi: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (xi.fixed_rows::<3>(0).into_owned(), xi.fixed_rows::<3>(3).into_owned())
}

/// `[[diagonal, upper], [0, diagonal]]`.
fn triangular(diagonal: &Matrix3<f64>, upper: &Matrix3<f64>) -> Matrix6<f64> {
    let mut m = Matrix6::zeros();
    m.fixed_view_mut::<3, 3>(0, 0).copy_from(diagonal);
    m.fixed_view_mut::<3, 3>(0, 3).copy_from(upper);
    m.fixed_view_mut::<3, 3>(3, 3).copy_from(diagonal);
    m
}

/// Q of the left Jacobian.
fn coupling(xi: &Vector6<f64>) -> Matrix3<f64> {
    let (rho, axis) = split(xi);
    let (p, w, theta) = (rho.cross_matrix(), axis.cross_matrix(), axis.norm());
    let (wp, pw) = (w * p, p * w);
    let wpw = wp * w;
    p / 2.0
        + (wp + pw + wpw) * tail(3, theta)
        + (w * wp + pw * w - wpw * 3.0) * tail(4, theta)
        + (wpw * w + w * wpw) * ((tail(4, theta) - 3.0 * tail(5, theta)) / 2.0)
}

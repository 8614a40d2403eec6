//! One suite of laws, run over every group: at random, near the identity and near half a turn.

use groma_geometry::{LieGroup, Se2, Se3, So2, So3};
use nalgebra::{SMatrix, SVector};
use proptest::prelude::*;
use std::f64::consts::PI;

/// Translations are up to 10 m: rounding of products of three.
const EXACT: f64 = 1e-11;
/// Central differences of step 1e-5 on curves of that size.
const DIFFERENCES: f64 = 1e-6;

/// Rotation angles as they hurt: zero, tiny, at the switch of a series, any, and near half a turn.
fn angle() -> impl Strategy<Value = f64> {
    prop_oneof![
        Just(0.0),
        (-16.0..-3.0f64).prop_map(|e| 10.0f64.powf(e)),
        0.04..0.06f64,
        0.9..1.1f64,
        0.0..3.0f64,
        (-9.0..-1.0f64).prop_map(|e| PI - 10.0f64.powf(e)),
    ]
}

/// A tangent whose last `R` numbers are the rotation.
fn tangent<const D: usize, const R: usize>() -> impl Strategy<Value = SVector<f64, D>> {
    (prop::array::uniform::<_, D>(-1.0..1.0f64), angle(), prop::bool::ANY).prop_map(|(numbers, angle, sign)| {
        let mut xi = SVector::from(numbers) * 10.0;
        let mut axis = xi.fixed_rows_mut::<R>(D - R);
        let length = axis.norm();
        axis *= if length > 0.0 { angle * if sign { 1.0 } else { -1.0 } / length } else { 0.0 };
        xi
    })
}

/// The matrix whose columns are the central differences of `f` at zero.
fn differences<const D: usize>(f: impl Fn(&SVector<f64, D>) -> SVector<f64, D>) -> SMatrix<f64, D, D> {
    let h = 1e-5;
    let column = |k: usize| {
        let step = SVector::from_fn(|r, _| if r == k { h } else { 0.0 });
        (f(&step) - f(&-step)) / (2.0 * h)
    };
    SMatrix::from_columns(&std::array::from_fn::<_, D, _>(column))
}

macro_rules! laws {
    ($name:ident, $group:ty, $d:literal, $r:literal, $n:literal) => {
        mod $name {
            use super::*;
            type G = $group;
            type Tangent = SVector<f64, $d>;
            const I: fn() -> G = <G as LieGroup<$d>>::identity;

            fn exp(xi: &Tangent) -> G {
                <G as LieGroup<$d>>::exp(xi)
            }

            fn log(x: &G) -> Tangent {
                LieGroup::log(x)
            }

            fn inverse(x: &G) -> G {
                LieGroup::inverse(x)
            }

            /// How far two elements are apart, seen from both of them.
            fn apart(a: G, b: G) -> f64 {
                log(&(inverse(&a) * b)).amax()
            }

            proptest! {
                #[test]
                fn group(a in tangent::<$d, $r>(), b in tangent::<$d, $r>(), c in tangent::<$d, $r>()) {
                    let (a, b, c) = (exp(&a), exp(&b), exp(&c));
                    prop_assert!(apart(a * I(), a) < EXACT && apart(I() * a, a) < EXACT);
                    prop_assert!(apart(a * inverse(&a), I()) < EXACT && apart(inverse(&a) * a, I()) < EXACT);
                    prop_assert!(apart((a * b) * c, a * (b * c)) < 10.0 * EXACT);
                    prop_assert!(apart(LieGroup::between(&a, &b), inverse(&a) * b) < EXACT);
                }

                #[test]
                fn exp_and_log_undo_each_other(xi in tangent::<$d, $r>(), eta in tangent::<$d, $r>()) {
                    // Within 1e-9 of half a turn the logarithm amplifies rounding of the sign of a tiny cosine.
                    prop_assert!((log(&exp(&xi)) - xi).amax() < 1e-9, "{} {}", xi, log(&exp(&xi)));
                    let x = exp(&xi) * exp(&eta);
                    prop_assert!(apart(exp(&log(&x)), x) < EXACT);
                    prop_assert!((LieGroup::minus(&LieGroup::plus(&x, &xi), &x) - xi).amax() < 1e-7);
                }

                #[test]
                fn action(a in tangent::<$d, $r>(), b in tangent::<$d, $r>(), p in tangent::<$n, $n>()) {
                    let (a, b) = (exp(&a), exp(&b));
                    let act = |x: &G, p: &SVector<f64, $n>| LieGroup::act(x, p);
                    prop_assert!((act(&(a * b), &p) - act(&a, &act(&b, &p))).amax() < EXACT);
                    prop_assert!((act(&I(), &p) - p).amax() < EXACT);
                    prop_assert!((act(&inverse(&a), &act(&a, &p)) - p).amax() < EXACT);
                }

                #[test]
                fn adjoint(a in tangent::<$d, $r>(), b in tangent::<$d, $r>(), xi in tangent::<$d, $r>()) {
                    let (x, y, xi) = (exp(&a), exp(&b), xi * 0.1);
                    let ad = |x: &G| LieGroup::adjoint(x);
                    prop_assert!(apart(x * exp(&xi), exp(&(ad(&x) * xi)) * x) < 10.0 * EXACT);
                    prop_assert!((ad(&(x * y)) - ad(&x) * ad(&y)).amax() < 100.0 * EXACT);
                }

                #[test]
                fn jacobians(xi in tangent::<$d, $r>()) {
                    let x = exp(&xi);
                    let (right, left) = (<G as LieGroup<$d>>::right_jacobian(&xi), <G as LieGroup<$d>>::left_jacobian(&xi));
                    let by_right = differences(|d: &Tangent| log(&(inverse(&x) * exp(&(xi + d)))));
                    let by_left = differences(|d: &Tangent| log(&(exp(&(xi + d)) * inverse(&x))));
                    prop_assert!((right - by_right).amax() < DIFFERENCES, "right {}", right - by_right);
                    prop_assert!((left - by_left).amax() < DIFFERENCES, "left {}", left - by_left);
                    prop_assert!((left - LieGroup::adjoint(&x) * right).amax() < 100.0 * EXACT);
                    let identity = SMatrix::<f64, $d, $d>::identity();
                    let right_inverse = <G as LieGroup<$d>>::right_jacobian_inverse(&xi);
                    let left_inverse = <G as LieGroup<$d>>::left_jacobian_inverse(&xi);
                    prop_assert!((right * right_inverse - identity).amax() < 100.0 * EXACT);
                    prop_assert!((left * left_inverse - identity).amax() < 100.0 * EXACT);
                }

                #[test]
                fn interpolation(a in tangent::<$d, $r>(), xi in tangent::<$d, $r>(), u in 0.0..1.0f64, v in 0.0..1.0f64) {
                    let xi = xi * 0.9;
                    let a = exp(&a);
                    let b = a * exp(&xi);
                    let at = |u: f64| LieGroup::interpolate(&a, &b, u);
                    prop_assert!(apart(at(0.0), a) < EXACT && apart(at(1.0), b) < 1e-9);
                    prop_assert!(apart(at(u), a * exp(&(xi * u))) < 1e-9);
                    let rest = LieGroup::interpolate(&at(u), &b, v);
                    prop_assert!(apart(rest, at(u + v * (1.0 - u))) < 1e-9);
                }
            }
        }
    };
}

laws!(so2, So2, 1, 1, 2);
laws!(se2, Se2, 3, 1, 2);
laws!(so3, So3, 3, 3, 3);
laws!(se3, Se3, 6, 3, 3);

/// What the shared notation means in the plane agrees with space about z.
#[test]
fn the_plane_is_a_slice_of_space() {
    for k in 0..100 {
        let a = f64::from(k);
        let xi = nalgebra::Vector3::new(3.0 * a.sin(), a.cos(), 3.0 * (1.7 * a).sin());
        let flat = Se2::exp(xi);
        let solid = <Se3 as LieGroup<6>>::exp(&nalgebra::Vector6::new(xi.x, xi.y, 0.0, 0.0, 0.0, xi.z));
        let p = flat.act(nalgebra::Vector2::new(2.0, a));
        let q = solid.act(&nalgebra::Vector3::new(2.0, a, 0.0));
        assert!((p - q.xy()).norm() < 1e-12 * (1.0 + a) && q.z == 0.0);
    }
}

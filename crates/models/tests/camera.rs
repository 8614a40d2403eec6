//! Cameras: Jacobians against differences, the inverse, the limits, and values that OpenCV gives.
#![allow(clippy::unwrap_used)] // helpers of tests

use groma_models::camera::{Camera, Lens, ParameterJacobian};
use nalgebra::{Matrix2x3, Vector2, Vector3};
use proptest::prelude::*;

fn parameters(lens: Lens) -> Vec<f64> {
    let all = match lens {
        Lens::Equidistant => vec![400.0, 410.0, 322.0, 236.0, 0.02, -0.01, 0.004, -0.0005],
        _ => vec![535.9, 537.1, 342.3, 235.6, -0.266, 0.0986, 0.0018, -0.0013, 0.02, 0.03, -0.01, 0.002],
    };
    all[..lens.names().len()].to_vec()
}

fn camera(lens: Lens) -> Camera {
    Camera::new(640, 480, lens, parameters(lens)).unwrap()
}

fn pixel_by(lens: Lens, theta: &[f64], point: &Vector3<f64>) -> Vector2<f64> {
    Camera::new(640, 480, lens, theta.to_vec()).unwrap().project(point).unwrap()
}

fn moved(values: &[f64], k: usize, by: f64) -> Vec<f64> {
    let mut values = values.to_vec();
    values[k] += by;
    values
}

fn differences(lens: Lens, point: &Vector3<f64>) -> (Matrix2x3<f64>, ParameterJacobian) {
    let (theta, mut by_point, mut by_parameters) = (parameters(lens), Matrix2x3::zeros(), ParameterJacobian::zeros());
    for k in 0..3 {
        let at = |h: f64| pixel_by(lens, &theta, &Vector3::from_column_slice(&moved(point.as_slice(), k, h)));
        by_point.set_column(k, &central(at, 1e-3));
    }
    for k in 0..theta.len() {
        let at = |h: f64| pixel_by(lens, &moved(&theta, k, h), point);
        by_parameters.set_column(k, &central(at, if k < 4 { 1e-1 } else { 1e-3 }));
    }
    (by_point, by_parameters)
}

/// The central difference of sixth order.
fn central(f: impl Fn(f64) -> Vector2<f64>, h: f64) -> Vector2<f64> {
    let step = |k: f64| f(k * h) - f(-k * h);
    (step(1.0) * 45.0 - step(2.0) * 9.0 + step(3.0)) / (60.0 * h)
}

proptest! {
    #[test]
    fn jacobians_are_those_of_differences(x in -1.0..1.0f64, y in -0.8..0.8f64, z in 1.2..5.0f64) {
        for lens in Lens::ALL {
            let point = Vector3::new(x, y, z);
            let seen = camera(lens).project_with_jacobians(&point).unwrap();
            let (by_point, by_parameters) = differences(lens, &point);
            let off = |a: f64, b: f64| (a - b).abs() / (1.0 + b.abs());
            for (a, b) in seen.by_point.iter().zip(by_point.iter()) {
                prop_assert!(off(*a, *b) < 1e-7, "{lens:?} point {a} {b}");
            }
            for (a, b) in seen.by_parameters.iter().zip(by_parameters.iter()) {
                prop_assert!(off(*a, *b) < 1e-7, "{lens:?} parameters {a} {b}");
            }
        }
    }

    #[test]
    fn a_pixel_sees_the_direction_whose_image_it_is(u in 0.0..640.0f64, v in 0.0..480.0f64) {
        for lens in Lens::ALL {
            let pixel = Vector2::new(u, v);
            let direction = camera(lens).unproject(&pixel).unwrap();
            prop_assert!((direction.norm() - 1.0).abs() < 1e-14);
            let back = camera(lens).project(&(direction * 3.7)).unwrap();
            prop_assert!((back - pixel).norm() < 1e-9, "{lens:?} {back} {pixel}");
        }
    }
}

/// cv2.projectPoints and cv2.fisheye.projectPoints, OpenCV 4.14.0, of (0.3, -0.2, 1.5) with the parameters above.
#[test]
fn projects_as_opencv_does() {
    let point = Vector3::new(0.3, -0.2, 1.5);
    let known =
        [(Lens::PlumbBob, OPENCV_PLUMB_BOB), (Lens::Rational, OPENCV_RATIONAL), (Lens::Equidistant, OPENCV_FISHEYE)];
    for (lens, pixel) in known {
        assert!((camera(lens).project(&point).unwrap() - Vector2::from(pixel)).norm() < 1e-9, "{lens:?}");
    }
}

const OPENCV_PLUMB_BOB: [f64; 2] = [447.7210225782738, 165.19090772529455];
const OPENCV_RATIONAL: [f64; 2] = [447.5418253905217, 165.31064002552677];
const OPENCV_FISHEYE: [f64; 2] = [400.59556111370466, 182.29303323896846];

#[test]
fn the_axis_is_no_exception() {
    for lens in Lens::ALL {
        let at = |x: f64| camera(lens).project_with_jacobians(&Vector3::new(x, 0.0, 2.0)).unwrap();
        assert!((at(0.0).pixel - at(1e-8).pixel).norm() < 1e-5);
        assert!((at(0.0).by_point - at(1e-8).by_point).norm() < 1e-4);
    }
}

#[test]
fn what_would_fold_back_into_the_image_is_not_seen() {
    let theta = vec![300.0, 300.0, 320.0, 240.0, -0.3, 0.0, 0.0, 0.0];
    let folding = Camera::new(640, 480, Lens::Radtan, theta).unwrap();
    // r (1 - 0.3 r^2) turns at r = 1/sqrt(0.9).
    assert!(folding.project(&Vector3::new(1.05, 0.0, 1.0)).is_some());
    assert!(folding.project(&Vector3::new(1.06, 0.0, 1.0)).is_none());
    let highest = 320.0 + 300.0 * (2.0 / 3.0) / 0.9_f64.sqrt();
    assert!(folding.unproject(&Vector2::new(highest - 0.1, 240.0)).is_some());
    assert!(folding.unproject(&Vector2::new(highest + 0.1, 240.0)).is_none());
}

#[test]
fn only_a_fisheye_sees_behind() {
    let behind = Vector3::new(1.0, 0.0, -0.2);
    let seeing: Vec<_> = Lens::ALL.into_iter().filter(|&l| camera(l).project(&behind).is_some()).collect();
    assert_eq!(seeing, [Lens::Equidistant]);
    assert!(Lens::ALL.iter().all(|&l| camera(l).project(&Vector3::new(f64::NAN, 0.0, 1.0)).is_none()));
}

#[test]
fn senseless_numbers_are_refused_with_their_name() {
    let message = |theta: Vec<f64>| Camera::new(640, 480, Lens::Radtan, theta).unwrap_err().to_string();
    assert!(message(vec![500.0; 3]).contains("a radtan camera has 8 parameters (fx, fy, cx, cy, k1, k2, p1, p2)"));
    assert!(message(vec![500.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).starts_with("fy = -1"));
    assert!(message(vec![500.0, 500.0, f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0]).starts_with("cx = NaN"));
    assert!(Camera::centred(0, 480, Lens::Pinhole, 500.0).is_err());
    let json = r#"{"width": 640, "height": 480, "lens": "radtan", "parameters": [1]}"#;
    assert!(serde_json::from_str::<Camera>(json).is_err());
}

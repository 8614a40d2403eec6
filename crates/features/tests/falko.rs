//! FALKO on scans of simple rooms: what must not change the keypoints, what must not be one, how well corners are placed.

use groma_features::Keypoint;
use groma_features::falko::{Detector, Options, detect_all};
use groma_models::BeamGeometry;
use nalgebra::Vector2;
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use groma_estimation::random::SplitMix64;

fn geometry(angle_min: f64, angle_increment: f64) -> BeamGeometry {
    BeamGeometry { angle_min, angle_increment, time_increment: 0.0, range_min: 0.1, range_max: 20.0 }
}

fn detect(geometry: BeamGeometry, ranges: &[f64], options: Options) -> Vec<Keypoint> {
    let mut keypoints = Vec::new();
    Detector::new(geometry, ranges.len(), options).detect(ranges, &mut keypoints);
    keypoints
}

/// Range along a bearing to the nearest of some segments; infinite where there is none.
fn cast(segments: &[(Vector2<f64>, Vector2<f64>)], bearing: f64) -> f64 {
    let beam = Vector2::new(bearing.cos(), bearing.sin());
    let hit = |&(p, q): &(Vector2<f64>, Vector2<f64>)| {
        let along = q - p;
        let det = beam.perp(&along);
        let (range, share) = (p.perp(&along) / det, p.perp(&beam) / det);
        (range > 0.0 && (0.0..=1.0).contains(&share)).then_some(range)
    };
    segments.iter().filter_map(hit).fold(f64::INFINITY, f64::min)
}

/// A room with a pillar, seen from within: corners inward and outward, in all directions.
fn room() -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let rectangle = |x0: f64, y0: f64, x1: f64, y1: f64| {
        let c = [Vector2::new(x0, y0), Vector2::new(x1, y0), Vector2::new(x1, y1), Vector2::new(x0, y1)];
        (0..4).map(move |k| (c[k], c[(k + 1) % 4]))
    };
    rectangle(-3.1, -2.3, 4.7, 3.9)
        .chain(rectangle(2.0, -0.3, 2.7, 0.4))
        .chain(rectangle(-0.4, 1.5, 0.3, 2.2))
        .collect()
}

fn room_scan(geometry: &BeamGeometry, beams: usize) -> Vec<f64> {
    (0..beams).map(|i| cast(&room(), geometry.bearing(i))).collect()
}

/// Ranges as a scanner of 1 cm gives them: many ties, gaps, no returns.
fn ragged() -> impl Strategy<Value = Vec<f64>> {
    let reading = prop_oneof![
        20 => (50..90).prop_map(|r| f64::from(r) * 0.01),
        10 => (100..300).prop_map(|r| f64::from(r) * 0.01),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(0.0), Just(-1.0), Just(25.0)],
    ];
    prop::collection::vec(reading, 180)
}

fn indices(keypoints: &[Keypoint]) -> Vec<usize> {
    keypoints.iter().map(|k| k.index).collect()
}

proptest! {
    #[test]
    fn turning_the_scanner_turns_the_keypoints(ranges in ragged(), angle in -20.0..20.0_f64) {
        let before = detect(geometry(-FRAC_PI_2, PI / 180.0), &ranges, Options::default());
        let after = detect(geometry(-FRAC_PI_2 + angle, PI / 180.0), &ranges, Options::default());
        prop_assert_eq!(indices(&before), indices(&after));
        let rotation = nalgebra::Rotation2::new(angle);
        for (a, b) in before.iter().zip(&after) {
            prop_assert!((rotation * a.point - b.point).norm() < 1e-12);
            prop_assert!((a.orientation + angle - b.orientation).sin().abs() < 1e-12);
            let turned = rotation.matrix() * a.covariance * rotation.matrix().transpose();
            prop_assert!((turned - b.covariance).norm() < 1e-9 * turned.norm());
        }
    }

    /// A scanner that turns the other way, or is mounted upside down, sees the mirror image. The search for the best of
    /// a neighbourhood runs along the beams, so the peaks are compared where every candidate is one.
    #[test]
    fn mirroring_mirrors_the_keypoints(ranges in ragged()) {
        let options = Options { suppression_radius: 0.0, ..Options::default() };
        let before = detect(geometry(-FRAC_PI_2, PI / 180.0), &ranges, options);
        let reversed: Vec<f64> = ranges.iter().rev().copied().collect();
        for (mirrored, angle_min, increment) in [(&ranges, FRAC_PI_2, -1.0), (&reversed, -FRAC_PI_2, 1.0)] {
            let mut after = detect(geometry(angle_min, increment * PI / 180.0), mirrored, options);
            if increment > 0.0 {
                after.reverse();
                after.iter_mut().for_each(|k| {
                    k.index = ranges.len() - 1 - k.index;
                    k.point = nalgebra::Rotation2::new(PI / 180.0) * k.point; // bearings -90 .. 89
                });
            }
            prop_assert_eq!(indices(&before), indices(&after));
            for (a, b) in before.iter().zip(&after) {
                prop_assert!((a.point - Vector2::new(b.point.x, -b.point.y)).norm() < 1e-9);
            }
        }
    }

    #[test]
    fn where_a_closed_scan_begins_does_not_matter(shift in 0_usize..720) {
        let step = TAU / 720.0;
        let before = room_scan(&geometry(0.0, step), 720);
        let mut after = before.clone();
        after.rotate_left(shift);
        let (before, mut after) = (
            detect(geometry(0.0, step), &before, Options::default()),
            detect(geometry(shift as f64 * step, step), &after, Options::default()),
        );
        after.iter_mut().for_each(|k| k.index = (k.index + shift) % 720);
        after.sort_by_key(|k| k.index);
        prop_assert_eq!(indices(&before), indices(&after));
        prop_assert!(before.iter().zip(&after).all(|(a, b)| (a.point - b.point).norm() < 1e-9));
    }

    #[test]
    fn what_is_no_hit_changes_nothing(ranges in ragged(), bad in prop::sample::select(vec![f64::NAN, f64::INFINITY, -1.0, 0.0])) {
        let geometry = geometry(-FRAC_PI_2, PI / 180.0);
        let swapped: Vec<f64> = ranges.iter().map(|&r| if geometry.is_hit(r) { r } else { bad }).collect();
        prop_assert_eq!(detect(geometry, &ranges, Options::default()), detect(geometry, &swapped, Options::default()));
    }

    #[test]
    fn any_options_and_geometry_are_survived(
        ranges in prop::collection::vec(prop_oneof![0.0..3.0_f64, Just(f64::NAN)], 0..40),
        angle_increment in prop_oneof![-2.0..2.0_f64, Just(0.0), Just(f64::NAN), Just(TAU / 36.0)],
        a in 0.01..5.0_f64,
        beams in 0_usize..50,
    ) {
        let mut keypoints = Vec::new();
        let mut detector = Detector::new(geometry(0.0, angle_increment), beams, Options { a, ..Options::default() });
        detector.detect(&ranges, &mut keypoints);
        prop_assert!(keypoints.iter().all(|k| k.point.norm().is_finite() && k.index < beams.max(1)));
    }
}

#[test]
fn finds_the_corners_of_a_room() {
    let geometry = geometry(0.3, TAU / 720.0);
    let found = detect(geometry, &room_scan(&geometry, 720), Options::default());
    let corners: Vec<_> = room().iter().map(|s| s.0).collect();
    let nearest = |p: Vector2<f64>| corners.iter().map(|c| (c - p).norm()).fold(f64::INFINITY, f64::min);
    assert!(found.iter().all(|k| nearest(k.point) < 0.05), "{found:?}");
    for corner in &corners[..4] {
        let keypoint = found.iter().find(|k| (k.point - corner).norm() < 0.05).unwrap();
        // A corner of the room opens inward, along its diagonal.
        let diagonal = Vector2::new(-corner.x.signum(), -corner.y.signum());
        let opening = Vector2::new(keypoint.orientation.cos(), keypoint.orientation.sin());
        assert!(opening.angle(&diagonal) < 0.2, "{keypoint:?}");
    }
}

/// The corner straight behind, where the first and the last beam meet.
#[test]
fn finds_the_corner_at_the_seam() {
    let walls =
        [(Vector2::new(-3.0, 0.0), Vector2::new(-1.0, 2.0)), (Vector2::new(-3.0, 0.0), Vector2::new(-1.0, -2.0))];
    for shift in [-0.5, 0.0, 0.5] {
        let geometry = geometry(-PI + shift * PI / 360.0, PI / 360.0);
        let ranges: Vec<f64> = (0..720).map(|i| cast(&walls, geometry.bearing(i))).collect();
        let found = detect(geometry, &ranges, Options::default());
        assert!(!found.is_empty());
        assert!(found.iter().all(|k| (k.point - walls[0].0).norm() < 0.01), "{found:?}");
        let one_more: Vec<f64> = ranges.iter().chain(&ranges[..1]).copied().collect();
        assert_eq!(detect(geometry, &one_more, Options::default()), found, "a last beam that repeats the first");
    }
}

#[test]
fn many_scans_at_once_equal_one_by_one() {
    let geometry = geometry(-1.0, 0.01);
    let mut draw = SplitMix64::new(3);
    let mut scan = |n: usize| (0..n).map(|_| 1.0 + 0.3 * draw.uniform()).collect::<Vec<_>>();
    let scans: Vec<Vec<f64>> = (0..40).map(|k| scan(if k % 7 == 0 { 100 } else { 200 })).collect();
    let slices: Vec<&[f64]> = scans.iter().map(Vec::as_slice).collect();
    let each: Vec<_> = scans.iter().map(|s| detect(geometry, s, Options::default())).collect();
    assert!(each.iter().any(|k| !k.is_empty()));
    assert_eq!(detect_all(geometry, &slices, Options::default()), each);
}

/// Squared Mahalanobis error of corners of many angles, places, resolutions and noises: of 2 degrees of freedom the mean
/// is 2 and 5 % exceed 5.99. The band is that of a model of second order with two factors for all.
#[test]
fn covariance_covers() {
    for (step, sigma) in [(0.005, 0.005), (0.005, 0.01), (0.005, 0.03), (0.0175, 0.005), (0.0175, 0.01), (0.0175, 0.03)]
    {
        let mut draw = SplitMix64::new(11);
        let errors: Vec<f64> = (0..3000).filter_map(|_| corner_error(step, sigma, &mut draw)).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let outside = errors.iter().filter(|e| **e > 5.99).count() as f64 / errors.len() as f64;
        assert!(errors.len() > 1000);
        assert!((1.4..3.0).contains(&mean) && outside < 0.12, "{step} {sigma}: mean {mean}, outside {outside}");
    }
}

/// The error of the keypoint nearest to a random corner.
fn corner_error(step: f64, sigma: f64, draw: &mut SplitMix64) -> Option<f64> {
    let (distance, bearing) = (1.0 + 4.0 * draw.uniform(), draw.uniform() - 0.5);
    let corner = Vector2::new(bearing.cos(), bearing.sin()) * distance;
    let (inside, facing) = (1.2 + 1.2 * draw.uniform(), bearing + PI + 0.6 * (draw.uniform() - 0.5));
    let wall = |angle: f64| (corner, corner + Vector2::new(angle.cos(), angle.sin()) * 1.5);
    let walls = [wall(facing - 0.5 * inside), wall(facing + 0.5 * inside)];
    let geometry = geometry(-1.2, step);
    let ranges: Vec<f64> =
        (0..(2.4 / step) as usize).map(|i| cast(&walls, geometry.bearing(i)) + sigma * draw.normal()).collect();
    let options = Options { range_noise: sigma, ..Options::default() };
    let found = detect(geometry, &ranges, options);
    let nearest = found.iter().min_by(|s, t| (s.point - corner).norm().total_cmp(&(t.point - corner).norm()))?;
    let error = nearest.point - corner;
    let inverse = nearest.covariance.try_inverse()?;
    (error.norm() < 0.3).then(|| error.dot(&(inverse * error)))
}

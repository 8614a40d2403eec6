//! Reflectors in scans of a hall: found on scanners of every kind, placed without bias, as well as they say.

use groma_features::reflector::{Options, Reflector, detect};
use groma_models::BeamGeometry;
use nalgebra::Vector2;
use std::f64::consts::{PI, TAU};

use groma_estimation::random::SplitMix64;

const SIGMA: f64 = 0.012;

#[derive(Clone, Copy)]
enum Mark {
    /// Middle, direction of its length [rad], length [m].
    Flat(Vector2<f64>, f64, f64),
    /// Axis; the radius is that of the options.
    Post(Vector2<f64>),
}

/// What an intensity is on a scanner.
#[derive(Clone, Copy, Debug)]
enum Scaling {
    Raw,
    Compensated,
    /// A root in steps of 256, saturated by tape.
    Compressed,
}

fn geometry(step_deg: f64) -> BeamGeometry {
    let step = step_deg.to_radians();
    BeamGeometry { angle_min: -0.75 * PI, angle_increment: step, time_increment: 0.0, range_min: 0.1, range_max: 30.0 }
}

fn beams(geometry: &BeamGeometry) -> usize {
    (1.5 * PI / geometry.angle_increment) as usize + 1
}

/// Range and cosine of the incidence on a mark.
fn meet(mark: &Mark, beam: Vector2<f64>) -> Option<(f64, f64)> {
    match *mark {
        Mark::Flat(middle, direction, length) => {
            let along = Vector2::new(direction.cos(), direction.sin());
            let det = beam.perp(&along);
            let (range, place) = (middle.perp(&along) / det, middle.perp(&beam) / det);
            (range > 0.0 && place.abs() <= length / 2.0).then_some((range, det.abs()))
        }
        Mark::Post(axis) => {
            let radius = Options::default().post_radius;
            let (along, aside) = (axis.dot(&beam), axis.perp(&beam));
            let inside = radius * radius - aside * aside;
            (along > 0.0 && inside > 0.0).then(|| (along - inside.sqrt(), inside.sqrt() / radius))
        }
    }
}

/// Range and cosine to the walls of a hall of 24 m by 14 m around the scanner.
fn hall(beam: Vector2<f64>) -> (f64, f64) {
    let to = |wall: f64, along: f64| if along == 0.0 { f64::INFINITY } else { wall * along.signum() / along };
    let (x, y) = (to(12.0, beam.x), to(7.0, beam.y));
    if x < y { (x, beam.x.abs()) } else { (y, beam.y.abs()) }
}

/// A hall with marks.
struct Scene<'a> {
    marks: &'a [Mark],
    scaling: Scaling,
    geometry: BeamGeometry,
}

impl Scene<'_> {
    fn scan(&self, noise: &mut SplitMix64) -> (Vec<f64>, Vec<f64>) {
        (0..beams(&self.geometry)).map(|i| self.reading(self.geometry.bearing(i), noise)).unzip()
    }

    fn reading(&self, bearing: f64, noise: &mut SplitMix64) -> (f64, f64) {
        let beam = Vector2::new(bearing.cos(), bearing.sin());
        let mark = self.marks.iter().filter_map(|m| meet(m, beam)).min_by(|a, b| a.0.total_cmp(&b.0));
        // Walls are painted in strips of 2 m of unequal brightness.
        let wall = hall(beam);
        let paint = 0.2 + 0.15 * f64::from(((beam.x + beam.y) * wall.0 / 2.0).floor() as i32 % 5).abs();
        let ((range, cos), reflectivity) = mark.map_or((wall, paint), |m| (m, 30.0));
        let light = reflectivity * cos * (0.1 * noise.normal()).exp();
        let fallen = light / (1.0 + (range / 5.0_f64).powi(2));
        let intensity = match self.scaling {
            Scaling::Raw => 1000.0 * fallen,
            Scaling::Compensated => 100.0 * light,
            Scaling::Compressed => (100.0 * fallen.sqrt()).min(255.0).round(),
        };
        (range + SIGMA * noise.normal(), intensity)
    }
}

fn options() -> Options {
    Options { range_noise: SIGMA, ..Options::default() }
}

fn place(angle: f64, range: f64) -> Vector2<f64> {
    Vector2::new(angle.cos(), angle.sin()) * range
}

/// A mark somewhere in view.
fn random_mark(noise: &mut SplitMix64, post: bool, within: f64) -> (Mark, Vector2<f64>) {
    let (angle, range) = (4.4 * (noise.uniform() - 0.5), 1.0 + (within - 1.0) * noise.uniform());
    let middle = place(angle, range);
    let facing = angle + PI / 2.0 + 1.6 * (noise.uniform() - 0.5);
    (if post { Mark::Post(middle) } else { Mark::Flat(middle, facing, 0.2 + 0.3 * noise.uniform()) }, middle)
}

fn nearest(found: &[Reflector], to: Vector2<f64>) -> Option<Reflector> {
    let distance = |r: &Reflector| (r.point - to).norm();
    found.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b))).filter(|r| distance(r) < 0.3)
}

/// Detected, errors, and squared errors over their covariance, of marks placed at random.
struct Tally {
    share: f64,
    bias_along: f64,
    nees: f64,
    false_per_scan: f64,
}

fn tally(post: bool, scaling: Scaling, step_deg: f64, runs: usize) -> Tally {
    let mut noise = SplitMix64::new(7 + step_deg.to_bits());
    let (mut seen, mut bias, mut nees, mut others) = (0.0, 0.0, 0.0, 0.0);
    for _ in 0..runs {
        let (mark, middle) = random_mark(&mut noise, post, 6.5);
        let scene = Scene { marks: &[mark], scaling, geometry: geometry(step_deg) };
        let (ranges, intensities) = scene.scan(&mut noise);
        let found = detect(&ranges, &intensities, &scene.geometry, &options());
        let Some(best) = nearest(&found, middle) else {
            others += found.len() as f64;
            continue;
        };
        let error = best.point - middle;
        seen += 1.0;
        bias += error.dot(&middle.normalize());
        nees += best.covariance.try_inverse().map_or(f64::NAN, |information| error.dot(&(information * error)));
        others += found.len() as f64 - 1.0;
    }
    let runs = runs as f64;
    Tally { share: seen / runs, bias_along: bias / seen, nees: nees / seen, false_per_scan: others / runs }
}

#[test]
fn marks_are_found_whatever_the_scanner_calls_an_intensity() {
    for scaling in [Scaling::Raw, Scaling::Compensated, Scaling::Compressed] {
        for post in [false, true] {
            let t = tally(post, scaling, 0.5, 300);
            assert!(t.share > 0.97 && t.false_per_scan < 0.02, "{scaling:?} {post} {} {}", t.share, t.false_per_scan);
        }
    }
}

#[test]
fn centres_are_where_they_are_said_to_be() {
    for (post, step) in [(false, 0.25), (false, 0.5), (true, 0.25), (true, 0.5)] {
        let t = tally(post, Scaling::Raw, step, 1500);
        // Far posts look nearly like narrow flat marks, whose middle is nearer than an axis.
        assert!(t.bias_along.abs() < if post { 0.006 } else { 0.001 }, "post {post}, {step} deg: {} m", t.bias_along);
        // Two degrees of freedom; edges are uniform, not Gaussian, so it may be below two, hardly above.
        assert!((1.2..2.4).contains(&t.nees), "post {post}, {step} deg: {}", t.nees);
    }
}

#[test]
fn without_noise_a_flat_mark_is_placed_to_a_beam() {
    let mark = Mark::Flat(place(0.3, 3.0), 0.3 + PI / 2.0 + 0.5, 0.4);
    let scene = Scene { marks: &[mark], scaling: Scaling::Compensated, geometry: geometry(0.1) };
    let (ranges, intensities) = scene.scan(&mut SplitMix64::new(1));
    let found = detect(&ranges, &intensities, &scene.geometry, &options());
    assert_eq!(found.len(), 1);
    assert!((found[0].point - place(0.3, 3.0)).norm() < 0.008);
    assert!(found[0].post < 1e-6 && (found[0].width - 0.35).abs() < 0.02);
}

#[test]
fn turning_and_mirroring_the_scanner_moves_the_marks_along() {
    let marks = [Mark::Flat(place(0.3, 3.0), 2.0, 0.4), Mark::Post(place(-1.0, 2.0))];
    let scene = Scene { marks: &marks, scaling: Scaling::Raw, geometry: geometry(0.25) };
    let (ranges, intensities) = scene.scan(&mut SplitMix64::new(3));
    let before = detect(&ranges, &intensities, &scene.geometry, &options());
    let turned = BeamGeometry { angle_min: scene.geometry.angle_min + 1.0, ..scene.geometry };
    let after = detect(&ranges, &intensities, &turned, &options());
    let mirrored = BeamGeometry {
        angle_min: -scene.geometry.angle_min,
        angle_increment: -scene.geometry.angle_increment,
        ..scene.geometry
    };
    let mirror = detect(&ranges, &intensities, &mirrored, &options());
    assert_eq!((before.len(), after.len(), mirror.len()), (2, 2, 2));
    for ((a, b), c) in before.iter().zip(&after).zip(&mirror) {
        assert!((nalgebra::Rotation2::new(1.0) * a.point - b.point).norm() < 1e-12);
        assert!((Vector2::new(a.point.x, -a.point.y) - c.point).norm() < 1e-12);
        assert!((a.covariance.m12 + c.covariance.m12).abs() < 1e-15);
    }
}

#[test]
fn a_mark_across_the_seam_of_a_closed_scan_is_whole() {
    let closed = BeamGeometry { angle_min: 0.0, angle_increment: TAU / 1440.0, ..geometry(0.25) };
    let scene =
        Scene { marks: &[Mark::Flat(place(0.01, 3.0), PI / 2.0, 0.4)], scaling: Scaling::Raw, geometry: closed };
    let mut noise = SplitMix64::new(5);
    let (ranges, intensities): (Vec<f64>, Vec<f64>) =
        (0..1440).map(|i| scene.reading(closed.bearing(i), &mut noise)).unzip();
    let found = detect(&ranges, &intensities, &closed, &options());
    assert_eq!(found.len(), 1);
    assert!((found[0].point - place(0.01, 3.0)).norm() < 0.02);
}

#[test]
fn a_mark_that_is_partly_hidden_or_leaves_the_scan_is_none() {
    let mark = Mark::Flat(place(0.0, 4.0), PI / 2.0, 0.5);
    let scene = Scene { marks: &[mark], scaling: Scaling::Raw, geometry: geometry(0.25) };
    let (mut ranges, mut intensities) = scene.scan(&mut SplitMix64::new(2));
    for i in 0..beams(&scene.geometry) {
        if (0.0..0.2).contains(&scene.geometry.bearing(i)) {
            (ranges[i], intensities[i]) = (2.0, 100.0);
        }
    }
    let is_found = |found: &[Reflector]| nearest(found, place(0.0, 4.0)).is_some();
    assert!(!is_found(&detect(&ranges, &intensities, &scene.geometry, &options())));
    let cut = beams(&scene.geometry) / 2;
    let (ranges, intensities) = scene.scan(&mut SplitMix64::new(2));
    assert!(is_found(&detect(&ranges, &intensities, &scene.geometry, &options())));
    assert!(!is_found(&detect(&ranges[..cut], &intensities[..cut], &scene.geometry, &options())));
}

#[test]
fn scans_without_usable_intensities_have_no_reflectors() {
    let scene = Scene { marks: &[Mark::Post(place(0.0, 3.0))], scaling: Scaling::Raw, geometry: geometry(0.5) };
    let (ranges, intensities) = scene.scan(&mut SplitMix64::new(2));
    let n = ranges.len();
    let detect = |ranges: &[f64], intensities: &[f64]| detect(ranges, intensities, &scene.geometry, &options()).len();
    assert_eq!(detect(&ranges, &[]), 0);
    assert_eq!(detect(&ranges, &intensities[1..]), 0);
    assert_eq!(detect(&ranges, &vec![0.0; n]), 0);
    assert_eq!(detect(&ranges, &vec![7.0; n]), 0);
    assert_eq!(detect(&ranges, &vec![f64::NAN; n]), 0);
    assert_eq!(detect(&vec![f64::INFINITY; n], &intensities), 0);
    assert_eq!(detect(&[], &[]), 0);
    let mut some = intensities.clone();
    some.iter_mut().step_by(7).for_each(|i| *i = f64::NAN);
    assert_eq!(detect(&ranges, &some), 1);
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    assert!(Options::default().validate().is_ok());
    let wrong = [
        (Options { contrast: 1.0, ..options() }, "contrast"),
        (Options { width_max: 0.01, ..options() }, "width_max"),
        (Options { post_radius: f64::NAN, ..options() }, "post_radius"),
        (Options { range_noise: 0.0, ..options() }, "range_noise"),
    ];
    for (options, name) in wrong {
        assert_eq!(options.validate().unwrap_err().name, name);
    }
}

//! The findings of a survey, and what a person should look after first.

use super::Counts;
use groma_geometry::Separation;
use groma_models::Finding;
use groma_models::finding::Code;
use groma_network::survey::{CameraResult, KnownCamera, Moved, Verdict};
use groma_network::{NetworkMap, Options};

/// Chi-square per degree of freedom from which on standard deviations are called too small.
const DISHONEST: f64 = 1.5;
/// A camera fits badly when its chi-square is so many times that of all.
const WORSE: f64 = 2.0;
/// Steps of odometry from which on their fit says something.
const LEAST_STEPS: usize = 10;

pub(super) fn findings(map: &NetworkMap, cameras: &[KnownCamera], counts: Counts, options: &Options) -> Vec<Finding> {
    let name = |camera: usize| cameras.get(camera).map_or("", |known| known.name.as_str());
    let all = [
        no_camera(map),
        slipped(map),
        not_converged(map, options),
        moved(map, name),
        corners(map, name),
        odometry(map),
        weak(map, name),
        unseen(map, cameras),
        left_out(map),
        invalid(counts),
    ];
    all.concat()
}

fn no_camera(map: &NetworkMap) -> Vec<Finding> {
    let none = map.cameras.is_empty();
    none.then(|| Finding::new(Code::NoEstimate, "no camera saw the target well enough to be placed"))
        .into_iter()
        .collect()
}

fn not_converged(map: &NetworkMap, options: &Options) -> Vec<Finding> {
    let (steps, converged) = map.steps;
    let text = format!("the adjustment of all poses did not converge in {steps} steps");
    let finding = || Finding::new(Code::NotConverged, text).with("steps", steps as f64, "1");
    (!converged && options.batch_steps > 0).then(finding).into_iter().collect()
}

fn slipped(map: &NetworkMap) -> Vec<Finding> {
    let Some(slip) = map.slip else { return vec![] };
    let first = map.moved.iter().filter_map(|m| since(map, m)).fold(f64::INFINITY, f64::min);
    let text = format!("{} cameras in turn seem moved: the odometry slipped or jumped before", slip.cameras);
    let finding = Finding::new(Code::OdometrySlipped, text).with("cameras", slip.cameras as f64, "1");
    vec![if first.is_finite() { finding.during(first, first) } else { finding }]
}

/// Stamp from which on a camera is where it is now [s].
fn since(map: &NetworkMap, moved: &Moved) -> Option<f64> {
    map.cameras.get(moved.to).and_then(|camera| map.stamps.get(camera.since)).copied()
}

fn moved<'a>(map: &NetworkMap, name: impl Fn(usize) -> &'a str) -> Vec<Finding> {
    let finding = |m: &Moved| {
        let (old, new) = map.cameras.get(m.from).zip(map.cameras.get(m.to))?;
        let Separation { distance, angle: turn } = old.separation(new);
        let text = format!(
            "{} was moved during the survey, by {distance:.3} m and {:.2}°: it was mapped anew from then on",
            name(m.camera),
            turn.to_degrees()
        );
        let finding = Finding::new(Code::CameraMoved, text)
            .at(new.pose.translation.x, new.pose.translation.y)
            .with("distance", distance, "m")
            .with("turn", turn, "rad");
        Some(since(map, m).map_or(finding.clone(), |stamp| finding.during(stamp, stamp)))
    };
    if map.slip.is_some() { vec![] } else { map.moved.iter().filter_map(finding).collect() }
}

fn current(map: &NetworkMap) -> impl Iterator<Item = &CameraResult> {
    map.cameras.iter().filter(|camera| camera.current)
}

fn corners<'a>(map: &NetworkMap, name: impl Fn(usize) -> &'a str) -> Vec<Finding> {
    let Some(all) = map.corner_chi_square() else { return vec![] };
    let of_all = (all > DISHONEST).then(|| {
        let text = format!(
            "corners fit {:.1} times worse than their σ: check sizes and places of the panels in the target file, the \
             calibration of the cameras, and the σ of the detector",
            all.sqrt()
        );
        Finding::new(Code::SigmaTooSmall, text).with("factor", all.sqrt(), "1")
    });
    let of_one = |camera: &CameraResult| {
        let factor = camera.chi_square_per_dof().sqrt();
        let text = format!("{}: its corners fit {factor:.1} times worse than their σ", name(camera.camera));
        placed(Finding::new(Code::CameraMisfit, text), camera).with("factor", factor, "1")
    };
    let bad = current(map).filter(|camera| camera.chi_square_per_dof() > WORSE * all.max(1.0));
    of_all.into_iter().chain(bad.map(of_one)).collect()
}

fn placed(finding: Finding, camera: &CameraResult) -> Finding {
    finding.at(camera.pose.translation.x, camera.pose.translation.y)
}

fn odometry(map: &NetworkMap) -> Vec<Finding> {
    let (chi_square, steps) = map.residuals.odometry;
    let ratio = chi_square / steps.max(1) as f64;
    let text = format!(
        "the odometry is {:.1} times worse than its settings say: raise those of [cameras.odometry]",
        ratio.sqrt()
    );
    let finding = || Finding::new(Code::SigmaTooSmall, text).with("factor", ratio.sqrt(), "1");
    (steps > LEAST_STEPS && ratio > DISHONEST).then(finding).into_iter().collect()
}

fn weak<'a>(map: &NetworkMap, name: impl Fn(usize) -> &'a str) -> Vec<Finding> {
    let finding = |camera: &CameraResult| {
        let weak = camera.weak_direction()?;
        let direction = if weak.is_vertical() {
            "in height".to_owned()
        } else {
            format!("along {:.0}° from the x axis of the map", weak.azimuth().to_degrees())
        };
        let text =
            format!("{}: σ {:.3} m {direction}, {:.3} m across it", name(camera.camera), weak.sigma, weak.across);
        let finding = placed(Finding::new(Code::CameraWeak, text), camera);
        Some(finding.with("sigma", weak.sigma, "m").with("sigma_across", weak.across, "m"))
    };
    current(map).filter_map(finding).collect()
}

fn unseen(map: &NetworkMap, cameras: &[KnownCamera]) -> Vec<Finding> {
    let is_seen = |camera: usize| map.cameras.iter().any(|c| c.camera == camera);
    let text = |known: &KnownCamera| format!("{}: never seen well enough to be placed", known.name);
    let missing = cameras.iter().enumerate().filter(|(k, _)| !is_seen(*k));
    missing.map(|(_, known)| Finding::new(Code::CameraUnseen, text(known))).collect()
}

fn left_out(map: &NetworkMap) -> Vec<Finding> {
    let reasons = [
        (Verdict::Rejected, "contradict where the cameras are by all others"),
        (Verdict::Undecided, "fit two poses of the target, of cameras that are not placed yet"),
        (Verdict::NoPose, "fit no pose of the target"),
    ];
    let finding = |(verdict, why): (Verdict, &str)| {
        let views =
            map.judged.iter().enumerate().filter(|(k, v)| v.verdict == verdict && !map.used.contains(k)).count();
        let found =
            || Finding::new(Code::ViewsLeftOut, format!("{views} views {why}")).with("views", views as f64, "1");
        (views > 0).then(found)
    };
    reasons.into_iter().filter_map(finding).collect()
}

fn invalid(counts: Counts) -> Vec<Finding> {
    let kinds = [("readings of the odometry", counts.odometry_invalid), ("detections", counts.detections_invalid)];
    let finding = |(what, count): (&str, usize)| {
        let text = format!("{count} {what} make no sense and were left out");
        (count > 0).then(|| Finding::new(Code::ValuesInvalid, text).with("messages", count as f64, "1"))
    };
    kinds.into_iter().filter_map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::{LieGroup, Se3};
    use groma_network::batch::Residuals;
    use groma_network::survey::{Judged, Slip};
    use groma_simulation::network::NetworkScene;
    use nalgebra::{DMatrix, Matrix6, Vector3, Vector6};

    fn known() -> Vec<KnownCamera> {
        let cameras = NetworkScene::named("corridor", 1).unwrap().cameras.into_iter().take(3);
        cameras.map(|c| KnownCamera { name: c.name, camera: c.camera, covariance: None }).collect()
    }

    /// A map of three cameras that are known to a centimetre and fit as they should.
    fn good() -> NetworkMap {
        let place = |(k, known): (usize, &KnownCamera)| CameraResult {
            camera: k,
            since: k,
            current: true,
            pose: Se3 { translation: Vector3::new(k as f64, 5.0, 2.0), ..Se3::identity() },
            covariance: Matrix6::identity() * 1e-4,
            intrinsics: known.camera.clone(),
            intrinsics_covariance: DMatrix::zeros(0, 0),
            views: 1,
            chi_square: (100.0, 106),
        };
        let residuals = Residuals { views: vec![(1000.0, 1000)], odometry: (40.0, 40), ..Residuals::default() };
        NetworkMap {
            cameras: known().iter().enumerate().map(place).collect(),
            joint: None,
            stops: vec![],
            stamps: vec![10.0, 20.0, 30.0],
            odometry: vec![],
            mount: (Se3::identity(), Matrix6::zeros()),
            judged: vec![],
            used: vec![],
            moved: vec![],
            slip: None,
            residuals,
            unknowns: 0,
            steps: (5, true),
        }
    }

    fn told(change: impl Fn(&mut NetworkMap)) -> Vec<Finding> {
        let mut map = good();
        change(&mut map);
        findings(&map, &known(), Counts::default(), &Options::default())
    }

    fn value(finding: &Finding, name: &str) -> f64 {
        finding.values.iter().find(|v| v.name == name).unwrap().value
    }

    #[test]
    fn a_camera_that_fits_worse_than_all_is_told_once_it_is_worse_than_its_sigma_too() {
        assert_eq!(told(|_| ()), []);
        let [found] = &told(|map| map.cameras[2].chi_square.0 = 900.0)[..] else { panic!("one finding") };
        assert_eq!((found.code, found.place, value(found, "factor")), (Code::CameraMisfit, Some([2.0, 5.0]), 3.0));
        assert!(found.text.starts_with(&known()[2].name));
        let left = |map: &mut NetworkMap| {
            (map.cameras[2].chi_square.0, map.cameras[2].current) = (900.0, false);
        };
        assert_eq!(told(left), [], "it hangs there no more");
        let cautious = |map: &mut NetworkMap| {
            map.residuals.views[0].0 = 100.0;
            map.cameras[2].chi_square.0 = 80.0;
        };
        assert_eq!(told(cautious), []);
    }

    #[test]
    fn an_odometry_three_times_worse_than_it_says_is_told_where_there_is_enough_of_it() {
        let [found] = &told(|map| map.residuals.odometry = (360.0, 40))[..] else { panic!("one finding") };
        assert_eq!((found.code, value(found, "factor")), (Code::SigmaTooSmall, 3.0));
        assert_eq!(told(|map| map.residuals.odometry = (36.0, 4)), []);
    }

    #[test]
    fn the_weak_direction_of_a_camera_is_reported_in_words_and_numbers() {
        for (axis, words) in [(0, "along 0°"), (1, "along 90°"), (2, "in height")] {
            let mut variances = Vector6::from_element(1e-4);
            variances[axis] = 0.0064;
            let found = told(|map| map.cameras[1].covariance = Matrix6::from_diagonal(&variances));
            assert_eq!((found.len(), found[0].code, found[0].place), (1, Code::CameraWeak, Some([1.0, 5.0])));
            assert!(found[0].text.contains(words), "{}", found[0].text);
            let (sigma, across) = (value(&found[0], "sigma"), value(&found[0], "sigma_across"));
            assert!((sigma - 0.08).abs() < 1e-9 && (across - 0.01).abs() < 1e-9, "{sigma} {across}");
        }
    }

    #[test]
    fn views_that_the_map_does_not_rest_on_are_counted_by_reason() {
        use Verdict::{Born, NoPose, Rejected, Taken, Undecided};
        let views = [Rejected, Born, Rejected, Undecided, NoPose, Rejected, Taken, NoPose, NoPose];
        let judged = views.map(|verdict| Judged { stop: 0, camera: 0, place: None, nis: 0.0, verdict });
        let found = told(|map| (map.judged, map.used) = (judged.to_vec(), vec![0, 1, 6]));
        let counts: Vec<_> = found.iter().map(|f| (f.code, value(f, "views"))).collect();
        assert_eq!(counts, [2.0, 1.0, 3.0].map(|n| (Code::ViewsLeftOut, n)));
        assert!(found[0].text.contains("contradict") && found[1].text.contains("two poses"));
    }

    #[test]
    fn an_odometry_slipped_before_the_first_of_the_cameras_that_seem_moved() {
        let moved = [2, 1].map(|k| Moved { camera: k, from: 0, to: k }).to_vec();
        let found = told(|map| (map.moved, map.slip) = (moved.clone(), Some(Slip { cameras: 2 })));
        assert_eq!((found.len(), found[0].code, found[0].span), (1, Code::OdometrySlipped, Some((20.0, 20.0))));
    }
}

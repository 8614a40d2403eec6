//! What a survey says of itself, as findings, and what a person should look after first.

use super::Counts;
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
        let (distance, turn) = old.motion_to(new);
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

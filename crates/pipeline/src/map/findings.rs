//! The findings of a finished map.
//!
//! | finding | when |
//! |---|---|
//! | map-torn | a scan was not found on the map and no odometry bridged the gap |
//! | closure-violated | more than `STRAINED` of the closures whose views agree cannot be met by the whole graph |
//! | loop-none | no loop closure |
//! | weak-stretch | registration alone constrains the position poorly there |
//! | odometry-overruled | scans before which odometry had failed |
//! | odometry-missing | no odometry at all |
//! | scanner-offset | odometry and scans agree best with the scanner `OFFSET` or more from its mount, beyond 3 sigma |
//! | limit-reached | the map is too large for the cell that was requested |
//! | interrupted | the conclusion was cancelled |

use crate::text::fixed;
use groma_mapping::map_result::MapResult;
use groma_mapping::weak::{Reason, WeakSpot};
use groma_models::Finding;
use groma_models::finding::Code;

/// Share of the closures that may turn out to be violated: single ones are false, many tell of a bent map.
const STRAINED: f64 = 0.1;
/// A scanner that sits this far from its mount is reported of [m].
const OFFSET: f64 = 0.05;
/// Weak stretches that are told one by one, the worst.
const MOST_WEAK: usize = 10;

/// The findings of a map.
pub(super) fn findings(map: &MapResult) -> Vec<Finding> {
    let single = [interrupted(map), strained(map), loop_none(map), odometry(map), offset(map), cell(map)];
    single.into_iter().flatten().chain(weak_stretches(map)).collect()
}

/// Where the map may be torn, all; where it is weakly constrained, the worst, and how many more.
fn weak_stretches(map: &MapResult) -> Vec<Finding> {
    let (torn, mut held): (Vec<&WeakSpot>, Vec<&WeakSpot>) = map.weak.iter().partition(|w| w.reason == Reason::Torn);
    held.sort_by(|a, b| b.sigma.total_cmp(&a.sigma));
    let told = held.iter().take(MOST_WEAK);
    let mut found: Vec<Finding> = torn.iter().chain(told).map(|w| stretch(w)).collect();
    if let Some(next) = held.get(MOST_WEAK) {
        let (others, sigma) = (held.len() - MOST_WEAK, next.sigma);
        let text = format!("{others} more stretches are weakly constrained, none worse than {sigma:.2} m");
        found.push(
            Finding::new(Code::WeakStretch, text).with("stretches", others as f64, "1").with("sigma", sigma, "m"),
        );
    }
    found
}

fn interrupted(map: &MapResult) -> Option<Finding> {
    let text = "the run was interrupted: the map is that of the graph as it stood, without a last search for loops";
    map.is_interrupted.then(|| Finding::new(Code::Interrupted, text))
}

fn strained(map: &MapResult) -> Option<Finding> {
    let violated: Vec<_> = map.violated().collect();
    let passed = violated.len() + map.accepted().count();
    let worst = violated.iter().max_by(|a, b| map.residual(a).distance.total_cmp(&map.residual(b).distance))?;
    let (left, place) = (map.residual(worst), map.graph.nodes[worst.to].translation);
    let text = format!("of {passed} loop closures {} cannot be met", violated.len());
    (violated.len() as f64 > STRAINED * passed as f64).then(|| {
        Finding::new(Code::ClosureViolated, text)
            .with("violated", violated.len() as f64, "1")
            .with("closures", passed as f64, "1")
            .with("worst", left.distance, "m")
            .with("worst_turn", left.angle, "rad")
            .during(map.stamps[worst.from], map.stamps[worst.to])
            .at(place.x, place.y)
    })
}

fn loop_none(map: &MapResult) -> Option<Finding> {
    map.accepted().next().is_none().then(|| Finding::new(Code::LoopNone, "no loop was closed"))
}

fn odometry(map: &MapResult) -> Option<Finding> {
    if !map.has_odometry {
        return Some(Finding::new(Code::OdometryMissing, "there is no odometry"));
    }
    let overruled = map.overruled?;
    let text = format!("odometry contradicted {} scans and was left out there", overruled.scans);
    let found = Finding::new(Code::OdometryOverruled, text).with("scans", overruled.scans as f64, "1");
    Some(found.during(overruled.stamps.0, overruled.stamps.1))
}

fn offset(map: &MapResult) -> Option<Finding> {
    let (pose, sigmas) = &map.offset;
    let (x, y, sigma) = (pose.x(), pose.y(), sigmas.x.max(sigmas.y));
    let text = format!(
        "odometry and scans agree best with the scanner {} m ahead and {} m to the left of where it is said to sit; the poses \
         written are those of the frame that was given",
        fixed(x, 2),
        fixed(y, 2)
    );
    (map.has_odometry && x.hypot(y) >= OFFSET.max(3.0 * sigma))
        .then(|| Finding::new(Code::ScannerOffset, text).with("x", x, "m").with("y", y, "m").with("sigma", sigma, "m"))
}

fn cell(map: &MapResult) -> Option<Finding> {
    let (made, wanted) = (map.grid.resolution, map.wanted_resolution);
    let text = format!("the map is too large for cells of {wanted} m: they are {made} m wide");
    (made > wanted).then(|| Finding::new(Code::LimitReached, text).with("resolution", made, "m"))
}

fn stretch(spot: &WeakSpot) -> Finding {
    let (x, y) = (spot.position.x, spot.position.y);
    let (code, text) = match spot.reason {
        Reason::Torn => (Code::MapTorn, spot.reason.told().to_owned()),
        why => {
            let (x, y) = (fixed(x, 1), fixed(y, 1));
            let text =
                format!("near ({x}, {y}) the position by a scan has a sigma of {:.2} m: {}", spot.sigma, why.told());
            (Code::WeakStretch, text)
        }
    };
    Finding::new(code, text).during(spot.stamps.0, spot.stamps.1).at(x, y).with("sigma", spot.sigma, "m").with(
        "direction",
        spot.direction,
        "rad",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use groma_geometry::Se2;
    use groma_mapping::closure::{Closure, Verdict};
    use groma_mapping::map_result::AnchoredClosure;
    use groma_mapping::mapper::Mapper;
    use groma_mapping::options::Options;
    use groma_mapping::verify::Check;
    use groma_models::{BeamGeometry, LaserScan, Token};
    use nalgebra::{Matrix3, Vector2, Vector3};

    /// A map of ten keyframes a metre apart, one a second, to which nothing is to be said.
    fn good() -> MapResult {
        let geometry = BeamGeometry {
            angle_min: -3.0,
            angle_increment: 0.02,
            time_increment: 0.0,
            range_min: 0.1,
            range_max: 9.0,
        };
        let scan = LaserScan { stamp: 0.0, geometry, ranges: vec![2.0; 300], intensities: vec![] };
        let mut mapper = Mapper::new(Options::default());
        mapper.push_scan(&scan, &Se2::IDENTITY).unwrap();
        let mut map = mapper.finish(&Token::new()).unwrap();
        map.graph.nodes = (0..10).map(|k| Se2::new(f64::from(k), 3.0, 0.0)).collect();
        map.stamps = (0..10).map(f64::from).collect();
        (map.has_odometry, map.weak) = (true, vec![]);
        map.closures = vec![closure(0, 9, Verdict::Accepted, Se2::IDENTITY)];
        map
    }

    /// A closure that the graph misses by so much.
    fn closure(from: usize, to: usize, verdict: Verdict, off: Se2) -> AnchoredClosure {
        let predicted = Se2::new((to - from) as f64, 0.0, 0.0);
        let information = Matrix3::identity() * 1e4;
        let pose = predicted * off.inverse();
        let check = Check { pose, information, overlap: 1.0, share: 1.0, common: 1.0, scale: 0.01 };
        AnchoredClosure { closure: Closure { from, to, check, predicted, verdict }, from, to }
    }

    fn told(change: impl FnOnce(&mut MapResult)) -> Vec<Finding> {
        let mut map = good();
        change(&mut map);
        findings(&map)
    }

    fn values(finding: &Finding) -> Vec<f64> {
        finding.values.iter().map(|v| v.value).collect()
    }

    #[test]
    fn of_many_closures_one_may_be_violated_and_of_several_the_worst_is_told() {
        let off = [Se2::new(0.3, 0.0, 0.0), Se2::new(0.0, 0.6, 0.1), Se2::new(-0.4, 0.0, 0.2)];
        let with = |count: usize| {
            told(|map| {
                let accepted = closure(0, 9, Verdict::Accepted, Se2::IDENTITY);
                let violated = (0..count).map(|k| closure(k, k + 4, Verdict::Violated, off[k]));
                map.closures = std::iter::repeat_n(accepted, 17).chain(violated).collect();
            })
        };
        assert_eq!((with(0), with(1)), (vec![], vec![]));
        let [strained] = &with(3)[..] else { panic!("one finding") };
        assert_eq!(
            (strained.code, strained.span, strained.place),
            (Code::ClosureViolated, Some((1.0, 5.0)), Some([5.0, 3.0]))
        );
        let expected = [3.0, 20.0, 0.6, 0.1];
        assert!(values(strained).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{strained:?}");
    }

    #[test]
    fn where_it_may_be_torn_is_told_always_and_of_weak_stretches_the_worst() {
        let spot = |k: i32, reason: Reason| WeakSpot {
            stamps: (f64::from(k), f64::from(k) + 0.5),
            position: Vector2::new(7.0, -f64::from(k)),
            sigma: 0.2 + 0.01 * f64::from(k),
            direction: 1.5,
            reason,
        };
        let held = |count: i32| (0..count).map(|k| spot(k, Reason::Slides)).collect::<Vec<_>>();
        assert_eq!(told(|map| map.weak = held(10)).len(), 10);
        let found = told(|map| map.weak = [held(13), vec![spot(0, Reason::Torn)]].concat());
        assert_eq!((found.len(), found[0].code, values(&found[0])), (12, Code::MapTorn, vec![0.2, 1.5]));
        assert!(found[1..].iter().all(|f| f.code == Code::WeakStretch));
        assert_eq!(
            (found[1].place, found[1].span, values(&found[1])),
            (Some([7.0, -12.0]), Some((12.0, 12.5)), vec![0.32, 1.5])
        );
        assert_eq!(values(&found[11]), [3.0, 0.22], "the three that are left, and the worst of them");
    }

    #[test]
    fn a_scanner_is_said_to_sit_elsewhere_where_that_is_far_and_sure() {
        let at = |x: f64, y: f64, sigmas: [f64; 2]| {
            told(|map| map.offset = (Se2::new(x, y, 0.0), Vector3::new(sigmas[0], sigmas[1], 0.1)))
        };
        let found = at(0.03, -0.08, [0.01, 0.02]);
        assert_eq!((found.len(), found[0].code, values(&found[0])), (1, Code::ScannerOffset, vec![0.03, -0.08, 0.02]));
        assert_eq!(at(0.03, -0.08, [0.01, 0.05]), [], "not sure");
        assert_eq!(at(0.01, 0.01, [1e-4, 1e-4]), [], "not far");
        let far = (Se2::new(1.0, 0.0, 0.0), Vector3::from_element(0.01));
        let blind = told(|map| (map.offset, map.has_odometry) = (far, false));
        assert_eq!(blind.iter().map(|f| f.code).collect::<Vec<_>>(), [Code::OdometryMissing]);
    }
}

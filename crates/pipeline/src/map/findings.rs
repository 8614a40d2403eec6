//! What a finished map says of itself.
//!
//! | finding | when |
//! |---|---|
//! | map-torn | a scan was not found on the map and no odometry bridged the gap |
//! | closure-violated | more than `STRAINED` of the closures whose views agree cannot be met by the whole graph |
//! | loop-none | no loop closure |
//! | weak-stretch | registration alone holds the position poorly there |
//! | odometry-overruled | scans before which odometry had failed |
//! | odometry-missing | no odometry at all |
//! | scanner-offset | odometry and scans agree best with the scanner `OFFSET` or more from its mount, beyond 3 sigma |
//! | limit-reached | the map is too large for the cell that was asked for |
//! | interrupted | the conclusion was cancelled |

use crate::text::fixed;
use groma_mapping::map_result::MapResult;
use groma_mapping::weak::{Reason, WeakSpot};
use groma_models::Finding;
use groma_models::finding::Code;

/// Share of the closures that may turn out to be violated: single ones are false, many tell of a bent map.
const STRAINED: f64 = 0.1;
/// A scanner that sits this far from its mount is told of [m].
const OFFSET: f64 = 0.05;
/// Weak stretches that are told one by one, the worst.
const MOST_WEAK: usize = 10;

/// The findings of a map.
pub(super) fn findings(map: &MapResult) -> Vec<Finding> {
    let single = [interrupted(map), strained(map), loop_none(map), odometry(map), offset(map), cell(map)];
    single.into_iter().flatten().chain(weak_stretches(map)).collect()
}

/// Where the map may be torn, all; where it is weakly held, the worst, and how many more.
fn weak_stretches(map: &MapResult) -> Vec<Finding> {
    let (torn, mut held): (Vec<&WeakSpot>, Vec<&WeakSpot>) = map.weak.iter().partition(|w| w.reason == Reason::Torn);
    held.sort_by(|a, b| b.sigma.total_cmp(&a.sigma));
    let told = held.iter().take(MOST_WEAK);
    let mut found: Vec<Finding> = torn.iter().chain(told).map(|w| stretch(w)).collect();
    if let Some(next) = held.get(MOST_WEAK) {
        let (others, sigma) = (held.len() - MOST_WEAK, next.sigma);
        let text = format!("{others} more stretches are weakly held, none worse than {sigma:.2} m");
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
    let worst = violated.iter().max_by(|a, b| map.left_of(a).0.total_cmp(&map.left_of(b).0))?;
    let ((metres, radians), place) = (map.left_of(worst), map.graph.nodes[worst.2].translation);
    let text = format!("of {passed} loop closures {} cannot be met", violated.len());
    (violated.len() as f64 > STRAINED * passed as f64).then(|| {
        Finding::new(Code::ClosureViolated, text)
            .with("violated", violated.len() as f64, "1")
            .with("closures", passed as f64, "1")
            .with("worst", metres, "m")
            .with("worst_turn", radians, "rad")
            .during(map.stamps[worst.1], map.stamps[worst.2])
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
            let text = format!("near ({x}, {y}) a scan holds the position to {:.2} m only: {}", spot.sigma, why.told());
            (Code::WeakStretch, text)
        }
    };
    Finding::new(code, text).during(spot.stamps.0, spot.stamps.1).at(x, y).with("sigma", spot.sigma, "m").with(
        "direction",
        spot.direction,
        "rad",
    )
}

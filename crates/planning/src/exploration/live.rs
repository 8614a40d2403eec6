//! The explorer led live: doors that shut, ways that lead elsewhere, contradictions, goals.

use super::run::{arrival, place};
use super::scenes::{Kind, Scene};
use super::{Event, Explorer, Goal, Graph, Limits, Noise, Place, Settings, Strategy};
use proptest::prelude::{ProptestConfig, prop_assert, proptest};

fn at(key: usize, x: f64, y: f64, exits: &[f64]) -> Place {
    Place { key, position: [x, y], camera: true, exits: exits.to_vec() }
}

fn arrived(left: usize, place: Place, enters: usize) -> Event {
    Event::Arrived { left, place, enters, via: None }
}

const EAST: f64 = 0.0;
const WEST: f64 = std::f64::consts::PI;

#[test]
fn a_door_that_is_shut_sends_the_robot_elsewhere() {
    let mut robot = Explorer::new(Settings::default(), 3, &at(0, 0.0, 0.0, &[EAST, WEST]), 0.0).unwrap();
    let first = robot.next_exit().unwrap();
    robot.observe(&Event::Blocked { exit: first }).unwrap();
    let second = robot.next_exit().unwrap();
    assert_ne!(first, second);
    robot.observe(&Event::Blocked { exit: second }).unwrap();
    assert_eq!(robot.next_exit(), None);
    assert!(!robot.has_found_all());
}

#[test]
fn a_known_way_that_is_shut_later_is_driven_around() {
    let ring = Scene { kind: Kind::Ring, size: 4, ..Scene::default() }.graph().unwrap();
    let found = |node| super::run::place(&ring, node);
    let settings = Settings { strategy: Strategy::ReturnToOrigin, ..Settings::default() };
    let mut robot = Explorer::new(settings, 4, &found(0), 0.0).unwrap();
    assert_eq!(robot.next_exit(), Some(0));
    robot.observe(&arrived(0, found(1), 0)).unwrap();
    assert_eq!(robot.next_exit(), Some(0), "back home");
    robot.observe(&Event::Blocked { exit: 0 }).unwrap();
    assert_eq!(robot.next_exit(), Some(1), "no way home is known: on to new ground");
}

#[test]
fn an_exit_that_leads_elsewhere_than_it_did_is_learned_anew() {
    let start = at(0, 0.0, 0.0, &[EAST]);
    let mut robot = Explorer::new(Settings::default(), 3, &start, 0.0).unwrap();
    robot.observe(&arrived(0, at(1, 8.0, 0.0, &[WEST]), 0)).unwrap();
    robot.observe(&arrived(0, start.clone(), 0)).unwrap();
    robot.observe(&arrived(0, at(2, 6.0, 0.0, &[WEST, EAST]), 0)).unwrap();
    assert_eq!(robot.next_exit(), Some(1), "on to what is beyond");
    robot.observe(&arrived(1, at(1, 8.0, 0.0, &[WEST]), 0)).unwrap();
    assert!(robot.has_found_all());
    assert_eq!(robot.driven(), 8.0 + 8.0 + 6.0 + 2.0);
}

#[test]
fn a_way_that_has_become_longer_is_longer_from_then_on() {
    let start = at(0, 0.0, 0.0, &[EAST]);
    let mut robot = Explorer::new(Settings::default(), 3, &start, 0.0).unwrap();
    let round = Some(vec![[6.0, 3.0], [2.0, 3.0]]);
    let longer = 2.0 * 13.0_f64.sqrt() + 4.0;
    robot.observe(&arrived(0, at(1, 8.0, 0.0, &[WEST]), 0)).unwrap();
    let other = Event::Arrived { left: 0, place: start.clone(), enters: 0, via: round };
    robot.observe(&other).unwrap();
    robot.observe(&arrived(0, at(1, 8.0, 0.0, &[WEST]), 0)).unwrap();
    assert!((robot.driven() - 8.0 - 2.0 * longer).abs() < 1e-9, "{}", robot.driven());
}

#[test]
fn a_camera_that_nobody_announced_joins_the_map() {
    let junction = |key, x, exits: &[f64]| Place { camera: false, ..at(key, x, 0.0, exits) };
    let mut robot = Explorer::new(Settings::default(), 1, &at(0, 0.0, 0.0, &[EAST]), 0.0).unwrap();
    robot.observe(&arrived(0, junction(1, 8.0, &[WEST]), 0)).unwrap();
    robot.observe(&arrived(0, at(0, 0.0, 0.0, &[EAST]), 0)).unwrap();
    robot.observe(&arrived(0, at(1, 8.0, 0.0, &[WEST]), 0)).unwrap();
    assert_eq!(robot.belief().cameras().len(), 2);
}

#[test]
fn where_a_camera_cannot_be_reached_the_others_are_surveyed_as_required() {
    let settings = Settings { goal: Goal::Sigma(0.07), ..Settings::default() };
    let mut robot = Explorer::new(settings, 3, &at(0, 0.0, 0.0, &[EAST]), 0.0).unwrap();
    robot.observe(&arrived(0, at(1, 8.0, 0.0, &[WEST, EAST]), 0)).unwrap();
    robot.observe(&Event::Blocked { exit: 1 }).unwrap();
    assert!(robot.belief().sigma() > 0.07, "{}", robot.belief().sigma());
    let mut here = 1;
    while let Some(exit) = robot.next_exit() {
        assert_eq!(exit, 0);
        here = 1 - here;
        let exits: &[f64] = if here == 1 { &[WEST, EAST] } else { &[EAST] };
        robot.observe(&arrived(0, at(here, 8.0 * here as f64, 0.0, exits), 0)).unwrap();
    }
    assert!(robot.belief().sigma() <= 0.07 && !robot.has_found_all());
}

/// Leads a robot through a building in which some ways are shut, each from a number of passages on.
fn led(graph: &Graph, settings: Settings, announced: usize, shut: &[Option<usize>]) -> (Explorer, usize) {
    let mut robot = Explorer::new(settings, announced, &place(graph, graph.start), 0.0).unwrap();
    let (mut here, mut passages, mut tried) = (graph.start, 0, std::collections::HashSet::new());
    while let Some(exit) = robot.next_exit() {
        let (edge, next, event) = arrival(graph, here, exit).unwrap();
        if shut[edge].is_some_and(|from| passages >= from) {
            assert!(tried.insert((here, exit)), "place {here} exit {exit} was shut and is tried again");
            robot.observe(&Event::Blocked { exit }).unwrap();
            continue;
        }
        robot.observe(&event).unwrap();
        (here, passages) = (next, passages + 1);
        assert!(passages < 2000, "no end");
    }
    (robot, here)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    #[test]
    fn whatever_doors_are_shut_the_cameras_that_can_be_reached_are_found(
        seed in 0..1000_u64, density in 0.0..1.0_f64, strategy in 0..Strategy::ALL.len(),
        shut in proptest::collection::vec(proptest::option::weighted(0.3, 0..8_usize), 24),
    ) {
        let graph = Scene { size: 12, density, seed, ..Scene::default() }.graph().unwrap();
        let settings = Settings { strategy: Strategy::ALL[strategy], goal: Goal::Lambda(30.0), ..Settings::default() };
        let (robot, here) = led(&graph, settings, 12, &shut);
        let mut open = vec![here];
        let mut reached = [false; 12];
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut reached[node], true) {
                let through = graph.exits(node).into_iter().filter(|&(edge, _)| shut[edge].is_none());
                open.extend(through.map(|(edge, forward)| graph.edges[edge].ends[usize::from(forward)]));
            }
        }
        let reachable = reached.iter().filter(|&&r| r).count();
        prop_assert!(robot.belief().cameras().len() >= reachable);
    }
}

#[test]
fn what_contradicts_what_was_seen_is_refused_and_changes_nothing() {
    let start = at(0, 0.0, 0.0, &[EAST]);
    let mut robot = Explorer::new(Settings::default(), 3, &start, 0.0).unwrap();
    let mut refused = |event: &Event, word: &str| {
        let said = robot.observe(event).unwrap_err().to_string();
        assert!(said.contains(word), "{said}");
    };
    refused(&Event::Blocked { exit: 3 }, "none numbered 3");
    refused(&arrived(0, at(1, f64::NAN, 0.0, &[WEST]), 0), "finite");
    refused(&arrived(0, at(1, 8.0, 0.0, &[WEST]), 1), "exit 1 of 1");
    refused(&arrived(0, at(0, 0.0, 0.0, &[EAST, WEST]), 0), "another number of exits");
    refused(&arrived(0, at(0, 0.0, 0.0, &[EAST]), 0), "without length");
    assert_eq!((robot.driven(), robot.next_exit()), (0.0, Some(0)));
}

#[test]
fn a_survey_ends_at_the_sigma_or_the_budget() {
    let graph = Scene::default().graph().unwrap();
    let run = |goal| super::explore(&graph, &Settings { goal, ..Settings::default() }).unwrap();
    let (fine, cheap) = (run(Goal::Sigma(0.25)), run(Goal::Budget(250.0)));
    assert!(fine.sigma <= 0.25 && fine.sigma > 0.2, "{}", fine.sigma);
    assert!(cheap.length <= 250.0 && cheap.length > 180.0, "{}", cheap.length);
}

#[test]
fn goals_without_meaning_are_refused() {
    let start = at(0, 0.0, 0.0, &[EAST]);
    let refused = |settings: Settings| Explorer::new(settings, 1, &start, 0.0).is_err();
    assert!(refused(Settings { goal: Goal::Lambda(f64::NAN), ..Settings::default() }));
    assert!(refused(Settings { goal: Goal::Sigma(0.0), ..Settings::default() }));
    assert!(refused(Settings { goal: Goal::Budget(9.0), strategy: Strategy::Search, ..Settings::default() }));
    assert!(refused(Settings { noise: Noise { bearing: 0.0, ..Noise::default() }, ..Settings::default() }));
    assert!(refused(Settings { limits: Limits { expansions: 0, passes: 1 }, ..Settings::default() }));
}

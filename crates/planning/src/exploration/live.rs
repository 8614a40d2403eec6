//! The explorer led live: doors that shut, ways that lead elsewhere, contradictions, goals.

use super::scenes::{Kind, Scene};
use super::{Event, Explorer, Goal, Limits, Noise, Place, Settings, Strategy};

fn at(key: usize, x: f64, y: f64, exits: &[f64]) -> Place {
    Place { key, position: [x, y], camera: true, exits: exits.to_vec() }
}

fn arrived(left: usize, place: Place, enters: usize) -> Event {
    Event::Arrived { left, place, enters, via: vec![] }
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
    assert_eq!(robot.next_exit(), None, "no way home is known");
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

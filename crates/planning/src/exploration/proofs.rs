//! The search against the plain way: every walk, every covariance by the filter itself.

use super::belief::Belief;
use super::bound::{Bound, Goal};
use super::graph::Passage;
use super::known::{Known, Link, distances};
use super::noise::Noise;
use super::run::place;
use super::scenes::{Kind, Scene};
use super::search::{Limits, Problem, cheapest, search};
use super::{Goal as Aim, Graph, Settings, Strategy, explore};
use proptest::prelude::{ProptestConfig, any, prop_assert, prop_assume, proptest};

/// A half-explored building: a random walk through a random one.
struct Explored {
    known: Known,
    belief: Belief,
    here: usize,
    heading: f64,
}

fn explored(graph: &Graph, turns: &[usize]) -> Explored {
    let noise = Noise::default();
    let (mut known, mut belief) = (Known::new(noise), Belief::new(noise));
    let (mut node, mut heading) = (graph.start, 0.0);
    let meet = |belief: &mut Belief, node: usize| graph.nodes[node].camera.then(|| belief.meet(graph.nodes[node].at()));
    let camera = meet(&mut belief, node);
    let mut here = known.add(&place(graph, node), camera);
    for turn in turns {
        let exits = graph.exits(node);
        let left = turn % exits.len();
        let (edge, forward) = exits[left];
        let next = graph.edges[edge].ends[usize::from(forward)];
        let enters = graph.exits(next).iter().position(|&e| e == (edge, !forward)).unwrap();
        let found = known.find(next);
        let to = found.unwrap_or_else(|| known.add(&place(graph, next), None));
        let link = known.join((here, left), (to, enters), &[]).unwrap();
        drive(&mut belief, &known, here, heading, &link.passage);
        match known.places[to].camera {
            Some(camera) => belief.meet_again(camera),
            None => known.places[to].camera = meet(&mut belief, next),
        }
        (here, node, heading) = (to, next, link.passage.arrive);
    }
    Explored { known, belief, here, heading }
}

fn drive(belief: &mut Belief, known: &Known, from: usize, heading: f64, passage: &Passage) {
    let turn = belief.noise.turning(known.places[from].at, passage.depart - heading);
    belief.drive(&(turn + passage.noise));
}

/// The least cost over all walks of at most `most` ways, and every walk's own through `visit`: the filter, step by step.
fn every(problem: &Problem<'_>, known: &Known, most: usize, visit: &mut dyn FnMut(f64, f64)) {
    let start = (problem.belief.clone(), problem.here, problem.heading, 0.0, most);
    let mut open = vec![start];
    while let Some((belief, at, heading, length, left)) = open.pop() {
        if problem.ends[at].is_finite() {
            let robot =
                if problem.robot { super::noise::position_trace(&belief.robot(), known.places[at].at) } else { 0.0 };
            let cost = length + problem.ends[at] + problem.lambda * (belief.map_trace() + robot);
            visit(cost, length + problem.ends[at]);
        }
        for link in problem.links[at].iter().filter(|_| left > 0) {
            let mut belief = belief.clone();
            drive(&mut belief, known, at, heading, &link.passage);
            if let Some(camera) = known.places[link.to].camera {
                belief.meet_again(camera);
            }
            open.push((belief, link.to, link.passage.arrive, length + link.passage.length, left - 1));
        }
    }
}

fn ends(known: &Known, frontier: bool) -> Vec<f64> {
    let open = |p: usize| !frontier || known.untaken(p).next().is_some();
    (0..known.places.len()).map(|p| if open(p) { 0.0 } else { f64::INFINITY }).collect()
}

fn building(seed: u64, size: usize, density: f64, junction: Option<usize>) -> Graph {
    let mut graph = Scene { size, density, seed, ..Scene::default() }.graph().unwrap();
    if let Some(node) = junction {
        graph.nodes[1 + node % (size - 1)].camera = false;
    }
    graph
}

fn problem<'a>(e: &'a Explored, links: &'a [Vec<Link>], ends: &'a [f64], lambda: f64, robot: bool) -> Problem<'a> {
    let (belief, places) = (&e.belief, &e.known.places[..]);
    Problem { belief, places, links, here: e.here, heading: e.heading, ends, lambda, robot, reach: f64::INFINITY }
}

fn turns() -> impl proptest::strategy::Strategy<Value = Vec<usize>> {
    proptest::collection::vec(0..12_usize, 4..9)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn no_walk_costs_less_than_the_bound(
        seed in 0..1000_u64, density in 0.0..1.0_f64, junction in proptest::option::of(0..5_usize), turns in turns(),
        log_lambda in -1.0..4.0_f64, frontier in any::<bool>(), guess in any::<bool>(),
    ) {
        let e = explored(&building(seed, 6, density, junction), &turns);
        let (links, ends, lambda) = (e.known.links(guess), ends(&e.known, frontier), 10_f64.powf(log_lambda));
        prop_assume!(distances(&links, &ends)[e.here].is_finite());
        let problem = problem(&e, &links, &ends, lambda, frontier);
        let goal = Goal { here: e.here, ends: &ends, lambda, robot: frontier, limit: 1e5 };
        let bound = Bound::new(&e.belief, &e.known.places, &links, &goal);
        let mut worst = f64::INFINITY;
        every(&problem, &e.known, 7, &mut |cost, length| worst = worst.min(cost - bound.at_least(length)));
        prop_assert!(worst >= 0.0, "{worst}");
    }

    #[test]
    fn a_walk_that_is_thought_of_has_the_covariance_of_the_filter(
        seed in 0..1000_u64, turns in turns(), steps in proptest::collection::vec(0..12_usize, 1..8),
    ) {
        let e = explored(&building(seed, 6, 0.5, Some(2)), &turns);
        let links = e.known.links(true);
        let mut branches = super::branch::Branches::new(&e.belief, &e.known.places, e.here, e.heading);
        let (mut belief, mut at, mut heading, mut number) = (e.belief.clone(), e.here, e.heading, 0);
        for step in steps {
            let link = &links[at][step % links[at].len()];
            number = branches.step(number, link);
            drive(&mut belief, &e.known, at, heading, &link.passage);
            if let Some(camera) = e.known.places[link.to].camera {
                belief.meet_again(camera);
            }
            (at, heading) = (link.to, link.passage.arrive);
        }
        let reached = &branches.reached[number];
        let robot = super::noise::position_trace(&belief.robot(), e.known.places[at].at);
        prop_assert!((reached.map_trace - belief.map_trace()).abs() < 1e-9 * belief.map_trace());
        prop_assert!((reached.robot_trace - robot).abs() < 1e-9 * robot.max(1e-3));
    }
}

/// The largest share by which the search misses the best walk, over random buildings and walks of `most` ways.
fn worst_gap(cases: u64, most: usize) -> f64 {
    let limits = Limits { expansions: 100_000, passes: most };
    let mut worst: f64 = 0.0;
    for case in 0..cases {
        let turns: Vec<usize> = (0..6).map(|k| (case as usize * 7 + k * k * 5 + k) % 12).collect();
        let e = explored(&building(case, 6, 0.15, None), &turns);
        let (links, frontier) = (e.known.links(false), case % 2 == 0);
        let ends = ends(&e.known, frontier);
        if !distances(&links, &ends)[e.here].is_finite() {
            continue;
        }
        let lambda = [3.0, 10.0, 30.0, 100.0, 300.0][case as usize % 5];
        let problem = problem(&e, &links, &ends, lambda, frontier);
        let mut best = f64::INFINITY;
        every(&problem, &e.known, most, &mut |cost, _| best = best.min(cost));
        worst = worst.max(search(&problem, &mut problem.branches(), &limits).unwrap().cost / best - 1.0);
    }
    worst
}

#[test]
fn the_search_finds_the_best_of_all_short_walks_to_a_hundredth() {
    assert!(worst_gap(40, 8) < 0.01);
}

#[test]
#[allow(clippy::print_stdout)]
#[ignore = "every walk of 12 ways"]
fn the_search_finds_the_best_of_all_walks_of_twelve_ways_to_a_hundredth() {
    let gap = worst_gap(100, 12);
    println!("largest gap to the best walk of at most 12 ways: {:.3} %", 100.0 * gap.max(0.0));
    assert!(gap < 0.01);
}

#[test]
fn stopped_early_the_search_is_no_worse_than_the_rule_and_says_how_far_it_may_be_off() {
    let e = explored(
        &building(5, 16, 0.7, None),
        &[3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5, 8, 9, 7, 9, 3, 2, 3, 8, 4, 6, 2, 6, 4, 3, 3],
    );
    let (links, ends) = (e.known.links(true), ends(&e.known, false));
    let problem = problem(&e, &links, &ends, 5000.0, false);
    let rule = cheapest(&problem, &mut problem.branches()).unwrap();
    let mut last = rule.cost;
    for expansions in [1, 10, 100, 1000, 10_000] {
        let walk = search(&problem, &mut problem.branches(), &Limits { expansions, passes: 4 }).unwrap();
        assert!(walk.cost <= last && walk.gap >= 0.0 && walk.expansions <= expansions);
        last = walk.cost;
    }
    assert!(last < rule.cost);
}

#[test]
fn a_ring_is_closed_by_the_exit_that_is_guessed_to_close_it() {
    let ring = Scene { kind: Kind::Ring, size: 8, step: 6.25, ..Scene::default() }.graph().unwrap();
    let settings = Settings { goal: Aim::Lambda(10.0), ..Settings::default() };
    let run = explore(&ring, &settings).unwrap();
    assert_eq!((run.stops.len(), run.stops[8].node), (9, 0));
    let open = explore(&ring, &Settings { strategy: Strategy::Nearest, ..settings }).unwrap();
    assert!(run.sigma < 0.4 * open.sigma);
}

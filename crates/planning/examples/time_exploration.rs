//! Prints how long one decision of an exploring robot takes, over all decisions of whole explorations.
//!
//!     cargo run --release -p groma-planning --example time_exploration
//!
//! Each exploration runs three times; of every decision the best of its three times counts, then the median and the
//! longest over the decisions are printed. A decision is a call of `next_exit` that planned: most give the next exit of
//! the plan that there is. Both searching strategies, 2000 expansions allowed, the default.

#![allow(clippy::print_stdout, clippy::unwrap_used)]

use groma_planning::exploration::run::{arrival, place};
use groma_planning::exploration::scenes::Kind;
use groma_planning::exploration::{Explorer, Goal, Graph, Scene, Settings, Strategy};
use std::time::Instant;

const RUNS: usize = 3;
const LAMBDAS: [f64; 3] = [10.0, 100.0, 1000.0];

fn main() {
    println!("scene     cameras   strategy   lambda   decisions   median   longest [ms]");
    for (kind, size) in [(Kind::Squares, 25), (Kind::Sparse, 25), (Kind::Squares, 196), (Kind::Sparse, 196)] {
        let graph = Scene { kind, size, ..Scene::default() }.graph().unwrap();
        for strategy in [Strategy::Search, Strategy::Survey] {
            LAMBDAS.iter().for_each(|&lambda| report(kind, &graph, strategy, lambda));
        }
    }
}

fn report(kind: Kind, graph: &Graph, strategy: Strategy, lambda: f64) {
    let settings = Settings { strategy, goal: Goal::Lambda(lambda), ..Settings::default() };
    let mut times = decisions(graph, &settings);
    for _ in 1..RUNS {
        let again = decisions(graph, &settings);
        times.iter_mut().zip(again).for_each(|(best, time)| *best = best.min(time));
    }
    times.sort_by(f64::total_cmp);
    let (median, longest) = (times[times.len() / 2], times[times.len() - 1]);
    let (kind, cameras) = (format!("{kind:?}"), graph.cameras());
    println!("{kind:9} {cameras:7}   {strategy:?}   {lambda:6}   {:9}   {median:6.1}   {longest:7.1}", times.len());
}

/// The times of the decisions of one exploration [ms].
fn decisions(graph: &Graph, settings: &Settings) -> Vec<f64> {
    let mut explorer = Explorer::new(*settings, graph.cameras(), &place(graph, graph.start), 0.0).unwrap();
    let (mut times, mut here) = (vec![], graph.start);
    loop {
        let (before, start) = (explorer.decisions().len(), Instant::now());
        let exit = explorer.next_exit();
        if explorer.decisions().len() > before {
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let Some(exit) = exit else { return times };
        let (_, next, event) = arrival(graph, here, exit).unwrap();
        explorer.observe(&event).unwrap();
        here = next;
    }
}

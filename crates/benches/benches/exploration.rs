//! Prints how long one decision of an exploring robot takes, over all decisions of whole explorations.
//!
//!     cargo bench -p groma-benches --bench exploration -- [MOST CAMERAS]
//!
//! Each exploration runs five times; of every decision the best of its five times counts, then the median and the
//! longest over the decisions are printed. A decision is a call of `next_exit` that planned: most give the next exit of
//! the plan that there is. Both searching strategies, 2000 expansions allowed, the default. Times are those of the
//! processor where Linux tells them (a busy machine does not spoil them), else of the clock.

#![allow(clippy::disallowed_methods, clippy::print_stdout, clippy::unwrap_used)]

use groma_planning::exploration::run::{arrival, place};
use groma_planning::exploration::scenes::Kind;
use groma_planning::exploration::{Explorer, Goal, Graph, Scene, Settings, Strategy};
use std::time::Instant;

const RUNS: usize = 5;
/// The processor's time has steps; below this the clock is better [ms].
const COARSE: f64 = 20.0;
const LAMBDAS: [f64; 3] = [10.0, 100.0, 1000.0];

fn main() {
    println!("scene     cameras   strategy   lambda   decisions   median   longest [ms]");
    let most = std::env::args().find_map(|size| size.parse().ok()).unwrap_or(196);
    let scenes = [(Kind::Squares, 25), (Kind::Sparse, 25), (Kind::Squares, 196), (Kind::Sparse, 196)];
    for (kind, size) in scenes.into_iter().filter(|&(_, size)| size <= most) {
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
        let (before, clock, start) = (explorer.decisions().len(), Instant::now(), on_processor());
        let exit = explorer.next_exit();
        if explorer.decisions().len() > before {
            let elapsed = clock.elapsed().as_secs_f64() * 1e3;
            let used = start.zip(on_processor()).map(|(a, b)| b - a).filter(|used| *used > COARSE);
            times.push(used.map_or(elapsed, |used| used.min(elapsed)));
        }
        let Some(exit) = exit else { return times };
        let (_, next, event) = arrival(graph, here, exit).unwrap();
        explorer.observe(&event).unwrap();
        here = next;
    }
}

/// Time that this thread has been running [ms].
fn on_processor() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split_whitespace().next()?.parse::<f64>().ok()? / 1e6)
}

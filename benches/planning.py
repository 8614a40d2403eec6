"""Print how exploration trades distance for accuracy, and whether it keeps what it promises.

.venv/bin/python benches/planning.py

The times of decisions are those of `cargo bench -p groma-benches --bench exploration`, the comparison
with every walk that of `cargo test --release -p groma-planning -- --ignored --nocapture`.
"""

from __future__ import annotations

import sys

import numpy as np

from groma.evaluation.exploration import LAMBDAS, band, matched, trade_offs
from groma.nouns.building import Graph
from groma.planning.exploration import (
    RULES,
    WEIGHING,
    Budget,
    Lambda,
    Settings,
    Sigma,
    StrategyName,
    explore,
    scene,
    try_walk,
)
from groma.report.exploration.report import match_line

BUILDINGS, SEEDS, TRIES = 12, 20, 1000
STUDY = ((200.0, 0.34), (297.0, 0.28), (586.0, 0.21))
"""Distance [m] and sigma [m] of the search in an earlier study of twelve other graphs."""
LOOKING_BACK: tuple[StrategyName, ...] = ("nearest", "return-to-nearest", "search", "survey")


def scenes() -> dict[str, Graph]:
    """Return one building of each kind."""
    return {
        "corridor": scene("corridor", size=10),
        "ring": scene("ring", size=8, step=6.25),
        "squares": scene("squares", size=25),
        "triangles": scene("triangles", size=14),
        "hexagons": scene("hexagons", size=22),
        "rectangles": scene("rectangles", size=12),
    }


def tell(line: str) -> None:
    """Write a line at once."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def sparse_buildings() -> None:
    """Trade-offs in the mean, the survey at the rules' own distances, and against the earlier study."""
    graphs = [scene("sparse", seed=seed) for seed in range(BUILDINGS)]
    tell(f"{BUILDINGS} sparse buildings of 16 cameras: mean distance / sigma, bands of 95 %")
    for p in trade_offs(graphs):
        weight = "" if p.weight is None else f"{p.weight:g}"
        distance = f"{p.distance:4.0f} +- {p.distance_band:2.0f} m"
        tell(f"  {p.strategy:17} {weight:5} {distance} / {p.sigma:.3f} +- {p.sigma_band:.3f} m")
    for match in matched(graphs):
        tell("  " + match_line(match, BUILDINGS))
    for budget, sigma in STUDY:
        runs = [explore(graph, Settings(goal=Budget(budget))) for graph in graphs]
        lengths, sigmas = (np.array([getattr(run, name) for run in runs]) for name in ("length", "sigma"))
        reached = f"{lengths.mean():.0f} m / {sigmas.mean():.3f} +- {band(sigmas):.3f} m"
        tell(f"  budget {budget:.0f} m: {reached}, the study {sigma} m")


def other_scenes() -> None:
    """Rules, searches and the survey as far as the rules, building by building."""
    tell("other scenes: distance [m] / sigma [m]")
    for name, graph in scenes().items():
        rules = [explore(graph, Settings(strategy=rule)) for rule in RULES]
        tell(
            f"  {name:10} "
            + ", ".join(f"{r} {x.length:.0f} / {x.sigma:.2f}" for r, x in zip(RULES, rules, strict=True))
        )
        for strategy in WEIGHING:
            runs = [explore(graph, Settings(strategy=strategy, goal=Lambda(x))) for x in LAMBDAS]
            tell(
                f"    {strategy:6} "
                + "  ".join(f"{x:g}: {r.length:.0f} / {r.sigma:.2f}" for x, r in zip(LAMBDAS, runs, strict=True))
            )
        for match in matched([graph]):
            tell(f"    {match.rule}: survey {match.survey_distance:.0f} / {match.survey_sigma:.2f}")


def promises() -> None:
    """Try out standard deviations that were promised."""
    tell(
        f"promised against {TRIES} drives with drawn noise, lambda 100: ratio, NEES/dof by least squares; of the filter"
    )
    for name, graph in (scenes() | {"sparse": scene("sparse")}).items():
        for strategy in LOOKING_BACK:
            run = explore(graph, Settings(strategy=strategy, goal=Lambda(100.0)))
            tried = try_walk(graph, run.walk, runs=TRIES)
            pairs = (f"{e.sigma / run.sigma:.3f}, {e.nees:.3f}" for e in (tried.map, tried.filter))
            tell(f"  {name:10} {strategy:17} " + ";  ".join(pairs))


def goals() -> None:
    """Print the result for a required sigma and for a budget."""
    tell(f"goals over {SEEDS} sparse buildings: mean (range) of distance and sigma")
    graphs = [scene("sparse", seed=seed) for seed in range(SEEDS)]
    for goal in (Sigma(0.35), Sigma(0.25), Sigma(0.2), Budget(200.0), Budget(300.0), Budget(600.0)):
        runs = [explore(graph, Settings(goal=goal)) for graph in graphs]
        reached = (spread([run.length for run in runs], 0), spread([run.sigma for run in runs], 3))
        kept = sum(run.sigma <= goal.value if isinstance(goal, Sigma) else run.length <= goal.value for run in runs)
        tell(f"  {type(goal).__name__.lower()} {goal.value:g}: {reached[0]} m, {reached[1]} m; kept in {kept}")


def spread(values: list[float], digits: int) -> str:
    """Return mean and range."""
    return f"{np.mean(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"


def main() -> None:
    """Print all."""
    sparse_buildings()
    other_scenes()
    goals()
    promises()


if __name__ == "__main__":
    main()

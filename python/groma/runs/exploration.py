"""Runs of explorations: one drive planned and tried out, or strategies compared, into the folder of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from groma.evaluation.exploration import Matched, Traded, matched, trade_offs
from groma.io.camera_graph import write_graph
from groma.nouns.building import Graph
from groma.nouns.findings import Finding
from groma.planning.building import Building
from groma.planning.exploration import Budget, Goal, Settings, Sigma, Tried, explore, try_walk
from groma.planning.exploration import Run as Explored
from groma.planning.waypoints import write_route, write_waypoints
from groma.report.exploration.pictures import animation
from groma.report.exploration.report import comparison_report, comparison_verdict, match_line, plan_report, verdict
from groma.runs.progress import Show
from groma.runs.run import Run

TRIES = 200
"""Drives with drawn noise that a prediction is checked by."""


def plan_into(run: Run, building: Building, settings: Settings, given: Mapping[str, object], *, frames: bool) -> str:
    """Plan, try the plan out, finish the run with it; returns the verdict in a sentence."""
    run.settings = {"exploration": {**settings.table(), **given}}
    run.extend(building.notes)
    graph = building.graph
    cameras = sum(node.camera for node in graph.nodes)
    with run.stage("cameras", cameras) as show:
        found = explore(graph, settings, lambda distance, count: show(count, f"{distance:.0f} m"), run.token)
    with run.stage("drives with noise", TRIES) as show:
        seed = int(str(given.get("seed", 0)))
        tried = try_walk(
            graph, found.walk, noise=settings.noise, runs=TRIES, seed=seed, progress=_told(show), token=run.token
        )
    run.extend(_missed(settings.goal, found, cameras))
    gif = animation(graph, found, building.grid) if frames else None
    write_graph(run.path("graph.yaml"), graph)
    write_waypoints(run.path("waypoints.csv"), graph, found)
    write_route(run.path("route.geojson"), graph, found)
    if gif:
        run.write_bytes("walk.gif", gif)
    told = verdict(graph, found, tried)
    run.finish(_figures(found, tried), told, lambda out: plan_report(graph, found, tried, out, gif, building.grid))
    return told


def compare_into(run: Run, graphs: Sequence[Graph], lambdas: Sequence[float]) -> None:
    """Explore buildings by every strategy, and by the survey as far as each rule went; finish the run with it."""
    with run.stage("explorations") as show:
        curves = trade_offs(graphs, lambdas, progress=_told(show), token=run.token)
        matches = matched(graphs, progress=_told(show), token=run.token)
    run.write_text("curves.csv", _curves(curves))
    run.write_text("matched.csv", _matches(matches))
    for point in curves:
        weight = "" if point.weight is None else f"lambda {point.weight:g}"
        run.say(f"{point.strategy:18} {weight:12} {point.distance:7.0f} m  sigma {point.sigma:.3f} m")
    for match in matches:
        run.say(match_line(match, len(graphs)))
    figures = {"buildings": len(graphs), "points": len(curves)}
    headline = comparison_verdict(curves, len(graphs))
    run.finish(figures, headline, lambda outcome: comparison_report(curves, matches, len(graphs), outcome))


def _told(show: Show) -> Callable[[int, int], None]:
    return lambda done, total: show(done, total=total)


def _missed(goal: Goal | None, run: Explored, cameras: int) -> list[Finding]:
    """Return the goals that were not reached."""
    found = []
    if len(run.cameras) < cameras:
        lost = cameras - len(run.cameras)
        found.append(Finding("goal-missed", "not all cameras can be found", values={"cameras": (lost, "1")}))
    if isinstance(goal, Sigma) and run.sigma > goal.value:
        text = f"sigma {goal.value} m cannot be reached: no walk lowers {run.sigma:.3g} m any further"
        found.append(Finding("goal-missed", text, values={"sigma": (run.sigma, "m")}))
    if isinstance(goal, Budget) and run.length > goal.value:
        text = f"finding all cameras alone takes {run.length:.0f} m, more than the budget"
        found.append(Finding("goal-missed", text, values={"distance": (run.length, "m")}))
    return found


def _curves(curves: Sequence[Traded]) -> str:
    lines = ["strategy,lambda,distance,distance_band,sigma,sigma_band"]
    for p in curves:
        weight = "" if p.weight is None else f"{p.weight:.9g}"
        values = (p.distance, p.distance_band, p.sigma, p.sigma_band)
        lines.append(f"{p.strategy},{weight}," + ",".join(f"{value:.9g}" for value in values))
    return "\n".join(lines) + "\n"


def _matches(matches: Sequence[Matched]) -> str:
    lines = ["rule,distance,survey_distance,sigma,survey_sigma,difference_band,better"]
    for m in matches:
        numbers = (m.distance, m.survey_distance, m.sigma, m.survey_sigma, m.difference_band)
        lines.append(f"{m.rule}," + ",".join(f"{value:.9g}" for value in numbers) + f",{m.better}")
    return "\n".join(lines) + "\n"


def _figures(run: Explored, tried: Tried | None) -> dict[str, object]:
    found = [stop.length for stop in run.stops if stop.complete]
    return {
        "cameras": len(run.cameras),
        "distance_m": _stable(run.length),
        "distance_until_all_found_m": _stable(found[0]) if found else None,
        "sigma_predicted_m": _stable(run.sigma),
        "sigma_tried_m": _stable(tried.map.sigma) if tried else None,
        "nees_per_dof": _stable(tried.map.nees) if tried else None,
        "filter_sigma_tried_m": _stable(tried.filter.sigma) if tried else None,
        "filter_nees_per_dof": _stable(tried.filter.nees) if tried else None,
        "tries": tried.runs if tried else 0,
        "decisions": len(run.decisions),
        "largest_gap": _stable(max((decision.gap for decision in run.decisions), default=0.0)),
    }


def _stable(value: float) -> float:
    return float(f"{value:.9g}")

"""The reports on a planned exploration and on a comparison of strategies."""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence

import groma
from groma.evaluation.exploration import Matched, Traded
from groma.io.camera_graph import node_names
from groma.io.toml import to_toml
from groma.nouns.building import Graph
from groma.nouns.maps import OccupancyGrid
from groma.planning.exploration import Run, Tried
from groma.report.drawing import VARIABLES
from groma.report.exploration.pictures import COLOURS, MARKS, the_progress, the_trade_off, the_walk
from groma.report.findings import findings_section
from groma.report.outcome import Outcome
from groma.report.page import Html, details, facts, figure, page, section, table, text
from groma.report.words import count, length, number

_FOOTER = "groma {}: the same input and settings give the same bytes."
_PLAN_FILES = {
    "report.html": "this page",
    "waypoints.csv": "the route, stop by stop, with the predicted standard deviations",
    "route.geojson": "the edges driven, for the route server of nav2",
    "graph.yaml": "the building, in the input format of this command",
    "metrics.json": "the metrics of this page and more, for scripts",
    "run.toml": "settings, versions and the input's hash",
}


def verdict(graph: Graph, run: Run, tried: Tried | None) -> str:
    """Return one sentence: distance, accuracy, and whether simulated noise agrees."""
    found = len(run.cameras)
    missing = sum(node.camera for node in graph.nodes) - found
    every = "the" if found == 1 and not missing else "all" if not missing else ""
    cameras = f"{every} {count(found, 'camera')}".strip()
    text_ = f"A {run.length:.0f} m drive locates {cameras} to {length(run.sigma)} (1 σ)"
    text_ += f"; {count(missing, 'camera')} cannot be reached" if missing else ""
    if tried:
        text_ += f"; {tried.runs} drives with simulated noise gave {length(tried.map.sigma)}"
    return text_ + "."


def plan_report(
    graph: Graph,
    run: Run,
    tried: Tried | None,
    outcome: Outcome,
    gif: bytes | None,
    grid: OccupancyGrid | None = None,
) -> str:
    """Return the page on one plan."""
    keys = [("line", "line", "edge"), ("final", "bar", "driven, wider if more often")]
    keys += [("rejected", "ring", "a camera's position, 2σ"), ("accepted", "dot", "where the robot ends")]
    progress = [("final", "line", "cameras found so far, root mean square"), ("odometry", "line", "the robot")]
    parts = [
        Html("<header>" + text("p", "groma plan exploration", "over") + text("h1", outcome.headline) + "</header>"),
        facts(_facts(run, tried)),
        findings_section(outcome.findings),
        figure(the_walk(graph, run, grid), "The route and the final uncertainty.", keys),
        figure(
            the_progress(run),
            "Dashed line: all cameras are found; the rest of the drive lowers the uncertainty.",
            progress,
        ),
    ]
    if gif:
        source = base64.b64encode(gif).decode()
        parts.append(
            section("The drive", Html(f'<img alt="the drive as an animation" src="data:image/gif;base64,{source}">'))
        )
    parts += [section("Stops", _stops(graph, run)), _files(outcome.record, gif is not None), _foot()]
    return page("groma plan exploration", parts)


def comparison_verdict(curves: Sequence[Traded], graphs: int) -> str:
    """Return one sentence: what was compared."""
    shown = len({point.strategy for point in curves})
    strategies = f"{shown} strategies" if shown > 1 else "one strategy"
    return f"Distance against accuracy of {strategies} in {count(graphs, 'building')}."


def comparison_report(curves: Sequence[Traded], matches: Sequence[Matched], graphs: int, outcome: Outcome) -> str:
    """Return the page on a comparison of strategies."""
    shown = [s for s in COLOURS if any(point.strategy == s for point in curves)]
    keys = [(VARIABLES[COLOURS[s]], "dot" if s in MARKS else "line", s) for s in shown]
    note = "Lower and further left is better. Bands and bars: where the mean lies with 95 %."
    rows = [
        [
            p.strategy,
            "–" if p.weight is None else f"{p.weight:g}",
            *_with_band(p.distance, p.distance_band, 0),
            *_with_band(p.sigma, p.sigma_band, 3),
        ]
        for p in curves
    ]
    head = ["strategy ", "λ [1/m]", "distance [m]", "±", "σ [m]", "±"]
    parts = [
        Html("<header>" + text("p", "groma evaluate exploration", "over") + text("h1", outcome.headline) + "</header>"),
        findings_section(outcome.findings),
        figure(the_trade_off(curves), note, keys),
        section("The survey at the distance of each rule", _matched(matches, graphs)),
        section("Figures", table(head, rows), details("Settings and versions", text("pre", to_toml(outcome.record)))),
        _foot(),
    ]
    return page("groma evaluate exploration", parts)


def match_line(match: Matched, graphs: int) -> str:
    """Return a sentence: what the survey makes of the distance that a rule drives."""
    line = f"as far as {match.rule} ({match.distance:.0f} m) survey gives {match.survey_sigma:.3f} m, not"
    line += f" {match.sigma:.3f} m"
    if math.isfinite(match.difference_band):
        line += f": {match.survey_sigma - match.sigma:+.3f} ± {match.difference_band:.3f} m"
    return line + f", better in {match.better} of {count(graphs, 'building')}"


def _matched(matches: Sequence[Matched], graphs: int) -> Html:
    head = [
        "rule ",
        "distance [m]",
        "survey [m]",
        "σ of the rule [m]",
        "σ of survey [m]",
        "difference [m]",
        "±",
        "better",
    ]
    rows = [
        [
            m.rule,
            number(m.distance, 0),
            number(m.survey_distance, 0),
            number(m.sigma, 3),
            number(m.survey_sigma, 3),
            *_with_band(m.survey_sigma - m.sigma, m.difference_band, 3),
            f"{m.better} of {graphs}",
        ]
        for m in matches
    ]
    return table(head, rows)


def _with_band(value: float, band: float, digits: int) -> list[str]:
    return [number(value, digits), number(band, digits) if math.isfinite(band) else "–"]


def _facts(run: Run, tried: Tried | None) -> list[tuple[str, str]]:
    first = next((stop.length for stop in run.stops if stop.complete), math.nan)
    pairs = [
        ("distance", f"{run.length:.0f} m"),
        ("all cameras found after", f"{first:.0f} m" if math.isfinite(first) else "–"),
        ("σ of the cameras", length(run.sigma)),
        ("largest σ of the robot", length(max(math.sqrt(max(s.robot[0] + s.robot[2], 0.0)) for s in run.stops))),
    ]
    if tried:
        tries = (("with simulated noise", tried.map), ("the same, filter alone", tried.filter))
        pairs += [(name, f"{length(e.sigma)}, NEES/dof {number(e.nees, 2)}") for name, e in tries]
    return pairs


def _stops(graph: Graph, run: Run) -> Html:
    names = node_names(graph)
    rows = [
        [
            str(i),
            names[s.node],
            number(s.length, 0),
            number(math.sqrt(max(s.robot[0] + s.robot[2], 0.0)), 3),
            number(s.sigma, 3),
        ]
        for i, s in enumerate(run.stops)
    ]
    return details("All stops", table(["no.", "place ", "distance [m]", "σ robot [m]", "σ cameras [m]"], rows))


def _files(record: Mapping[str, object], gif: bool) -> Html:
    files = _PLAN_FILES | ({"walk.gif": "the drive as an animation"} if gif else {})
    rows = table(["file ", "what for "], files.items())
    return section("Files and settings", rows, details("Settings, versions, input", text("pre", to_toml(record))))


def _foot() -> Html:
    return Html("<footer>" + text("span", _FOOTER.format(groma.__version__)) + "</footer>")
